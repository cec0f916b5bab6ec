//! Decodes frames from a file, standard input or a serial port.

mod hints;
mod totals;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Error, Result, bail};
use clap::ValueEnum;
use framelock::{Found, LineEvent};
use framelock_receiving::{AnyLine, Policy, Protocol};
use serde::Serialize;

use crate::frame_writer::{FrameWriter, Place};
use crate::input::{Arrival, CHUNK_LENGTH, Input, Spelling, for_each_arrival};
use crate::options::{ProtocolParser, whole};
use crate::output::{Output, exit_code, note};
use crate::process::{Timestamps, on_interrupt, time_of_day};
use crate::serial::PortOptions;
use totals::{DiscardedTotals, Totals};

/// On a live stream, `decode` looks for a hint when this time has passed and this number of bytes has arrived.
const LONG_ENOUGH: Duration = Duration::from_secs(3);
const ENOUGH: u64 = 200;

/// Decode frames from a file, standard input or a serial port
#[derive(clap::Args)]
#[command(after_help = include_str!("help/decode.txt"))]
pub(crate) struct Arguments {
    /// Read a file, a serial port such as /dev/ttyUSB0 or COM3, or - for standard input
    #[arg(value_name = "FILE|PORT", default_value = "-")]
    source: PathBuf,
    /// Receive with framelock (searches a broken frame again) or lecture (the lecture's machine, which
    /// discards it; bin only)
    #[arg(long, value_enum, default_value_t = Policy::Framelock, hide_possible_values = true)]
    policy: Policy,
    /// Receive these frames: a name, or a description file [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = ProtocolParser, hide_possible_values = true)]
    frame: Protocol,
    /// Write the description of the frames, and decode nothing
    #[arg(long)]
    describe: bool,
    /// Read bytes, or hex such as 41 42 00 or 0x41,0x42
    #[arg(long, value_name = "SPELLING", value_enum, default_value_t = Spelling::Bytes, hide_possible_values = true)]
    input: Spelling,
    /// Write frames as jsonl (a JSON object per line), csv, text (columns) or none
    #[arg(long, value_enum, default_value_t = OutputFormat::Jsonl, hide_possible_values = true)]
    format: OutputFormat,
    /// Write only frames of these kinds, and only their columns. The column kind shows the names.
    /// Separate several names by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    only: Vec<String>,
    /// Write the time of each frame, in seconds since the start of the program; with =unix, since 1970
    #[arg(long, value_enum, value_name = "start|unix", num_args = 0..=1, require_equals = true, default_missing_value = "start", hide_possible_values = true)]
    timestamps: Option<Timestamps>,
    /// Write frames to FILE, replacing it, instead of standard output
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Also record the bytes in FILE, which must not exist
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Print numbers in hex (with --format text)
    #[arg(long)]
    hex: bool,
    /// At the end, or at Ctrl-C, write a JSON object that accounts for every byte: to standard error,
    /// or to FILE (- is standard output)
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    summary: Option<String>,
    #[command(flatten)]
    port: PortOptions,
    /// If the port disappears, wait for it instead of ending with an error
    #[arg(long)]
    reconnect: bool,
    /// After a pause of this length, give up the incomplete frame, and write the whole frames among its
    /// bytes. Off by default, because USB adapters send in bursts, so a frame may contain pauses
    #[arg(long, value_name = "MILLISECONDS", value_parser = |text: &str| whole::<u64>(text, 1, 1_000_000))]
    idle_gap: Option<u64>,
}

/// The output format of the frames.
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
    /// Appends a frame to the rows.
    fn append(self, rows: &mut Vec<u8>, place: &Place, frame: &FrameWriter, bytes: &[u8]) {
        match self {
            Self::Jsonl => frame.append_json(rows, place, bytes),
            Self::Csv => return frame.append_csv(rows, place, bytes),
            Self::Text => frame.append_columns(rows, place, bytes),
            Self::None => return,
        }
        rows.push(b'\n');
    }
}

