//! Setpoints from a stream: a file, standard input or a serial port.

use std::io::{self, BufRead, BufWriter, Write};
use std::path::PathBuf;

use anyhow::Context;
use clap::ValueEnum;
use framelock::{
    Accounting, Bin, BinCrc8, Discard, Discarded, Lecture, Parser, Receiver, Setpoint,
};
use serde::Serialize;

use crate::input::Input;
use crate::names::{FrameName, PolicyName};
use crate::standard;
use crate::stream::{CHUNK_LENGTH, Failure, for_each_chunk};

/// Setpoints from a stream: a file, standard input or a serial port.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  framelock decode capture.bin                       one JSON object per setpoint
  framelock decode capture.bin --format none --summary
                                                     how good was the line?
  framelock decode /dev/ttyUSB0 --format text        watch a serial port; Ctrl-C ends it
  framelock decode < capture.bin | framelock encode | cmp - clean.bin

A setpoint's offset is that of its frame's last byte, the CR, counted from 0.
No stream is an error, however broken: --summary tells where each byte has gone, with
bytes = frame_length * frames + discarded + pending.")]
pub struct Arguments {
    /// A file, a serial port such as /dev/ttyUSB0 or COM3, or - for standard input
    #[arg(value_name = "FILE|PORT", default_value = "-")]
    input: PathBuf,
    /// What to do with the bytes behind a broken frame
    #[arg(long, value_enum, default_value_t = PolicyName::Rescan)]
    policy: PolicyName,
    /// The frame format
    #[arg(long, value_enum, default_value_t = FrameName::Bin)]
    frame: FrameName,
    /// How to write setpoints
    #[arg(long, value_enum, default_value_t = OutputFormat::Jsonl)]
    format: OutputFormat,
    /// At the end, write one JSON object that says what became of every byte; Ctrl-C is an end
    #[arg(long)]
    summary: bool,
    /// The serial port's rate [default: 115200]; 8 data bits, no parity, 1 stop bit
    #[arg(long, value_name = "RATE", value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
}

/// How setpoints are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum OutputFormat {
    /// A JSON object per line
    Jsonl,
    /// Comma-separated values under a header
    Csv,
    /// Columns for people to read
    Text,
    /// Nothing
    None,
}

/// Where every byte of a stream has gone.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct Summary {
    /// Bytes read.
    pub bytes: u64,
    /// Bytes in a frame.
    pub frame_length: u64,
    /// Frames committed.
    pub frames: u64,
    /// Bytes that are part of no frame.
    pub discarded: u64,
    /// Bytes at the end that could have become a frame.
    pub pending: u64,
    /// The discarded ones by reason. A file or a port reports no line events.
    pub discarded_by: Discarded,
    /// Frames that ended a loss.
    pub resynchronisations: u64,
}

impl Summary {
    fn of<P: Parser>(line: &Accounting<P>) -> Self {
        let counters = line.counters();
        Self {
            bytes: counters.bytes,
            frame_length: P::FRAME_LENGTH as u64,
            frames: counters.frames,
            discarded: counters.discarded.total(),
            pending: line.pending() as u64,
            discarded_by: counters.discarded,
            resynchronisations: counters.resynchronisations,
        }
    }
}

/// Runs the subcommand.
///
/// # Errors
/// The input cannot be opened or read, or the output not be written. A broken stream is no error.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut input = Input::open(&arguments.input, arguments.baud)?;
    let name = input.name.clone();
    let output = standard::output().context("cannot open standard output")?;
    let is_silent = arguments.format == OutputFormat::None;
    let progress = input.show_progress(Some(&output).filter(|_| !is_silent));
    let mut reader: Box<dyn BufRead> = if arguments.summary {
        Box::new(input.into_reader_until_ctrl_c()?)
    } else {
        Box::new(input.into_reader())
    };
    let mut output = BufWriter::with_capacity(CHUNK_LENGTH, output);
    let decode = match (arguments.policy, arguments.frame) {
        (PolicyName::Rescan, FrameName::Bin) => decode::<Receiver<Bin>, _, _>,
        (PolicyName::Rescan, FrameName::BinCrc8) => decode::<Receiver<BinCrc8>, _, _>,
        (PolicyName::Discard, FrameName::Bin) => decode::<Lecture, _, _>,
        (PolicyName::Discard, FrameName::BinCrc8) => decode::<Receiver<BinCrc8, Discard>, _, _>,
    };
    let outcome = decode(&mut reader, &mut output, arguments.format);
    progress.finish_and_clear();
    outcome
        .and_then(|summary| {
            if arguments.summary {
                serde_json::to_writer(&mut output, &summary).map_err(io::Error::from)?;
                writeln!(output)?;
                output.flush()?;
            }
            Ok(())
        })
        .or_else(|failure| failure.told(&name, "standard output"))
}

/// Decodes `input` to its end: writes each setpoint to `output` no later than the next byte is
/// waited for.
///
/// # Errors
/// The input cannot be read or the output not be written.
pub fn decode<P, R, W>(
    input: &mut R,
    output: &mut W,
    format: OutputFormat,
) -> Result<Summary, Failure>
where
    P: Parser<Message = Setpoint> + Default,
    R: BufRead,
    W: Write,
{
    let mut line = Accounting::new(P::default());
    if format == OutputFormat::Csv {
        writeln!(output, "offset,pitch,roll,yaw")?;
    }
    for_each_chunk(input, |chunk| {
        if format == OutputFormat::None {
            // One comparison per frame less: they come by the hundred million a second.
            line.feed(chunk, |_, _| ());
            return Ok(());
        }
        let offset = line.counters().bytes;
        let mut outcome = Ok(());
        line.feed(chunk, |index, setpoint| {
            if outcome.is_ok() {
                outcome = write_setpoint(output, format, offset + index as u64, setpoint);
            }
        });
        outcome?;
        Ok(output.flush()?)
    })?;
    output.flush()?;
    Ok(Summary::of(&line))
}

fn write_setpoint(
    output: &mut impl Write,
    format: OutputFormat,
    offset: u64,
    Setpoint { pitch, roll, yaw }: Setpoint,
) -> io::Result<()> {
    let names = match format {
        OutputFormat::Jsonl => [
            r#"{"offset":"#,
            r#","pitch":"#,
            r#","roll":"#,
            r#","yaw":"#,
            "}\n",
        ],
        OutputFormat::Csv => ["", ",", ",", ",", "\n"],
        OutputFormat::Text => {
            return writeln!(
                output,
                "byte {offset:>10}   pitch {pitch:>3}   roll {roll:>3}   yaw {yaw:>3}"
            );
        }
        OutputFormat::None => return Ok(()),
    };
    let [before_offset, before_pitch, before_roll, before_yaw, end] = names;
    let mut digits = itoa::Buffer::new();
    for (name, value) in [
        (before_offset, offset),
        (before_pitch, pitch.into()),
        (before_roll, roll.into()),
        (before_yaw, yaw.into()),
    ] {
        output.write_all(name.as_bytes())?;
        output.write_all(digits.format(value).as_bytes())?;
    }
    output.write_all(end.as_bytes())
}
