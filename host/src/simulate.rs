//! What a faulty line does to the system: many trials of a sender, a line bit by bit, a UART, the
//! receivers of both policies and the failsafe.
//!
//! ```text
//!  payload ─► line ─► uart ─► losses ─► station: Discard ─► failsafe ─┐
//!               ▲                  ├──► station: Rescan ──► failsafe ─┼─► tally ─► results
//!             noise                └──► each with an idle-gap rule ───┘
//!                                         ▲
//!                              truth: what really arrived
//! ```

mod experiment;
mod line;
mod noise;
mod occurrences;
mod output;
mod parameters;
mod payload;
mod plot;
mod report;
mod results;
mod station;
mod statistics;
mod sweep;
mod tally;
mod theory;
mod trial;
mod truth;
mod uart;

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};

use crate::standard;
use crate::stream::Failure;
use parameters::Parameters;
use results::Point;
use sweep::Sweep;

/// What a faulty line does to the system: a simulated line, bit by bit, into the lecture's machine
/// (policy discard) and the receiver (policy rescan), each with and without an idle-gap rule and
/// with a failsafe behind it.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    parameters: Parameters,

    /// Go through a range: NAME=FROM:TO:STEP, NAME=FROM:TO:xFACTOR or NAME=VALUE,VALUE,... with the
    /// name of any option that is a number, but the seed; once or twice
    #[arg(
        long,
        value_name = "NAME=RANGE",
        help_heading = "Run",
        allow_hyphen_values = true
    )]
    sweep: Vec<Sweep>,

    /// How to write results
    #[arg(long, value_enum, default_value_t = OutputFormat::Text, help_heading = "Run")]
    format: OutputFormat,

    /// Where results go, - being standard output; a file is replaced
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

const EXAMPLES: &str = "\
Examples:
  framelock simulate --lose 0.001                          a line that loses a byte in a thousand
  framelock simulate --baud-error 4 --rate 1600            clocks that differ, no pause between frames
  framelock simulate --payload 00414200 --lose-one-in 0    one lost byte, and the lecture's machine
                                                           never hears again
  framelock simulate --sweep bit-flip=1e-6:1e-3:x10 --sweep rate=50,500 --format csv
  framelock simulate --burst-rate 0.2 --burst-length 300 --format json --output bursts.json
  framelock simulate report docs/figures                   every figure of docs/line-faults.md

What is counted:
  intact           every byte of the frame was delivered as it was sent, and nothing between them
  delivered        the frame's setpoint was committed with the frame's own last byte
  lost intact      intact, and not delivered
  wrong setpoint   a commit of a frame's own bytes, all of them, some corrupted: another setpoint
  false frame      any other commit: of bytes that are not one sent frame
  resynchronised   from the start of the first intact frame after a loss to the next delivery
  actuator error   output of the failsafe against the setpoint sent last, every 2 ms, in units of
                   demand; of motion only
Shares have Wilson's 95 % interval in CSV and JSON.";

/// How results are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum OutputFormat {
    /// Tables for people to read
    Text,
    /// Comma-separated values under a header: a row for each point and receiver
    Csv,
    /// One JSON object
    Json,
}

/// Runs `framelock simulate`.
///
/// # Errors
/// A parameter is out of its range or contradicts another, or what came of it cannot be written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if let Some(Command::Report(arguments)) = &arguments.command {
        return report::run(arguments);
    }
    let points = sweep::points(&arguments.parameters, &arguments.sweep)?;
    // Before the work, so that it is not in vain.
    let (file, name) = if arguments.output.as_os_str() == "-" {
        let file = standard::output().context("cannot open standard output")?;
        (file, "standard output".to_owned())
    } else {
        let name = arguments.output.display().to_string();
        let file = File::create(&arguments.output)
            .map_err(|error| anyhow!("cannot write to {name}: {error}; name a file to write"))?;
        (file, name)
    };
    let points = simulated(points)?;
    let mut out = BufWriter::new(file);
    let written = match arguments.format {
        OutputFormat::Text => output::write_text(&mut out, &arguments.sweep, &points),
        OutputFormat::Csv => output::write_csv(&mut out, &points),
        OutputFormat::Json => output::write_json(&mut out, &arguments.sweep, &points),
    };
    written
        .and_then(|()| out.flush())
        .or_else(|error| Failure::Write(error).told("", &name))
}

/// Runs them one after the other, with progress on a terminal.
fn simulated(points: Vec<Parameters>) -> anyhow::Result<Vec<Point>> {
    let trials = points.iter().map(|point| u64::from(point.trials)).sum();
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} trials, {eta} left");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    // It shows itself on standard error if that is a terminal, else not at all.
    let progress = ProgressBar::new(trials).with_style(style);
    let outcome = points
        .into_iter()
        .map(|parameters| {
            let tally = experiment::run(&parameters, || progress.inc(1))?;
            Ok(Point::new(parameters, &tally))
        })
        .collect();
    progress.finish_and_clear();
    outcome
}

#[cfg(test)]
mod tests;
