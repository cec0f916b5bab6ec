//! Runs many trials of `framelock_simulation` and prints how a faulty line affects the receivers. The public items are
//! for `examples/figures`, which draws the figures of docs/line-faults.md.

mod arguments;
mod experiment;
mod output;
mod sweep;

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use anyhow::Result;
use clap::{Args as _, FromArgMatches as _, ValueEnum};
use framelock_simulation::Parameters;

use crate::output::Output;
use arguments::Experiment;
pub use experiment::{Point, run_all};
pub use output::{rows, write_csv};

/// Simulate a faulty line bit by bit, and count the frames that receivers lose. The receivers are the
/// lecture's machine (lecture, which discards a broken frame) and framelock (which searches a broken
/// frame again), each with and without an idle-gap rule. A failsafe follows each receiver.
#[derive(clap::Args)]
#[command(
    after_help = include_str!("help/simulate.txt"),
    max_term_width = 80
)]
pub(crate) struct Arguments {
    #[command(flatten)]
    experiment: Experiment,

    /// Write the tables as text, csv or json
    #[arg(
        long,
        value_enum,
        default_value_t = OutputFormat::Text,
        hide_possible_values = true,
        help_heading = "Run"
    )]
    format: OutputFormat,

    /// Write the tables to FILE, replacing it; - is standard output
    #[arg(
        long,
        short,
        value_name = "FILE",
        default_value = "-",
        help_heading = "Run"
    )]
    output: PathBuf,
}

/// The format of the results.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum OutputFormat {
    /// Tables for people to read
    Text,
    /// Comma-separated values with a header, and a row for each point and receiver
    Csv,
    /// One JSON object
    Json,
}

/// Returns the parameters for options of `framelock simulate`.
///
/// # Errors
/// Returns an error if an option is unknown or invalid, or the parameters contradict each other.
pub fn parameters(options: &str) -> Result<Vec<Parameters>> {
    let command = Experiment::augment_args(clap::Command::new("run").no_binary_name(true));
    let matches = command.try_get_matches_from(options.split_whitespace())?;
    Experiment::from_arg_matches(&matches)?.points()
}

/// Runs `framelock simulate`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let points = arguments.experiment.points()?;
    // Create the output before the simulation, so that an error does not waste the work.
    let mut out = BufWriter::new(Output::create(&arguments.output)?);
    let points = run_all(points)?;
    match arguments.format {
        OutputFormat::Text => output::write_text(&mut out, &arguments.experiment.sweeps, &points),
        OutputFormat::Csv => write_csv(&mut out, &points),
        OutputFormat::Json => output::write_json(&mut out, &arguments.experiment.sweeps, &points),
    }?;
    Ok(out.flush()?)
}
