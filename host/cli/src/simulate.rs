//! Runs many trials of `framelock_simulation` and prints how a faulty line affects the receivers.

use std::io::{self, BufWriter, Write};

use anyhow::Result;
use framelock_simulation::{Parameters, Payload, Protocol, ReceiverTally, Tally, run_all};

use crate::options::{number, probability, protocol, whole};
use crate::output::Output;

const DEFAULT: Parameters = Parameters::DEFAULT;

/// Simulate a faulty line bit by bit, and count the frames that receivers lose. The receivers are the
/// lecture's machine (lecture, which discards a broken frame) and framelock (which searches a broken
/// frame again), each with and without an idle-gap rule.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/simulate.txt"), max_term_width = 80)]
pub(crate) struct Arguments {
    /// Seed the random numbers; the same seed gives the same results
    #[arg(long, default_value_t = DEFAULT.seed, value_name = "NUMBER")]
    seed: u64,

    /// Run this number of independent trials, each beginning at reset
    #[arg(long, default_value_t = DEFAULT.trials, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 1, 1_000_000_000))]
    trials: u32,

    /// Send this number of frames in each trial
    #[arg(long, default_value_t = DEFAULT.frames, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 1, 1_000_000_000))]
    frames: u32,

    /// Send these frames: bin or bin-crc8
    #[arg(long, value_name = "NAME", default_value = "bin", value_parser = protocol, hide_possible_values = true)]
    frame: Protocol,

    /// Send this payload: motion, random (different bytes in each frame), 00414200 (this payload) or ambiguous
    /// (N2 of docs/protocol.md)
    #[arg(long, default_value_t = DEFAULT.payload, value_name = "WHAT")]
    payload: Payload,

    /// Set the rate of the line in bits per second; each byte takes ten bits
    #[arg(long, default_value_t = DEFAULT.baud, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 300, 10_000_000))]
    baud: u32,

    /// Send this number of frames per second
    #[arg(long, default_value_t = DEFAULT.rate, value_name = "NUMBER", value_parser = |text: &str| number(text, 0.01, 1e5))]
    rate: f64,

    /// Lose each byte with this probability (0 to 1), without a report
    #[arg(long, default_value_t = DEFAULT.lose, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    lose: f64,

    /// Invert each bit with this probability (0 to 1)
    #[arg(long, default_value_t = DEFAULT.bit_flip, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    bit_flip: f64,

    /// Make the sender's clock this much faster than the receiver's
    #[arg(long, default_value_t = DEFAULT.baud_error, value_name = "PERCENT", value_parser = |text: &str| number(text, -50.0, 50.0), allow_negative_numbers = true)]
    baud_error: f64,

    /// Disturb the line by this number of bursts of noise per second
    #[arg(long, default_value_t = DEFAULT.burst_rate, value_name = "NUMBER", value_parser = |text: &str| number(text, 0.0, 1e6))]
    burst_rate: f64,

    /// Set the length of a burst
    #[arg(long, default_value_t = DEFAULT.burst_length, value_name = "MS", value_parser = |text: &str| number(text, 0.1, 1e6))]
    burst_length: f64,

    /// After a pause of this many byte times, receivers with an idle-gap rule drop the current frame
    #[arg(long, default_value_t = DEFAULT.idle_gap, value_name = "BYTES", value_parser = |text: &str| whole::<u32>(text, 1, 1_000_000))]
    idle_gap: u32,
}

/// Runs `framelock simulate`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let parameters = Parameters {
        seed: arguments.seed,
        trials: arguments.trials,
        frames: arguments.frames,
        payload: arguments.payload,
        baud: arguments.baud,
        rate: arguments.rate,
        lose: arguments.lose,
        bit_flip: arguments.bit_flip,
        baud_error: arguments.baud_error,
        burst_rate: arguments.burst_rate,
        burst_length: arguments.burst_length,
        idle_gap: arguments.idle_gap,
    };
    let tally = run_all(&arguments.frame, &parameters)?;
    let mut out = BufWriter::new(Output::standard()?);
    write(&arguments.frame, &parameters, &tally, &mut out)?;
    Ok(out.flush()?)
}

type Count = fn(&ReceiverTally) -> u64;

/// The rows of the table of receivers.
const ROWS: [(&str, Count); 5] = [
    ("delivered", |receiver| receiver.delivered),
    ("lost though intact", |receiver| receiver.lost_intact),
    ("wrong setpoints", |receiver| receiver.wrong_setpoints),
    ("false frames", |receiver| receiver.false_frames),
    ("trials that end deaf", |receiver| receiver.deaf),
];

/// Writes the parameters and the tables.
fn write(
    frame: &Protocol,
    parameters: &Parameters,
    tally: &Tally,
    out: &mut impl Write,
) -> io::Result<()> {
    let Parameters {
        seed,
        trials,
        frames,
        payload,
        baud,
        rate,
        ..
    } = parameters;
    let line = &tally.line;
    writeln!(
        out,
        "seed {seed}, {trials} trials of {frames} frames ({frame}, {payload})\n\
         {baud} baud, {rate} frames a second\n"
    )?;
    for (name, count) in [
        ("frames sent", line.frames_sent),
        ("  arrived intact", line.frames_intact),
        ("bytes sent", line.bytes_sent),
        ("  delivered", line.bytes_delivered),
        ("  lost after the UART", line.bytes_lost),
        ("framing errors", line.framing_errors),
    ] {
        writeln!(out, "{name:<22}{count:>14}")?;
    }
    write!(out, "\n{:<24}", "")?;
    for receiver in &tally.receivers {
        let gap = if receiver.has_idle_gap { "+gap" } else { "" };
        let name = format!("{}{gap}", receiver.policy);
        write!(out, "{name:>14}")?;
    }
    writeln!(out)?;
    for (name, count) in ROWS {
        write!(out, "{name:<24}")?;
        for receiver in &tally.receivers {
            write!(out, "{:>14}", count(receiver))?;
        }
        writeln!(out)?;
    }
    Ok(())
}
