//! What a faulty line does to the system: many trials of `framelock_simulation`, in numbers and
//! figures.

mod arguments;
mod experiment;
mod figures;
mod output;
mod plot;
mod report;
mod sweep;

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use anyhow::Result;
use clap::ValueEnum;

use crate::output::Output;
use arguments::Experiment;

/// What a faulty line does: a line simulated bit by bit, the lecture's machine at its end
/// (discard, which keeps nothing of a broken frame) and the receiver (rescan, which searches it),
/// each with and without an idle-gap rule, a failsafe behind each.
#[derive(clap::Args)]
#[command(
    after_help = include_str!("help/simulate.txt"),
    args_conflicts_with_subcommands = true,
    max_term_width = 80
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    experiment: Experiment,

    /// Tables as text, csv or json
    #[arg(
        long,
        value_enum,
        default_value_t = OutputFormat::Text,
        hide_possible_values = true,
        help_heading = "Run"
    )]
    format: OutputFormat,

    /// A file for them; - is standard output
    #[arg(
        long,
        short,
        value_name = "FILE",
        default_value = "-",
        help_heading = "Run"
    )]
    output: PathBuf,
}

#[derive(clap::Subcommand)]
enum Command {
    Report(report::Arguments),
}

/// How results are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum OutputFormat {
    /// Tables for people to read
    Text,
    /// Comma-separated values under a header: a row for each point and receiver
    Csv,
    /// One JSON object
    Json,
}

/// Runs `framelock simulate`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if let Some(Command::Report(arguments)) = &arguments.command {
        return report::run(arguments);
    }
    let points = arguments.experiment.points()?;
    // Before the work, so that it is not in vain.
    let mut out = BufWriter::new(Output::create(&arguments.output)?);
    let points = experiment::run(points)?;
    match arguments.format {
        OutputFormat::Text => output::write_text(&mut out, &arguments.experiment.sweeps, &points),
        OutputFormat::Csv => output::write_csv(&mut out, &points),
        OutputFormat::Json => output::write_json(&mut out, &arguments.experiment.sweeps, &points),
    }?;
    Ok(out.flush()?)
}
