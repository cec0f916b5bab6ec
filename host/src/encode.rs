//! Frames from setpoints.

use std::fs::{self, File};
use std::io::{BufRead, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use framelock::{Bin, BinCrc8, Format, Setpoint};

use crate::input::Input;
use crate::names::FrameName;
pub use crate::setpoints::InputFormat;
use crate::setpoints::{Row, Rows};
use crate::standard;
use crate::stream::{CHUNK_LENGTH, Failure, for_each_chunk};

/// Frames from setpoints.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  framelock encode moves.csv --output moves.bin
  echo 127,200,74 | framelock encode | xxd           41 42 00 7f c8 4a 0d
  framelock decode a.bin | framelock encode --frame bin-crc8 > b.bin
  stty -F /dev/ttyUSB0 115200 raw && framelock encode moves.csv --output /dev/ttyUSB0

Comma-separated values: three columns pitch,roll,yaw, or a header that names these three among
others. JSON lines: one object each, with pitch, roll and yaw among others.
Every demand is a whole number from 0 to 255.")]
pub struct Arguments {
    /// A file, or - for standard input
    #[arg(value_name = "FILE", default_value = "-")]
    input: PathBuf,
    /// The frame format
    #[arg(long, value_enum, default_value_t = FrameName::Bin)]
    frame: FrameName,
    /// How setpoints are written
    #[arg(long, value_enum, default_value_t = InputFormat::Auto)]
    input_format: InputFormat,
    /// Where frames go, - being standard output even if that is a terminal; a file is replaced
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the subcommand.
///
/// # Errors
/// The input cannot be opened or read, or holds what is no setpoint; the output cannot be written,
/// or is a terminal.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut input = Input::open(&arguments.input, None)?;
    let input_name = input.name.clone();
    let (output, output_name) = open_output(arguments.output.as_deref(), &arguments.input)?;
    let progress = input.show_progress(Some(&output));
    let mut output = BufWriter::with_capacity(CHUNK_LENGTH, output);
    let encode = match arguments.frame {
        FrameName::Bin => encode::<Bin, _, _>,
        FrameName::BinCrc8 => encode::<BinCrc8, _, _>,
    };
    let outcome = encode(
        &mut input.into_reader(),
        &mut output,
        arguments.input_format,
    );
    progress.finish_and_clear();
    outcome.or_else(|failure| failure.told(&input_name, &output_name))
}

fn open_output(argument: Option<&Path>, input: &Path) -> anyhow::Result<(File, String)> {
    match argument {
        Some(path) if path.as_os_str() != "-" => {
            let name = path.display().to_string();
            // It would be emptied before it is read.
            if fs::canonicalize(path)
                .is_ok_and(|output| Some(output) == fs::canonicalize(input).ok())
                && path.is_file()
            {
                bail!("{name} is the input: give --output another name");
            }
            let file = File::create(path).map_err(|error| {
                anyhow!("cannot write to {name}: {error}; name a file to write")
            })?;
            Ok((file, name))
        }
        None if std::io::stdout().is_terminal() => bail!(
            "standard output is a terminal, and frames are binary: redirect it, or name a file \
             with --output, where - is the terminal all the same"
        ),
        _ => {
            let file = standard::output().context("cannot open standard output")?;
            Ok((file, "standard output".to_owned()))
        }
    }
}

/// Encodes `input` to its end: writes each frame to `output` no later than the next row is waited
/// for.
///
/// # Errors
/// The input cannot be read or holds what is no setpoint, or the output cannot be written. What
/// came before has been written.
pub fn encode<F, R, W>(input: &mut R, output: &mut W, format: InputFormat) -> Result<(), Failure>
where
    F: Format<Message = Setpoint, Frame: AsRef<[u8]>>,
    R: BufRead,
    W: Write,
{
    let mut rows = Rows::new(format);
    for_each_chunk(input, |chunk| {
        let outcome = rows.feed(chunk, |row| write_frame::<F>(output, row));
        output.flush()?;
        outcome
    })?;
    rows.finish(|row| write_frame::<F>(output, row))?;
    Ok(output.flush()?)
}

fn write_frame<F: Format<Message = Setpoint>>(
    output: &mut impl Write,
    row: Row,
) -> Result<(), Failure> {
    Ok(output.write_all(F::encode(row.setpoint).as_ref())?)
}
