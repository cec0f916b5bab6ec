//! Decodes frames from a file, standard input or a serial port.

mod hint;
mod summary;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use clap::ValueEnum;
use framelock::{Found, LineEvent};
use framelock_receiving::{AnyLine, Policy, Protocol};

use crate::frame_writer::{FrameWriter, Place};
use crate::input::{CHUNK_LENGTH, Input, Spelling, for_each_arrival};
use crate::options::{ProtocolParser, check_has_no_breaks, whole};
use crate::output::{Output, exit_code, note, on_interrupt};
use crate::serial::PortOptions;
use hint::Stream;
use summary::Summary;

/// On a live stream, `decode` looks for a hint when this time has passed and this number of bytes has arrived, and again
/// whenever the number of bytes has doubled.
const LONG_ENOUGH: Duration = Duration::from_secs(3);
const ENOUGH: u64 = 200;

/// The number of bytes of the stream's beginning from which a hint is made.
const BEGINNING: usize = 4096;

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
    /// Write the time of each frame, in seconds since the start of the program
    #[arg(long)]
    timestamps: bool,
    /// Write frames to FILE, replacing it, instead of standard output
    #[arg(long, short, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    /// Also record the bytes in FILE, which must not exist
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// At the end, or at Ctrl-C, write a JSON object that accounts for every byte: to standard error,
    /// or to FILE (- is standard output)
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    summary: Option<String>,
    #[command(flatten)]
    port: PortOptions,
    /// After a pause of this length, give up the incomplete frame, and write the whole frames among its
    /// bytes. Off by default, because USB adapters send in bursts, so a frame may contain pauses
    #[arg(long, value_name = "MILLISECONDS", value_parser = |text: &str| whole(text, 1, 1_000_000).map(Duration::from_millis))]
    idle_gap: Option<Duration>,
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

/// The input of a decoder's step: bytes, a pause, or the end of the input.
#[derive(Clone, Copy)]
enum Step<'b> {
    Bytes(&'b [u8]),
    Silence,
    End,
}

/// Receives frames and writes them.
struct Decoder {
    options: Arguments,
    line: AnyLine,
    summary: Summary,
    frame: FrameWriter,
    output: Output,
    /// Rows that have not been written yet.
    rows: Vec<u8>,
    /// The number of bytes that have become part of a frame or were discarded.
    decided: usize,
    /// The number of frames of the kinds that are written.
    wanted: u64,
    /// The first bytes of the stream, from which a hint is made.
    beginning: Vec<u8>,
    is_hinted: bool,
    /// The number of bytes at which a live stream is next checked for a hint.
    next_look: u64,
    /// Whether the input is live. On a live input, a hint cannot wait for the end of the input.
    is_live: bool,
    start: Instant,
    /// The time of the last arrival. `None` if the pause after this arrival has already been reported to the receiver.
    heard: Option<Instant>,
    /// The file in which the bytes are recorded.
    recording: Option<Output>,
    /// The output for the summary; `None` if no summary is wanted, or the summary has been written.
    summary_output: Option<Output>,
}

impl Decoder {
    /// Creates the decoder, and the files that it writes.
    fn new(options: Arguments, is_live: bool) -> Result<Self> {
        let protocol = &options.frame;
        let mut frame = FrameWriter::new(protocol.clone());
        if !options.only.is_empty() {
            frame.only(&options.only)?;
        }
        Ok(Self {
            line: AnyLine::new(protocol, options.policy)?,
            summary: Summary::new(protocol),
            frame,
            output: options.output()?,
            rows: Vec::new(),
            decided: 0,
            wanted: 0,
            beginning: Vec::new(),
            // A user who only records may not know yet which frames the line has.
            is_hinted: options.record.is_some() && options.format == OutputFormat::None,
            next_look: ENOUGH,
            is_live,
            start: Instant::now(),
            heard: None,
            recording: options
                .record
                .as_deref()
                .map(Output::create_new)
                .transpose()?,
            summary_output: options.summary_output()?,
            options,
        })
    }

    fn arrive(&mut self, bytes: &[u8]) -> Result<()> {
        self.idle()?;
        self.heard = self.options.idle_gap.map(|_| Instant::now());
        if let Some(recording) = &mut self.recording {
            recording.write_all(bytes)?;
        }
        self.take(Step::Bytes(bytes))?;
        let missing = BEGINNING - self.beginning.len();
        self.beginning.extend(&bytes[..bytes.len().min(missing)]);
        let is_enough = self.summary.bytes >= self.next_look;
        if self.is_live && is_enough && self.start.elapsed() > LONG_ENOUGH {
            self.next_look = 2 * self.summary.bytes;
            self.print_hint();
        }
        Ok(())
    }

