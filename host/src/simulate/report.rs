//! Every figure of the report on line faults, by one command.

mod burst;
mod clocks;
mod engagements;
mod lost_frames;
mod resynchronisation;
mod wrong_setpoints;

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::value_parser;

use super::parameters::{DEFAULT, Parameters};
use super::plot::Chart;
use super::results::Point;
use super::{output, simulated};
use crate::stream::Failure;

/// Every figure of docs/line-faults.md: NAME.svg, NAME.png, and what was measured as NAME.csv
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Where to write them; made if it is not there
    #[arg(value_name = "DIRECTORY")]
    directory: PathBuf,

    /// Seed of everything random
    #[arg(long, default_value_t = DEFAULT.seed, value_name = "NUMBER")]
    seed: u64,

    /// Per cent of the trials: fewer for a quick look
    #[arg(long, default_value_t = 100, value_name = "NUMBER", value_parser = value_parser!(u32).range(1..=10_000))]
    effort: u32,
}

/// Writes the figures.
///
/// # Errors
/// If they cannot be written.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let directory = &arguments.directory;
    fs::create_dir_all(directory)
        .with_context(|| format!("cannot make the directory {}", directory.display()))?;
    let figures: [(&str, Figure); 6] = [
        ("lost-frames", lost_frames::chart),
        ("baud-error", clocks::chart),
        ("wrong-setpoints", wrong_setpoints::chart),
        ("resynchronisation", resynchronisation::chart),
        ("burst", burst::chart),
        ("failsafe-engagements", engagements::chart),
    ];
    for (name, chart) in figures {
        let measurement = Measurement {
            arguments,
            table: directory.join(name).with_extension("csv"),
        };
        chart(&measurement)?.write(directory, name)?;
        let told = writeln!(
            io::stdout(),
            "{}",
            directory.join(name).with_extension("svg").display()
        );
        told.or_else(|error| Failure::Write(error).told("", "standard output"))?;
    }
    Ok(())
}

type Figure = fn(&Measurement) -> anyhow::Result<Chart>;

/// What a figure is measured with.
struct Measurement<'a> {
    arguments: &'a Arguments,
    table: PathBuf,
}

impl Measurement<'_> {
    fn seed(&self) -> u64 {
        self.arguments.seed
    }

    /// Simulates all of it, and writes down what came of it.
    fn points(&self, parameters: Vec<Parameters>) -> anyhow::Result<Vec<Point>> {
        let parameters = parameters
            .into_iter()
            .map(|point| Parameters {
                seed: self.seed(),
                trials: trials(point.trials, self.arguments.effort),
                ..point
            })
            .collect();
        let points = simulated(parameters)?;
        write_table(&self.table, &points)?;
        Ok(points)
    }
}

/// So many per cent of them, and at least two: of one no interval can be told.
fn trials(all: u32, percent: u32) -> u32 {
    let some = u64::from(all) * u64::from(percent) / 100;
    u32::try_from(some).unwrap_or(u32::MAX).max(2)
}

fn write_table(path: &Path, points: &[Point]) -> anyhow::Result<()> {
    let told = || format!("cannot write {}", path.display());
    let file = File::create(path).with_context(told)?;
    output::write_csv(&mut BufWriter::new(file), points).with_context(told)
}
