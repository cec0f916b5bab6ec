//! Frames from a stream: a file, standard input or a serial port.

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::Result;
use clap::ValueEnum;
use framelock::{Discarded, Found};
use serde::Serialize;

use crate::frame::Frame;
use crate::input::{CHUNK_LENGTH, Input, for_each_chunk};
use crate::interrupt;
use crate::line::Line;
use crate::names::PolicyName;
use crate::output::{Output, exit_code};

/// Frames from a stream: a file, standard input or a serial port.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/decode.txt"))]
pub(crate) struct Arguments {
    /// A file, a serial port such as /dev/ttyUSB0 or COM3, or - for standard input
    #[arg(value_name = "FILE|PORT", default_value = "-")]
    input: PathBuf,
    /// What to do with the bytes behind a broken frame
    #[arg(long, value_enum, default_value_t = PolicyName::Rescan)]
    policy: PolicyName,
    /// The frames: a name, or a file that describes them [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = Frame::named)]
    frame: Frame,
    /// Write the frames' description and nothing else: to read it, or to begin one of your own with
    #[arg(long)]
    describe: bool,
    /// How to write frames
    #[arg(long, value_enum, default_value_t = OutputFormat::Jsonl)]
    format: OutputFormat,
    /// At the end, write one JSON object that says what became of every byte; Ctrl-C is an end
    #[arg(long)]
    summary: bool,
    /// The serial port's rate [default: 115200]; 8 data bits, no parity, 1 stop bit
    #[arg(long, value_name = "RATE", value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
}

/// How frames are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum OutputFormat {
    /// A JSON object per line
    Jsonl,
    /// Comma-separated values under a header
    Csv,
    /// Columns for people to read
    Text,
    /// Nothing
    None,
}

impl OutputFormat {
    /// Writes a frame whose last byte is at `offset`.
    fn write(
        self,
        output: &mut impl Write,
        offset: usize,
        frame: &Frame,
        bytes: &[u8],
    ) -> io::Result<()> {
        match self {
            Self::Jsonl => frame.write_json(output, offset, bytes)?,
            Self::Csv => return frame.write_csv(output, offset, bytes),
            Self::Text => {
                write!(output, "byte {offset:>10}")?;
                frame.write_text(output, bytes)?;
            }
            Self::None => return Ok(()),
        }
        writeln!(output)
    }
}

/// Where every byte of a stream has gone: bytes = bytes in frames + discarded + pending.
#[derive(PartialEq, Debug, Serialize)]
struct Summary {
    bytes: usize,
    /// Where all frames have the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_length: Option<usize>,
    frames: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_bytes: Option<usize>,
    discarded: usize,
    pending: usize,
    discarded_by: Discarded,
    resynchronisations: usize,
}

/// Receives frames and writes them.
struct Decoder<W> {
    line: Line,
    frame: Frame,
    format: OutputFormat,
    output: W,
    /// How many bytes have become a frame, or were discarded.
    settled: usize,
    is_summarised: bool,
}

impl<W: Write> Decoder<W> {
    fn new(frame: &Frame, policy: PolicyName, format: OutputFormat, output: W) -> Result<Self> {
        Ok(Self {
            line: Line::new(frame, policy)?,
            frame: frame.clone(),
            format,
            output,
            settled: 0,
            is_summarised: false,
        })
    }

    fn take(&mut self, bytes: &[u8]) -> Result<()> {
        let Self {
            frame,
            format,
            output,
            settled,
            ..
        } = self;
        let mut outcome = Ok(());
        self.line.feed(bytes, |found| match found {
            Found::Frame { length, message } => {
                *settled += length;
                if outcome.is_ok() {
                    outcome = format.write(output, *settled - 1, frame, message);
                }
            }
            Found::Dropped { count, .. } => *settled += count,
        });
        outcome?;
        Ok(output.flush()?)
    }

    fn summary(&self) -> Summary {
        let counters = self.line.counters();
        let length = self
            .frame
            .has_setpoints()
            .then(|| self.frame.described.longest());
        Summary {
            bytes: counters.bytes,
            frame_length: length,
            frames: counters.frames,
            frame_bytes: length.is_none().then_some(counters.frame_bytes),
            discarded: counters.discarded.total(),
            pending: self.line.pending(),
            discarded_by: counters.discarded,
            resynchronisations: counters.resynchronisations,
        }
    }

    /// Writes the summary, unless it is there already.
    fn summarise(&mut self) -> Result<()> {
        if !std::mem::replace(&mut self.is_summarised, true) {
            writeln!(self.output, "{}", serde_json::to_string(&self.summary())?)?;
        }
        Ok(self.output.flush()?)
    }
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if arguments.describe {
        return Ok(Output::standard()?.write_all(arguments.frame.text.as_bytes())?);
    }
    let input = Input::open(&arguments.input, arguments.baud)?;
    let output = Output::standard()?;
    if output.is_file || arguments.format == OutputFormat::None {
        input.show_progress();
    }
    let progress = input.progress.clone();
    let output = BufWriter::with_capacity(CHUNK_LENGTH, output);
    let decoder = Decoder::new(&arguments.frame, arguments.policy, arguments.format, output)?;
    let decoder = Arc::new(Mutex::new(decoder));
    if arguments.summary {
        let decoder = Arc::clone(&decoder);
        interrupt::watch(move || {
            progress.finish_and_clear();
            std::process::exit(exit_code(lock(&decoder).summarise()).into());
        })?;
    }
    decode(&decoder, input)?;
    if arguments.summary {
        lock(&decoder).summarise()?;
    }
    Ok(())
}