/// The outcomes of all bytes of a stream: bytes = bytes in frames + discarded + pending.
#[derive(PartialEq, Debug, Serialize)]
struct Summary {
    bytes: u64,
    /// The length of a frame, if all frames have the same length.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_length: Option<usize>,
    frames: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_bytes: Option<u64>,
    discarded: u64,
    pending: usize,
    discarded_by: DiscardedTotals,
    resynchronisations: u64,
}

/// The input of a decoder's step: bytes, a pause, or the end of the input.
#[derive(Clone, Copy)]
enum Step<'b> {
    Bytes(&'b [u8]),
    Silence,
    End,
}

/// Receives frames and writes them.
struct Decoder<W> {
    line: AnyLine,
    totals: Totals,
    frame: FrameWriter,
    format: OutputFormat,
    output: W,
    /// Rows that have not been written yet.
    rows: Vec<u8>,
    /// The number of bytes that have become part of a frame or were discarded.
    decided: usize,
    policy: Policy,
    /// Whether only some kinds of frames are written.
    is_partial: bool,
    /// The number of frames of the kinds that are written.
    wanted: u64,
    /// The first bytes of the stream, on which the hint's guesses are tested.
    beginning: Vec<u8>,
    is_hinted: bool,
    /// Whether the input is live. On a live input, a hint cannot wait for the end of the input.
    is_live: bool,
    start: Instant,
    timestamps: Option<Timestamps>,
    idle_gap: Option<Duration>,
    /// The time of the last arrival. `None` if the pause after this arrival has already been reported to the receiver.
    heard: Option<Instant>,
    /// The file in which the bytes are recorded.
    recording: Option<Output>,
    /// The output for the summary; `None` if no summary is wanted, or the summary has been written.
    summary: Option<Output>,
}

impl<W: Write> Decoder<W> {
    fn new(protocol: &Protocol, policy: Policy, format: OutputFormat, output: W) -> Result<Self> {
        Ok(Self {
            line: AnyLine::new(protocol, policy).map_err(Error::msg)?,
            totals: Totals::default(),
            frame: FrameWriter::new(protocol.clone()),
            format,
            output,
            rows: Vec::new(),
            decided: 0,
            policy,
            is_partial: false,
            wanted: 0,
            beginning: Vec::new(),
            is_hinted: false,
            is_live: false,
            start: Instant::now(),
            timestamps: None,
            idle_gap: None,
            heard: None,
            recording: None,
            summary: None,
        })
    }

    fn arrive(&mut self, arrival: &Arrival) -> Result<()> {
        self.idle()?;
        match arrival {
            Arrival::Bytes(bytes) => {
                self.heard = self.idle_gap.map(|_| Instant::now());
                if let Some(recording) = &mut self.recording {
                    recording.write_all(bytes)?;
                }
                self.take(Step::Bytes(bytes))?;
                let tried = bytes.len().min(hints::TRIED - self.beginning.len());
                self.beginning.extend(&bytes[..tried]);
                if self.is_live && self.start.elapsed() > LONG_ENOUGH && self.totals.bytes >= ENOUGH
                {
                    self.print_hint();
                }
            }
            Arrival::Gone(error) => {
                note(&format!("{}: {error}; waiting for it", time_of_day()));
                self.take(Step::Silence)?;
            }
            Arrival::Back(_) => note(&format!("{}: the port is back", time_of_day())),
        }
        Ok(())
    }

    /// Reports a pause to the receiver if the pause has lasted for `idle_gap`. Returns the time until the next check.
    fn idle(&mut self) -> Result<Duration> {
        let gap = self.idle_gap.unwrap_or(Duration::MAX);
        match self.heard.map(|heard| gap.saturating_sub(heard.elapsed())) {
            Some(Duration::ZERO) => {
                self.heard = None;
                self.take(Step::Silence)?;
                Ok(gap)
            }
            Some(left) => Ok(left),
            None => Ok(gap),
        }
    }