    /// Reports a pause to the receiver if the pause has lasted for `idle_gap`. Returns the time until the next check.
    fn idle(&mut self) -> Result<Duration> {
        let gap = self.options.idle_gap.unwrap_or(Duration::MAX);
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
        let format = self.options.format;
        let is_partial = !self.options.only.is_empty();
        let time = self.options.timestamps.then(|| self.start.elapsed());
        let mut outcome = Ok(());
        let on_outcome = |found: Found<&[u8]>| {
            self.decided += found.bytes();
            let bytes = match found {
                Found::Frame { message, .. } => message,
                Found::Discarded { .. } => return,
            };
            if is_partial && !self.frame.is_wanted(bytes) {
                return;
            }
            self.wanted += 1;
            let offset = self.decided - 1;
            let place = Place { offset, time };
            format.append(&mut self.rows, &place, &self.frame, bytes);
            if self.rows.len() >= CHUNK_LENGTH && outcome.is_ok() {
                outcome = self.output.write_all(&self.rows);
                self.rows.clear();
            }
        };
        match step {
            // Skip the outcomes, because this format writes no frames.
            Step::Bytes(bytes) if format == OutputFormat::None && !is_partial => {
                self.line.feed(bytes, |_| ());
            }
            Step::Bytes(bytes) => self.line.feed(bytes, on_outcome),
            Step::Silence | Step::End => self.line.line_event(LineEvent::Idle, on_outcome),
        }
        self.summary.update(&self.line, matches!(step, Step::End));
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
        if self.options.format == OutputFormat::Csv {
            let has_time = self.options.timestamps;
            self.frame.append_csv_header(&mut self.rows, has_time);
        }
        self.write()
    }

    /// Prints a hint if the stream needs one. Prints at most one hint for a stream.
    fn print_hint(&mut self) {
        let stream = Stream {
            protocol: &self.options.frame,
            beginning: &self.beginning,
            summary: &self.summary,
            has_pauses: self.options.idle_gap.is_some(),
        };
        if self.is_hinted {
            return;
        }
        if let Some(hint) = stream.hint() {
            self.is_hinted = true;
            note(&hint);
        }
    }

    /// Writes the hint and the summary, and skips each of the two if it is not needed or was written before.
    fn summarise(&mut self) -> Result<()> {
        self.output.flush()?;
        self.print_hint();
        if self.wanted == 0 && !self.options.only.is_empty() && !self.is_hinted {
            let (frames, protocol) = (self.summary.frames, &self.options.frame);
            if frames > 0 {
                let only = self.options.only.join(" or ");
                note(&format!(
                    "frames of {protocol}: {frames}, but none of them is {only}"
                ));
            }
        }
        if let Some(mut output) = self.summary_output.take() {
            writeln!(output, "{}", serde_json::to_string(&self.summary)?)?;
        }
        Ok(())
    }
}

/// Runs the subcommand.
pub(crate) fn run(arguments: Arguments) -> Result<()> {
    if arguments.describe {
        let text = arguments.frame.text.as_bytes();
        return Ok(arguments.output()?.write_all(text)?);
    }
    check_has_no_breaks(&arguments.frame)?;
    let input = Input::open(&arguments.source, &arguments.port)?.spelled(arguments.input);
    arguments.check_times(&input)?;
    let (has_summary, has_gap) = (arguments.summary.is_some(), arguments.idle_gap.is_some());
    let decoder = Arc::new(Mutex::new(Decoder::new(arguments, !input.is_file)?));
    if has_summary {
        let decoder = Arc::clone(&decoder);
        on_interrupt(move || std::process::exit(exit_code(lock(&decoder).summarise()).into()))?;
    }
    if has_gap {
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
    lock(&decoder).begin()?;
    for_each_arrival(input, |bytes| lock(&decoder).arrive(bytes))?;
    let mut decoder = lock(&decoder);
    decoder.take(Step::End)?;
    decoder.summarise()
}

impl Arguments {
    /// Checks that no option that needs the times of the bytes is given for a file.
    fn check_times(&self, input: &Input) -> Result<()> {
        let option = match self {
            _ if !input.is_file => return Ok(()),
            Self { timestamps, .. } if *timestamps => "--timestamps",
            Self { idle_gap, .. } if idle_gap.is_some() => "--idle-gap",
            _ => return Ok(()),
        };
        bail!(
            "{option}: {} is a file, which does not record when its bytes arrived: name a serial \
             port, or pipe a live stream in",
            input.name
        )
    }

    fn output(&self) -> Result<Output> {
        Output::check_is_not(&self.output, &self.source)?;
        Output::create(&self.output)
    }

    /// Opens the output for the summary, if a summary is wanted.
    fn summary_output(&self) -> Result<Option<Output>> {
        let path = self.summary.as_deref();
        path.map(|path| match path {
            "" => Ok(Output::new("standard error", io::stderr())),
            path => Output::create(Path::new(path)),
        })
        .transpose()
    }
}

/// Locks the decoder, even after a panic of another thread, since the decoder's state is always valid.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
