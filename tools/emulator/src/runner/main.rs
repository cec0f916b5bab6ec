//! Runs a firmware's ELF in the emulator, and prints the board's events as they happen.

mod input;

use std::io::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::Parser;
use input::Input;
use nrf52840_emulator::{Board, CYCLES_PER_SECOND, Image, LogTable, MICROSECOND, MILLISECOND};

/// The cycles of a slice. The board's events are read after each slice.
const SLICE: u64 = MILLISECOND;
/// The time to boot before bytes are sent, in cycles.
const BOOT: u64 = 5 * MILLISECOND;

/// Runs a firmware's ELF on an emulated nRF52840. Sends it bytes at the line's rate, and prints servo
/// pulses, the log, resets and watched words.
#[derive(Parser)]
#[command(after_help = EXAMPLES)]
struct Arguments {
    /// The firmware's ELF file
    #[arg(long, value_name = "ELF")]
    elf: PathBuf,

    /// Bytes to send to the board: from a file, from standard input (-) as they arrive, or from a new
    /// pseudo-terminal (pty), whose name is printed
    #[arg(long, value_name = "FILE|-|pty")]
    input: Option<String>,

    /// Baud rate of the sender, 8N1. The firmware sets the receiver's rate
    #[arg(long, default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(300..=2_000_000))]
    baud: u32,

    /// Emulated seconds to run [default: until one second after the input's end]
    #[arg(long, value_parser = time)]
    seconds: Option<Duration>,

    /// Show each change of a word in RAM, given by its symbol. With NAMEs, show the word's bytes under these names, the
    /// lowest address first
    #[arg(long, value_name = "SYMBOL[=NAME,..]", value_parser = watch)]
    watch: Vec<Watch>,
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
type Watch = (String, Vec<String>);

fn watch(text: &str) -> Result<Watch> {
    let (symbol, names) = text.split_once('=').unwrap_or((text, ""));
    let names = names.split(',').filter(|name| !name.is_empty());
    let names: Vec<String> = names.map(str::to_owned).collect();
    ensure!(names.len() <= 4, "a word has four bytes");
    Ok((symbol.to_owned(), names))
}

fn time(text: &str) -> Result<Duration> {
    let seconds: f64 = text.parse()?;
    let is_valid = seconds > 0.0 && seconds <= 86_400.0;
    ensure!(is_valid, "must be more than 0 and at most a day (86400)");
    Ok(Duration::from_secs_f64(seconds))
}

/// Sends the input at the line's rate. Emulates in real time if the input is live, and as fast as possible otherwise.
fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let elf = std::fs::read(&arguments.elf)
        .with_context(|| format!("cannot read {}", arguments.elf.display()))?;
    let mut board = Board::new(Image::parse(&elf)?)?;
    board.line(|line| line.set_millibaud(u64::from(arguments.baud) * 1_000));
    let log = LogTable::parse(&elf)?;
    let mut events = Events::new(&log, &arguments.watch, &mut board);
    let seconds = arguments.seconds.map(cycles);

    events.run_until(&mut board, BOOT.min(seconds.unwrap_or(BOOT)))?;
    let mut input = Input::open(arguments.input.as_deref())?;
    let (real, emulated) = (Instant::now(), board.now());
    let (mut sent, mut free_at) = (0, BOOT);
    loop {
        while !input.has_ended && free_at < board.now() + SLICE {
            let bytes = input.next()?;
            if bytes.is_empty() {
                break;
            }
            sent += bytes.len();
            free_at = board.send(&bytes);
        }
        let end = seconds.or(input.has_ended.then_some(free_at + CYCLES_PER_SECOND));
        let end = end.unwrap_or(u64::MAX);
        if board.now() >= end {
            break;
        }
        let slice_ends = board.now() + SLICE;
        events.run_until(&mut board, slice_ends.min(end))?;
        if input.is_live {
            let passed = Duration::from_micros((board.now() - emulated) / MICROSECOND);
            std::thread::sleep(passed.saturating_sub(real.elapsed()));
        }
    }
    eprintln!(
        "{} ms emulated: {sent} bytes sent; {} instructions, core asleep {} % of the time",
        board.now() / MILLISECOND,
        board.instructions(),
        100 * board.slept() / board.now(),
    );
    Ok(())
}

fn cycles(time: Duration) -> u64 {
    // At most a day, so the number fits.
    let nanoseconds = u64::try_from(time.as_nanos()).expect("at most a day");
    (nanoseconds * MICROSECOND / 1_000).max(1)
}

/// Collects the board's events, and prints them.
struct Events<'a> {
    log: nrf52840_emulator::LogDecoder<'a>,
    /// The watched words, in the order of their watch numbers.
    watches: Vec<&'a Watch>,
    /// The current pulses in microseconds, and the instant at which they end if no more follow.
    pulses: Vec<u64>,
    pulses_end: u64,
}

impl<'a> Events<'a> {
    fn new(log: &'a LogTable, watches: &'a [Watch], board: &mut Board) -> Self {
        let mut found = Vec::new();
        for watch in watches {
            match board.watch(&watch.0) {
                Ok(_) => found.push(watch),
                Err(error) => eprintln!("{} is not shown: {error}", watch.0),
            }
        }
        Self {
            log: log.decoder(),
            watches: found,
            pulses: Vec::new(),
            pulses_end: 0,
        }
    }

    /// Emulates up to the instant `until`, and prints the events in their order.
    fn run_until(&mut self, board: &mut Board, until: u64) -> Result<()> {
        let outcome = board.run_until(until);
        let trace = std::mem::take(board.trace());
        let mut events: Vec<(u64, &str, String)> = Vec::new();
        for change in trace.changes {
            let watch = self.watches.get(change.watch);
            let (symbol, names) = watch.expect("the number of a watch");
            events.push((change.at, symbol, word(names, change.value)));
        }
        for period in trace.pwm_periods {
            self.pulses_end = period.at + period.length;
            let pulses: Vec<u64> = period.pulses().into_iter().flatten().collect();
            if self.pulses != pulses {
                let widths = pulses.iter().map(|width| format!("{width:4} us"));
                events.push((period.at, "pulses", widths.collect::<Vec<_>>().join("  ")));
                self.pulses = pulses;
            }
        }
        if !self.pulses.is_empty() && board.now() > self.pulses_end {
            self.pulses.clear();
            events.push((self.pulses_end, "pulses", "none".to_owned()));
        }
        let resets = trace.resets.iter();
        events.extend(resets.map(|reset| (reset.at, "reset", format!("{:?}", reset.cause))));
        // A log line has no time of its own. The line is shown with the time at which it was fetched, at most a slice
        // after the firmware wrote the line.
        let lines = self.log.lines(&board.take_rtt(0)).into_iter();
        events.extend(lines.map(|line| (board.now(), "log", line)));
        events.sort_by_key(|(at, ..)| *at);
        let mut out = std::io::stdout().lock();
        for (at, name, text) in events {
            let (whole, part) = (at / MILLISECOND, at % MILLISECOND * 1_000 / MILLISECOND);
            writeln!(out, "{whole:>8}.{part:03} ms  {name:<9} {text}")?;
        }
        out.flush()?;
        Ok(outcome?)
    }
}

/// Returns the word's bytes with their names, or the entire word if its bytes have no names.
fn word(names: &[String], value: u32) -> String {
    if names.is_empty() {
        return format!("value {value:3}");
    }
    let bytes = names.iter().zip(value.to_le_bytes());
    let texts = bytes.map(|(name, byte)| format!("{name} {byte:3}"));
    texts.collect::<Vec<_>>().join("  ")
}
