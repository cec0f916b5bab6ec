//! The command line.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use nrf52840_emulator::Assumptions;

/// Runs a firmware's ELF on an emulated nRF52840: bytes in at the line's rate; servo pulses, LEDs,
/// log, resets and watched words out.
#[derive(Parser)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The firmware
    #[arg(long, value_name = "ELF")]
    pub(crate) elf: PathBuf,

    /// What is sent to the board: a file, standard input (-) as it comes, or what is written to a new
    /// pseudo-terminal (pty), whose name is printed
    #[arg(long, value_name = "FILE|-|pty")]
    pub(crate) input: Option<String>,

    /// The sender's baud rate, 8N1; the firmware sets its own
    #[arg(long, default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(300..=2_000_000))]
    pub(crate) baud: u32,

    /// How long to run, in emulated seconds [default: until one second after the input's end]
    #[arg(long, value_parser = seconds)]
    pub(crate) seconds: Option<f64>,

    /// A word in RAM whose changes are shown: a symbol, and if its bytes have names, these
    #[arg(long, value_name = "SYMBOL[=NAME,..]", value_parser = watch)]
    pub(crate) watch: Vec<Watch>,

    /// Lines for people, or one JSON object a line
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,

    /// Probability that a byte's stop bit is low: a framing error
    #[arg(long, default_value_t = 0.0, value_name = "PROBABILITY", value_parser = probability)]
    pub(crate) framing: f64,

    /// Probability of a break in front of a byte, of 12 to 40 bits
    #[arg(long = "break", default_value_t = 0.0, value_name = "PROBABILITY", value_parser = probability)]
    pub(crate) line_break: f64,

    /// Probability of a pause in front of a byte, of 10 to 100 bits
    #[arg(long, default_value_t = 0.0, value_name = "PROBABILITY", value_parser = probability)]
    pub(crate) pause: f64,

    /// What this chip does that another may not; a wrong name shows the right ones
    #[arg(long, value_name = "NAME", value_parser = assumption)]
    pub(crate) assume: Option<Assumptions>,

    /// The same seed makes the same faults
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
}

const EXAMPLES: &str = "\
Examples:
  nrf52840-emulator --elf firmware.elf --seconds 2
  nrf52840-emulator --elf firmware.elf --input bytes.bin --baud 118000 --framing 0.001
  nrf52840-emulator --elf firmware.elf --input pty --watch SETPOINT=pitch,roll,yaw

A file is sent at the line's rate, as fast as the emulation goes; what comes at standard input or the
pseudo-terminal is sent in real time. Times shown are emulated. The cycles behind them are the
model's, without flash wait states.";

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    Text,
    Json,
}

/// A word to be watched: its symbol, and the names of its bytes from the lowest address on.
pub(crate) type Watch = (String, Vec<String>);

fn watch(text: &str) -> Result<Watch, String> {
    let (symbol, names) = text.split_once('=').unwrap_or((text, ""));
    let names = names.split(',').filter(|name| !name.is_empty());
    let names: Vec<String> = names.map(str::to_owned).collect();
    if names.len() > 4 {
        return Err("a word has four bytes".to_owned());
    }
    Ok((symbol.to_owned(), names))
}

fn assumption(name: &str) -> Result<Assumptions, String> {
    Assumptions::named(name).ok_or_else(|| {
        let names: Vec<&str> = Assumptions::each().iter().map(|(name, _)| *name).collect();
        format!("known are {}", names.join(", "))
    })
}

fn probability(text: &str) -> Result<f64, String> {
    number(text, |number| (0.0..=1.0).contains(&number))
        .ok_or_else(|| "a probability is 0 to 1".to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    // A day of emulated time takes longer than anyone waits.
    number(text, |number| number > 0.0 && number <= 86_400.0)
        .ok_or_else(|| "more than 0, and at most a day (86400)".to_owned())
}

fn number(text: &str, is_one: impl Fn(f64) -> bool) -> Option<f64> {
    text.parse().ok().filter(|number| is_one(*number))
}