/// Decodes `input` to its end: writes each frame no later than the next byte is waited for.
fn decode<W: Write>(decoder: &Mutex<Decoder<W>>, input: Input) -> Result<()> {
    {
        let Decoder {
            format,
            output,
            frame,
            ..
        } = &mut *lock(decoder);
        if *format == OutputFormat::Csv {
            frame.write_csv_header(output)?;
        }
    }
    for_each_chunk(input, |chunk| lock(decoder).take(chunk))
}

/// What is in there is whole, even after a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::indexing_slicing,
        reason = "a panic fails the test"
    )]

    use std::io::Read;

    use framelock::Setpoint;
    use framelock_proofs::reference::{self, Event, Policy};
    use rand::{Rng, SeedableRng, seq::IndexedRandom};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::line::Watched;

    /// Gives a few bytes at a time, and fails in passing in between.
    struct Dribble<'a>(&'a [u8], ChaCha8Rng);

    impl Read for Dribble<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            if self.1.random_ratio(1, 4) {
                return Err(io::ErrorKind::Interrupted.into());
            }
            let count = self.1.random_range(1..=9).min(buffer.len());
            self.0.read(&mut buffer[..count])
        }
    }

    /// Noise that is full of beginnings of frames, some frames, and an end anywhere.
    fn noise(frame: &Frame, random: &mut ChaCha8Rng) -> Vec<u8> {
        let mut stream = Vec::new();
        for _ in 0..random.random_range(0..60) {
            if random.random_ratio(1, 3) {
                let bytes: [u8; 3] = std::array::from_fn(|_| *b"AB\r?".choose(random).unwrap());
                stream.extend(frame.encode_setpoint(Setpoint::from(bytes)));
            } else {
                stream.push(*b"AB\r?".choose(random).unwrap());
            }
        }
        stream.truncate(random.random_range(0..=stream.len()));
        stream
    }

    /// Against the reference: every row, every byte that is discarded, and where all have gone.
    fn agrees<F: reference::Format>(name: &str, policy: PolicyName, reference: Policy) {
        let frame = &Frame::named(name).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut frames_in_all = 0;
        for _ in 0..2_000 {
            let stream = noise(frame, &mut random);
            let mut undecided = stream.iter().copied();
            let mut rows = b"offset,pitch,roll,yaw\n".to_vec();
            let (mut setpoints, mut discarded) = (vec![], vec![]);
            let pending = reference::whole_buffer::<F>(&stream, reference, |event| match event {
                Event::Dropped { count, .. } => discarded.extend(undecided.by_ref().take(count)),
                Event::Frame { index, setpoint } => {
                    let [pitch, roll, yaw] = setpoint;
                    writeln!(rows, "{index},{pitch},{roll},{yaw}").unwrap();
                    setpoints.push(Setpoint::from(setpoint));
                    undecided.by_ref().take(F::LENGTH).for_each(drop);
                }
            });
            frames_in_all += setpoints.len();

            let mut output = Vec::new();
            let decoder = Decoder::new(frame, policy, OutputFormat::Csv, &mut output).unwrap();
            let decoder = Mutex::new(decoder);
            let input = Input::new("", Dribble(&stream, random.clone()));
            decode(&decoder, input).unwrap();
            let summary = lock(&decoder).summary();
            let expected = Summary {
                bytes: stream.len(),
                frame_length: Some(F::LENGTH),
                frames: setpoints.len(),
                discarded: discarded.len(),
                pending,
                ..summary
            };
            assert_eq!(summary, expected, "{stream:?}");
            assert_eq!(summary.discarded_by.total(), summary.discarded);
            assert_eq!(output, rows, "{stream:?}");

            // Byte by byte, with counters that are set to zero somewhere.
            let mut watched = Watched::new(Line::new(frame, policy).unwrap());
            let reset_at = random.random_range(0..60);
            let (mut seen, mut gone, mut counted) = (vec![], vec![], 0);
            for (place, &byte) in stream.iter().enumerate() {
                if place == reset_at {
                    watched.reset_counters();
                    counted = watched.pending().len();
                }
                for piece in watched.push(byte) {
                    match piece.dropped {
                        None => seen.extend(frame.setpoint(&piece.bytes)),
                        Some(_) => gone.extend(piece.bytes),
                    }
                }
                counted += 1;
            }
            assert_eq!((seen, gone), (setpoints, discarded), "{stream:?}");
            assert_eq!(watched.pending(), &stream[stream.len() - pending..]);
            assert_eq!(watched.counters().bytes, counted);
        }
        assert!(frames_in_all > 2_000, "{frames_in_all}");
    }

    #[test]
    fn every_machine_agrees_with_the_reference() {
        agrees::<reference::Bin>("bin", PolicyName::Rescan, Policy::Rescan);
        agrees::<reference::Bin>("bin", PolicyName::Discard, Policy::Discard);
        agrees::<reference::BinCrc8>("bin-crc8", PolicyName::Rescan, Policy::Rescan);
    }
}
