//! What the state machine does with each byte: the lecture's table, a row per byte.

mod examples;
mod observed;
mod source;
mod table;

use std::ffi::OsString;
use std::io::{self, BufRead, BufWriter, Write};

use anyhow::{Result, anyhow};

use crate::input::Input;
use crate::stream::{Failure, for_each_chunk};
use source::Source;
use table::Table;

/// Show what the state machine does with each byte: the lecture's table, a row per byte.
///
/// Each row has the byte's offset, the byte, the state before and after it (the lecture's names:
/// A, B, 1, 2, 3, 4, CR), the temporary pitch, roll and yaw as stored last, the setpoint in force
/// (SP), and what happened. Below the rows: where every byte has gone.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Bytes in hex, separate or glued; or one file or serial port; or - for standard input.
    /// Nothing: the lecture's two worked examples
    ///
    /// What can be read as hex is hex, even if a file has that name: write ./4142 for the file.
    #[arg(value_name = "HEX|FILE|PORT|-")]
    source: Vec<OsString>,

    /// Which machine: the lecture's (discard), the receiver (rescan), or both
    ///
    /// With both there is one row where they do the same and one each where they differ: what
    /// firmware like the lecture's makes of the bytes, and what this receiver does.
    #[arg(long, value_enum, default_value_t = Policy::Both)]
    policy: Policy,

    /// A table, or a JSON object per byte and machine
    #[arg(
        long,
        value_enum,
        default_value_t = Format::Text,
        requires_if("jsonl", "source")
    )]
    format: Format,

    /// The serial port's rate [default: 115200]; 8 data bits, no parity, 1 stop bit
    #[arg(long, value_name = "RATE", value_parser = clap::value_parser!(u32).range(1..), requires = "source")]
    baud: Option<u32>,
}

const EXAMPLES: &str = "\
Examples:
  framelock trace                               the lecture's two worked examples
  framelock trace 41 42 00 7F C8 4A 0D          some bytes
  framelock trace 4142007FC84A0D                the same
  framelock trace capture.bin | less            a capture; it may be of any size
  framelock trace /dev/ttyACM0 --baud 115200    what a serial port delivers, as it comes
  framelock trace capture.bin --policy rescan   the receiver alone";

/// Whose steps are shown.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub(crate) enum Policy {
    /// The lecture's machine, which discards a failed frame
    Discard,
    /// The receiver, which searches a failed frame for the start of the next
    Rescan,
    /// Both
    Both,
}

/// How the steps are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub(crate) enum Format {
    /// A table to read
    Text,
    /// One JSON object per line
    Jsonl,
}

/// Runs `framelock trace`.
///
/// # Errors
/// If the arguments are neither bytes nor a file, or if reading or writing fails. That the reader
/// of the output has gone is no error.
pub fn run(arguments: &Arguments) -> Result<()> {
    let &Arguments { policy, format, .. } = arguments;
    let mut out = BufWriter::new(io::stdout().lock());
    let (name, outcome) = match source::choose(&arguments.source)? {
        Source::Examples => (String::new(), examples::print(policy, &mut out)),
        Source::Bytes(bytes) => {
            let mut bytes = bytes.as_slice();
            (String::new(), print(&mut bytes, policy, format, &mut out))
        }
        Source::File { path, why } => {
            let input = Input::open(&path, arguments.baud)
                .map_err(|error| anyhow!("not hex: {why}; and no file: {error:#}"))?;
            let name = input.name.clone();
            (
                name,
                print(&mut input.into_reader(), policy, format, &mut out),
            )
        }
    };
    outcome
        .and_then(|()| Ok(out.flush()?))
        .or_else(|failure| failure.told(&name, "standard output"))
}

/// Prints the rows as the bytes come: whatever is there is shown before more is waited for.
fn print(
    input: &mut impl BufRead,
    policy: Policy,
    format: Format,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let mut table = Table::new(policy, format);
    table.begin(out)?;
    out.flush()?;
    for_each_chunk(input, |chunk| {
        for &byte in chunk {
            table.push(byte, out)?;
        }
        Ok(out.flush()?)
    })?;
    Ok(table.end(out)?)
}
