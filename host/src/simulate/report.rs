//! Every figure of the report on line faults, by one command.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use anyhow::{Context, Result};
use framelock_simulation::Parameters;

use super::arguments::whole;
use super::{figures, output};
use crate::output::Output;

/// Every figure of docs/line-faults.md, as SVG and CSV
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Where to write them; made if it is not there
    #[arg(value_name = "DIRECTORY")]
    directory: PathBuf,

    /// Seed of everything random
    #[arg(long, default_value_t = Parameters::DEFAULT.seed, value_name = "NUMBER", value_parser = whole::<u64>)]
    seed: u64,

    /// Per cent of the trials: fewer for a quick look
    #[arg(long, default_value_t = 100, value_name = "PERCENT", value_parser = whole::<u32>)]
    effort: u32,
}

/// Writes the figures.
pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let directory = &arguments.directory;
    fs::create_dir_all(directory)
        .with_context(|| format!("cannot make the directory {}", directory.display()))?;
    let mut out = Output::standard()?;
    for figure in figures::all()? {
        let path = directory.join(&figure.name).with_extension("svg");
        let cannot_write = || format!("cannot write the figure {}", path.display());
        let (points, chart) = figure.measure(arguments.seed, arguments.effort)?;
        let table = File::create(path.with_extension("csv")).with_context(cannot_write)?;
        output::write_csv(&mut BufWriter::new(table), &points).with_context(cannot_write)?;
        chart.write(&path).with_context(cannot_write)?;
        writeln!(out, "{}", path.display())?;
    }
    Ok(())
}