    /// Performs a step, and writes the frames that the step completes.
    fn take(&mut self, step: Step) -> Result<()> {
        let time = self.timestamps.map(|since| since.now(self.start));
        let mut outcome = Ok(());
        let on_outcome = |found: Found<&[u8]>| {
            self.decided += found.bytes();
            let bytes = match found {
                Found::Frame { message, .. } => message,
                Found::Discarded { .. } => return,
            };
            if self.is_partial && !self.frame.is_wanted(bytes) {
                return;
            }
            self.wanted += 1;
            let offset = self.decided - 1;
            let place = Place { offset, time };
            self.format
                .append(&mut self.rows, &place, &self.frame, bytes);
            if self.rows.len() >= CHUNK_LENGTH && outcome.is_ok() {
                outcome = self.output.write_all(&self.rows);
                self.rows.clear();
            }
        };
        match step {
            // Skip the outcomes, because this format writes no frames.
            Step::Bytes(bytes) if self.format == OutputFormat::None && !self.is_partial => {
                self.line.feed(bytes, |_| ());
            }
            Step::Bytes(bytes) => self.line.feed(bytes, on_outcome),
            Step::Silence | Step::End => self.line.line_event(LineEvent::Idle, on_outcome),
        }
        match step {
            Step::End => self.totals.add_end(self.line.counters()),
            _ => self.totals.add(self.line.counters()),
        }
        outcome?;
        self.write()
    }

    /// Writes the rows that are not written yet.
    fn write(&mut self) -> Result<()> {
        self.output.write_all(&self.rows)?;
        self.rows.clear();
        Ok(self.output.flush()?)
    }

    /// Writes the header above the first frame, if the output format has a header.
    fn begin(&mut self) -> Result<()> {
        if self.format == OutputFormat::Csv {
            let has_time = self.timestamps.is_some();
            self.frame.append_csv_header(&mut self.rows, has_time);
        }
        self.write()
    }

    /// Returns a hint if no frame has arrived or most bytes were discarded.
    fn hint(&self) -> Option<String> {
        let (bytes, protocol) = (self.totals.bytes, &self.frame.protocol);
        let discarded = self.totals.discarded.total();
        if bytes == 0 || self.totals.frames > 0 && discarded <= bytes / 2 {
            return None;
        }
        let cause = hints::likely_cause(protocol, self.policy, &self.beginning);
        let cause = cause.unwrap_or_else(|| {
            "check --frame, the baud rate and parity, and whether the line is inverted".to_owned()
        });
        Some(format!(
            "{discarded} of {bytes} bytes are in no frame of {protocol}; {cause}"
        ))
    }

    /// Prints the hint, if there is one. Prints at most one hint for a stream.
    fn print_hint(&mut self) {
        if self.is_hinted {
            return;
        }
        if let Some(hint) = self.hint() {
            self.is_hinted = true;
            note(&hint);
        }
    }

    fn summary(&self) -> Summary {
        let totals = &self.totals;
        let length = self
            .frame
            .protocol
            .has_setpoints()
            .then(|| self.frame.protocol.longest());
        Summary {
            bytes: totals.bytes,
            frame_length: length,
            frames: totals.frames,
            frame_bytes: length.is_none().then_some(totals.frame_bytes),
            discarded: totals.discarded.total(),
            pending: self.line.pending(),
            discarded_by: totals.discarded,
            resynchronisations: totals.resynchronisations,
        }
    }

