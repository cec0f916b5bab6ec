//! The runner's command line.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use nrf52840_emulator::Assumptions;

/// Runs a firmware's ELF on an emulated nRF52840. Sends it bytes at the line's rate, and prints servo
/// pulses, LEDs, the log, resets and watched words.
#[derive(Parser)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The firmware's ELF file
    #[arg(long, value_name = "ELF")]
    pub(crate) elf: PathBuf,

    /// Bytes to send to the board: from a file, from standard input (-) as they arrive, or from a new
    /// pseudo-terminal (pty), whose name is printed
    #[arg(long, value_name = "FILE|-|pty")]
    pub(crate) input: Option<String>,

    /// Baud rate of the sender, 8N1. The firmware sets the receiver's rate
    #[arg(long, default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(300..=2_000_000))]
    pub(crate) baud: u32,

    /// Emulated seconds to run [default: until one second after the input's end]
    #[arg(long, value_parser = seconds)]
    pub(crate) seconds: Option<f64>,

    /// Show each change of a word in RAM, given by its symbol. With NAMEs, show the word's bytes under these names, the
    /// lowest address first
    #[arg(long, value_name = "SYMBOL[=NAME,..]", value_parser = watch)]
    pub(crate) watch: Vec<Watch>,

    /// Print text for people, or one JSON object per line
    #[arg(long, value_enum, default_value_t = ReportFormat::Text)]
    pub(crate) format: ReportFormat,

    /// Probability that a byte's stop bit is low: a framing error
    #[arg(long, default_value_t = 0.0, value_name = "PROBABILITY", value_parser = probability)]
    pub(crate) framing: f64,

    /// Probability of a break of 12 to 40 bits before a byte
    #[arg(long = "break", default_value_t = 0.0, value_name = "PROBABILITY", value_parser = probability)]
    pub(crate) line_break: f64,

    /// Probability of a pause of 10 to 100 bits before a byte
    #[arg(long, default_value_t = 0.0, value_name = "PROBABILITY", value_parser = probability)]
    pub(crate) pause: f64,

    /// Let the chip deviate in one way from the default behaviour. An unknown name prints the list of all names
    #[arg(long, value_name = "NAME", value_parser = assumption)]
    pub(crate) assume: Option<Assumptions>,

    /// Seed of the random faults. The same seed gives the same faults
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
}

const EXAMPLES: &str = "\
Examples:
  nrf52840-emulator --elf firmware.elf --seconds 2
  nrf52840-emulator --elf firmware.elf --input bytes.bin --baud 118000 --framing 0.001
  nrf52840-emulator --elf firmware.elf --input pty --watch SETPOINT=pitch,roll,yaw

A file is sent at the line's rate in emulated time, which runs as fast as it can. Bytes from
standard input or the pseudo-terminal are sent in real time. The times shown are emulated. They follow
the model's cycles, without flash wait states.";

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReportFormat {
    Text,
    Json,
}

/// A word to watch: its symbol, and the names of its bytes, the lowest address first.
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
        format!("the names are {}", names.join(", "))
    })
}

fn probability(text: &str) -> Result<f64, String> {
    number(text, |number| (0.0..=1.0).contains(&number))
        .ok_or_else(|| "a probability is 0 to 1".to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    // The limit is a day of emulated time.
    number(text, |number| number > 0.0 && number <= 86_400.0)
        .ok_or_else(|| "seconds must be more than 0 and at most a day (86400)".to_owned())
}

fn number(text: &str, is_one: impl Fn(f64) -> bool) -> Option<f64> {
    text.parse().ok().filter(|number| is_one(*number))
}
