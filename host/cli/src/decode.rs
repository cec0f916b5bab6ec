//! Decodes frames from a file, standard input or a serial port.

mod hint;
mod recording;
mod summary;

use std::ffi::OsStr;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use clap::ValueEnum;
use framelock::{Found, LineEvent};
use framelock_receiving::{AnyLine, Policy, Protocol};

use crate::frame_writer::{FrameWriter, Place};
use crate::input::{Arrival, Arrivals, CHUNK_LENGTH, Input, InputNotation};
use crate::options::{check_has_no_breaks, protocol, whole};
use crate::output::{Output, exit_code, lock, note, on_interrupt};
use crate::serial::PortOptions;
use hint::Stream;
use recording::Recording;
use summary::Summary;

/// On a live stream, `decode` looks for a hint when this time has passed and [`ENOUGH`] bytes have arrived. It looks
/// again whenever the number of bytes has doubled.
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
    /// Receive with framelock (searches broken frames again) or lecture (the lecture's machine, which
    /// discards them; bin only)
    #[arg(long, value_enum, default_value_t = Policy::Framelock, hide_possible_values = true)]
    policy: Policy,
    /// Receive these frames: a name, or a description file [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = protocol, hide_possible_values = true)]
    frame: Protocol,
    /// Write the description of the frames, and decode nothing
    #[arg(long)]
    describe: bool,
    /// Read bytes, hex, csv or tlog: see below
    #[arg(long, value_name = "NOTATION", value_enum, hide_possible_values = true)]
    input: Option<InputNotation>,
    /// Write frames as jsonl (a JSON object per line), csv, text (columns) or none [default: as --output
    /// ends (.csv, .txt), or jsonl]
    #[arg(long, value_enum, hide_possible_values = true)]
    format: Option<OutputFormat>,
    /// Write only frames of these kinds (see the column kind, separate several names by commas), and
    /// only their columns
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    only: Vec<String>,
    /// Write the time of each frame, in seconds since the program's start
    #[arg(long)]
    timestamps: bool,
    /// Write units into the header of csv, such as altitude (m)
    #[arg(long)]
    units: bool,
    /// Write frames to FILE, replacing it, instead of standard output
    #[arg(
        long,
        short,
        value_name = "FILE",
        default_value = "-",
        hide_default_value = true
    )]
    output: PathBuf,
    /// Also record the bytes in a new FILE, with times if it ends in .hex
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// At the end, or at Ctrl-C, account for all bytes and count the frames of each kind: to standard
    /// error, or to FILE (- is standard output)
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    summary: Option<String>,
    #[command(flatten)]
    port: PortOptions,
    /// After a pause of this length, give up the incomplete frame, and write the whole frames among its
    /// bytes. Off by default, because USB adapters make pauses
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
    /// Returns the format of a file with this name.
    fn of(path: &Path) -> Self {
        match path.extension().and_then(OsStr::to_str) {
            Some("csv") => Self::Csv,
            Some("txt") => Self::Text,
            _ => Self::Jsonl,
        }
    }

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

/// The input of a decoder's step: bytes, a line event, or the end of the input.
#[derive(Clone, Copy)]
enum Step<'b> {
    Bytes(&'b [u8]),
    Event(LineEvent),
    End,
}

/// Receives frames and writes them.
struct Decoder {
    options: Arguments,
    format: OutputFormat,
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
    /// The time of the last byte, in microseconds.
    time: i64,
    /// True from the arrival of bytes until the next line event or pause is reported to the receiver.
    is_hearing: bool,
    /// The file in which the bytes are recorded.
    recording: Option<Recording>,
    /// The output for the summary; `None` if no summary is wanted, or the summary has been written.
    summary_output: Option<Output>,
}

impl Decoder {
    /// Creates the decoder, and the files that it writes.
    fn new(mut options: Arguments, input: &Arrivals) -> Result<Self> {
        options.timestamps |= input.has_times;
        let protocol = &options.frame;
        let format = options.format;
        let format = format.unwrap_or_else(|| OutputFormat::of(&options.output));
        Ok(Self {
            line: AnyLine::new(protocol, options.policy)?,
            summary: Summary::new(protocol),
            frame: FrameWriter::new(protocol.clone(), &options.only)?,
            output: options.output()?,
            rows: Vec::new(),
            decided: 0,
            wanted: 0,
            beginning: Vec::new(),
            // Print no hint to a user who only records, and who may not know yet which frames the line has.
            is_hinted: options.record.is_some() && format == OutputFormat::None,
            format,
            next_look: ENOUGH,
            is_live: !input.is_file,
            start: Instant::now(),
            time: 0,
            is_hearing: false,
            recording: options.record.as_deref().map(Recording::new).transpose()?,
            summary_output: options.summary_output()?,
            options,
        })
    }

    /// Takes an arrival. If the input has no times, the arrival has the current time.
    fn arrive(&mut self, arrival: &Arrival) -> Result<()> {
        let time = arrival.time.unwrap_or_else(|| self.elapsed());
        self.idle(time)?;
        if let Some(recording) = &mut self.recording {
            recording.write(time, arrival)?;
        }
        let Arrival { bytes, event, .. } = arrival;
        if !bytes.is_empty() {
            (self.time, self.is_hearing) = (time, true);
        }
        self.take(Step::Bytes(bytes))?;
        if let Some(event) = *event {
            self.is_hearing = false;
            self.summary.count_event(event);
            self.take(Step::Event(event))?;
        }
        let missing = BEGINNING - self.beginning.len();
        self.beginning.extend(&bytes[..bytes.len().min(missing)]);
        let is_enough = self.summary.bytes >= self.next_look;
        if self.is_live && is_enough && self.start.elapsed() > LONG_ENOUGH {
            self.next_look = 2 * self.summary.bytes;
            self.print_hint();
        }
        Ok(())
    }