    /// Writes the hint and the summary, and skips each of the two if it is not needed or was written before.
    fn summarise(&mut self) -> Result<()> {
        self.output.flush()?;
        self.print_hint();
        if self.is_partial && self.wanted == 0 && self.totals.frames > 0 && !self.is_hinted {
            let (frames, only) = (self.totals.frames, self.frame.only.join(" or "));
            let protocol = &self.frame.protocol;
            note(&format!(
                "frames of {protocol}: {frames}, but none of them is {only}"
            ));
        }
        if let Some(mut output) = self.summary.take() {
            writeln!(output, "{}", serde_json::to_string(&self.summary())?)?;
        }
        Ok(())
    }
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    if arguments.describe {
        return Ok(arguments
            .output()?
            .write_all(arguments.frame.text.as_bytes())?);
    }
    let input = Input::open(&arguments.source, &arguments.port)?;
    let of_time = [
        ("--timestamps", arguments.timestamps.is_some()),
        ("--idle-gap", arguments.idle_gap.is_some()),
    ];
    if let Some((option, _)) = of_time
        .iter()
        .find(|(_, is_given)| *is_given && input.is_file())
    {
        bail!(
            "{option}: {} is a file, which does not record when its bytes arrived: name a serial \
             port, or pipe a live stream in",
            input.name
        );
    }
    let mut input = input.spelled(arguments.input);
    input.reconnects = arguments.reconnect;
    let mut output = arguments.output()?;
    if arguments.format == OutputFormat::Text {
        output = output.of_rows();
    }
    if output.is_file || arguments.format == OutputFormat::None {
        input.show_progress();
    }
    let progress = input.progress.clone();
    let mut decoder = Decoder::new(&arguments.frame, arguments.policy, arguments.format, output)?;
    decoder.frame.is_hex = arguments.hex;
    decoder.is_partial = !arguments.only.is_empty();
    if decoder.is_partial {
        decoder.frame.only(&arguments.only)?;
    }
    decoder.timestamps = arguments.timestamps;
    decoder.is_live = !input.is_file();
    decoder.idle_gap = arguments.idle_gap.map(Duration::from_millis);
    decoder.recording = arguments
        .record
        .as_deref()
        .map(Output::create_new)
        .transpose()?;
    // A user who only records may not know yet which frames the line has.
    decoder.is_hinted = arguments.record.is_some() && arguments.format == OutputFormat::None;
    decoder.summary = arguments.summary()?;
    let decoder = Arc::new(Mutex::new(decoder));
    if arguments.summary.is_some() {
        let decoder = Arc::clone(&decoder);
        on_interrupt(move || {
            progress.finish_and_clear();
            std::process::exit(exit_code(lock(&decoder).summarise()).into());
        })?;
    }
    if arguments.idle_gap.is_some() {
        let decoder = Arc::clone(&decoder);
        // This thread ends with the process.
        thread::spawn(move || {
            loop {
                let waiting = lock(&decoder).idle();
                match waiting {
                    Ok(time) => thread::sleep(time),
                    Err(error) => std::process::exit(exit_code(Err(error)).into()),
                }
            }
        });
    }
    decode(&decoder, input)?;
    lock(&decoder).summarise()
}

impl Arguments {
    fn output(&self) -> Result<Output> {
        let Some(path) = &self.output else {
            return Output::standard();
        };
        Output::check_is_not(path, &self.source)?;
        Output::create(path)
    }

    /// Opens the output for the summary, if a summary is wanted.
    fn summary(&self) -> Result<Option<Output>> {
        let path = self.summary.as_deref();
        path.map(|path| match path {
            "" => Ok(Output::new("standard error", io::stderr())),
            path => Output::create(Path::new(path)),
        })
        .transpose()
    }
}

/// Decodes `input` to its end. Writes each frame before waiting for the next byte. At the end, reports an idle gap to
/// the receiver.
fn decode<W: Write>(decoder: &Mutex<Decoder<W>>, input: Input) -> Result<()> {
    lock(decoder).begin()?;
    for_each_arrival(input, |arrival| lock(decoder).arrive(&arrival))?;
    lock(decoder).take(Step::End)
}

/// Locks the decoder, even after a panic of another thread, since the decoder's state is always valid.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
