//! The command line.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use framelock_emulator::Fault;

/// Runs framelock's firmware on an emulated nRF52840: bytes in at the line rate; setpoints, servo
/// pulses, LEDs and log out.
#[derive(Parser)]
#[command(name = "cargo xtask emulate", bin_name = "cargo xtask emulate", after_help = EXAMPLES)]
// xtask gives the ELF that it has built.
#[command(override_usage = "cargo xtask emulate [OPTIONS]")]
pub(crate) struct Arguments {
    /// The firmware's ELF; by default the firmware is built and used.
    #[arg(long, value_name = "PATH")]
    pub(crate) elf: PathBuf,

    /// What is sent to the board: a file, standard input (-), or whatever is written to a new
    /// pseudo-terminal (pty), whose name is printed. Without it, nothing is sent.
    #[arg(long, value_name = "FILE|-|pty")]
    pub(crate) input: Option<String>,

    /// The sender's baud rate. The firmware's is set when it is built.
    #[arg(long, default_value_t = 115_200, value_name = "BAUD",
          value_parser = clap::value_parser!(u64).range(300..=2_000_000))]
    pub(crate) baud: u64,

    /// What goes wrong on the line, as NAME=PROBABILITY per byte, separated by commas: drop,
    /// insert, flip, framing, parity, break, pause; and baud-error=PERCENT.
    #[arg(long, default_value = "", value_name = "FAULTS", value_parser = parse_faults,
          hide_default_value = true)]
    pub(crate) faults: LineFaults,

    /// The faults repeat exactly with the same seed.
    #[arg(long, default_value_t = 1, value_name = "NUMBER")]
    pub(crate) seed: u64,

    /// How long to run, in emulated seconds; by default until one second after the input's end.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    pub(crate) seconds: Option<f64>,

    /// Lines for people, or one JSON object a line.
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
}

const EXAMPLES: &str = "\
Examples:
  cargo xtask emulate --seconds 2                         silence: boot, then the failsafe parks
  framelock encode moves.csv | cargo xtask emulate --input -
  cargo xtask emulate --input frames.bin --faults drop=1e-3,flip=1e-3,baud-error=+3%
  cargo xtask emulate --input pty                         in real time; then, elsewhere:
  framelock encode moves.csv --output /dev/pts/N

Times are emulated. The cycles behind them are the model's, without flash wait states.";

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    Text,
    Json,
}

/// What goes wrong on the line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LineFaults {
    pub(crate) bytes: Fault,
    /// Per cent of the baud rate.
    pub(crate) baud_error: f64,
}

fn parse_faults(text: &str) -> Result<LineFaults, String> {
    let mut faults = LineFaults::default();
    for item in text.split(',').filter(|item| !item.is_empty()) {
        let (name, value) = item
            .split_once('=')
            .ok_or_else(|| format!("`{item}` is not NAME=VALUE"))?;
        let number = value.strip_suffix('%').unwrap_or(value);
        let number: f64 = number
            .parse()
            .map_err(|_| format!("`{value}` is not a number"))?;
        if name == "baud-error" {
            if !(-50.0..=50.0).contains(&number) {
                return Err(format!("a baud error is -50% to +50%, not {value}"));
            }
            faults.baud_error = number;
            continue;
        }
        let probability = if value.ends_with('%') {
            number / 100.0
        } else {
            number
        };
        if !(0.0..=1.0).contains(&probability) {
            return Err(format!("a probability is 0 to 1, not {value}"));
        }
        let bytes = &mut faults.bytes;
        *match name {
            "drop" => &mut bytes.drop,
            "insert" => &mut bytes.insert,
            "flip" => &mut bytes.flip,
            "framing" => &mut bytes.framing,
            "parity" => &mut bytes.parity,
            "break" => &mut bytes.line_break,
            "pause" => &mut bytes.pause,
            _ => {
                return Err(format!(
                    "no fault is named `{name}`; there are drop, insert, flip, framing, parity, \
                     break, pause, baud-error"
                ));
            }
        } = probability;
    }
    Ok(faults)
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    // A day of emulated time takes longer than anyone waits.
    if seconds > 0.0 && seconds <= 86_400.0 {
        Ok(seconds)
    } else {
        Err("must be more than 0, and at most a day (86400)".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::{LineFaults, parse_faults};
    use framelock_emulator::Fault;

    #[test]
    fn faults_are_named() {
        let bytes = Fault {
            drop: 1e-3,
            flip: 0.02,
            line_break: 1.0,
            ..Fault::default()
        };
        let wanted = LineFaults {
            bytes,
            baud_error: 3.0,
        };
        let text = "drop=1e-3,flip=2%,break=1,baud-error=+3%";
        assert_eq!(parse_faults(text), Ok(wanted));
        assert_eq!(parse_faults(""), Ok(LineFaults::default()));
    }

    #[test]
    fn what_is_no_fault_is_refused() {
        for text in [
            "drip=1",
            "drop",
            "drop=often",
            "drop=2",
            "flip=-1",
            "baud-error=60",
        ] {
            assert!(parse_faults(text).is_err(), "{text}");
        }
    }
}
