//! The runner's command line.

use std::path::PathBuf;

use clap::Parser;

/// Runs a firmware's ELF on an emulated nRF52840. Sends it bytes at the line's rate, and prints servo
/// pulses, the log, resets and watched words.
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
}

const EXAMPLES: &str = "\
Examples:
  nrf52840-emulator --elf firmware.elf --seconds 2
  nrf52840-emulator --elf firmware.elf --input bytes.bin --baud 118000
  nrf52840-emulator --elf firmware.elf --input pty --watch SETPOINT=pitch,roll,yaw

A file is sent at the line's rate in emulated time, which runs as fast as it can. Bytes from
standard input or the pseudo-terminal are sent in real time. The times shown are emulated. They follow
the model's cycles, without flash wait states.";

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

fn seconds(text: &str) -> Result<f64, String> {
    // The limit is a day of emulated time.
    let number: Option<f64> = text.parse().ok();
    let number = number.filter(|number| *number > 0.0 && *number <= 86_400.0);
    number.ok_or_else(|| "seconds must be more than 0 and at most a day (86400)".to_owned())
}