    /// Returns the time since the start of the program, in microseconds.
    fn elapsed(&self) -> i64 {
        i64::try_from(self.start.elapsed().as_micros()).unwrap_or(i64::MAX)
    }

    /// Reports a pause to the receiver if no byte arrived for `idle_gap` before this time. Returns the time until the
    /// next check. There is no pause if the time runs backwards.
    fn idle(&mut self, now: i64) -> Result<Duration> {
        let gap = self.options.idle_gap.unwrap_or(Duration::MAX);
        if !self.is_hearing {
            return Ok(gap);
        }
        let waited = u64::try_from(now.saturating_sub(self.time)).unwrap_or(0);
        let left = gap.saturating_sub(Duration::from_micros(waited));
        if left.is_zero() {
            self.is_hearing = false;
            self.take(Step::Event(LineEvent::Idle))?;
            return Ok(gap);
        }
        Ok(left)
    }

    /// Performs a step, and writes the frames that the step completes.
    fn take(&mut self, step: Step) -> Result<()> {
        let format = self.format;
        let is_partial = !self.options.only.is_empty();
        let time = self.options.timestamps.then_some(self.time);
        let has_kinds = self.options.frame.description.has_kinds();
        // If no frame is of a wanted kind, a message lists the kinds that occur.
        let counts_kinds =
            has_kinds && (self.summary_output.is_some() || is_partial && self.wanted == 0);
        let mut outcome = Ok(());
        let on_outcome = |found: Found<&[u8]>| {
            self.decided += found.bytes();
            let Some(bytes) = found.message() else {
                return;
            };
            if counts_kinds {
                self.summary.count_frame(self.frame.kind_name(bytes));
            }
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
            Step::Bytes(bytes) if format == OutputFormat::None && !is_partial && !counts_kinds => {
                self.line.feed(bytes, |_| ());
            }
            Step::Bytes(bytes) => self.line.feed(bytes, on_outcome),
            Step::Event(event) => self.line.line_event(event, on_outcome),
            Step::End => self.line.line_event(LineEvent::Idle, on_outcome),
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
        if self.format == OutputFormat::Csv {
            let (options, rows) = (&self.options, &mut self.rows);
            self.frame
                .append_csv_header(rows, options.timestamps, options.units);
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

    /// Writes the hint, a note if `--only` matches no frame, and the summary. Skips those that are not needed or were
    /// written before.
    fn summarise(&mut self) -> Result<()> {
        self.output.flush()?;
        self.print_hint();
        let (frames, protocol) = (self.summary.frames, &self.options.frame);
        if frames > 0 && self.wanted == 0 && !self.options.only.is_empty() && !self.is_hinted {
            let only = self.options.only.join(" or ");
            let kinds = self.summary.kind_names();
            note(&format!(
                "frames of {protocol}: {frames}, but none of them is {only}; their kinds: {kinds}"
            ));
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
    let input = Input::open(&arguments.source, &arguments.port)?;
    let arrivals = Arrivals::new(input, arguments.input)?;
    if arrivals.notation == InputNotation::Bytes {
        check_has_no_breaks(&arguments.frame)?;
    }
    arguments.check_times(&arrivals)?;
    let has_summary = arguments.summary.is_some();
    let has_gap = arguments.idle_gap.is_some() && !arrivals.has_times;
    let decoder = Arc::new(Mutex::new(Decoder::new(arguments, &arrivals)?));
    if has_summary {
        let decoder = Arc::clone(&decoder);
        on_interrupt(move || std::process::exit(exit_code(lock(&decoder).summarise()).into()))?;
    }
    if has_gap {
        let decoder = Arc::clone(&decoder);
        // This thread ends with the process.
        thread::spawn(move || {
            loop {
                let mut decoder = lock(&decoder);
                let now = decoder.elapsed();
                let waiting = decoder.idle(now);
                drop(decoder);
                match waiting {
                    Ok(time) => thread::sleep(time),
                    Err(error) => std::process::exit(exit_code(Err(error)).into()),
                }
            }
        });
    }
    lock(&decoder).begin()?;
    // The recording of a live input ends with the time at which the input ended.
    let end = (!arrivals.has_times).then(|| Ok(Arrival::default()));
    for arrival in arrivals.chain(end) {
        lock(&decoder).arrive(&arrival?)?;
    }
    let mut decoder = lock(&decoder);
    decoder.take(Step::End)?;
    decoder.summarise()
}

impl Arguments {
    /// Returns an error if an option needs the times of the bytes, but the input is a file without times.
    fn check_times(&self, input: &Arrivals) -> Result<()> {
        let option = match self {
            _ if !input.is_file || input.has_times => return Ok(()),
            Self { timestamps, .. } if *timestamps => "--timestamps",
            Self { idle_gap, .. } if idle_gap.is_some() => "--idle-gap",
            Self { record, .. } if record.as_deref().is_some_and(Recording::has_times) => {
                "--record"
            }
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
        let open = |path| match path {
            "" => Ok(Output::new("standard error", io::stderr())),
            path => Output::create(Path::new(path)),
        };
        self.summary.as_deref().map(open).transpose()
    }
}
