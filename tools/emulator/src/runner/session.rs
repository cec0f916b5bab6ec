//! A run of the emulator. In each slice of emulated time, sends bytes and prints events.

use std::io::{ErrorKind, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use nrf52840_emulator::{
    Board, CYCLES_PER_SECOND, Image, LogDecoder, LogTable, MICROSECOND, MILLISECOND,
};

use crate::arguments::{Arguments, Watch};
use crate::input::Input;
use crate::report::{Event, line};

/// The cycles of a slice. The board's events are read after each slice.
const SLICE: u64 = MILLISECOND;
/// The time to boot before bytes are sent, in cycles.
const BOOT: u64 = 5 * MILLISECOND;
/// The largest lag behind real time that the emulation makes up. A larger lag is not made up.
const LATE: Duration = Duration::from_millis(20);

/// Emulates until the end or Ctrl-C.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let elf = std::fs::read(&arguments.elf)
        .with_context(|| format!("cannot read {}", arguments.elf.display()))?;
    let table = LogTable::parse(&elf)?;
    let board = Board::new(Image::parse(&elf)?)?;
    let mut session = Session::new(arguments, board, table.decoder());
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Relaxed)).context("cannot listen for Ctrl-C")?;
    let outcome = session.play(Input::open(arguments.input.as_deref())?, &interrupted);
    session.summary();
    // The reader may close the output before the end, as `| head` does.
    let kind = |error: &anyhow::Error| Some(error.downcast_ref::<std::io::Error>()?.kind());
    match outcome {
        Err(error) if kind(&error) == Some(ErrorKind::BrokenPipe) => Ok(()),
        outcome => outcome,
    }
}

struct Session<'a> {
    arguments: &'a Arguments,
    board: Board,
    log: LogDecoder<'a>,
    /// The watched words, in the order of their watch numbers.
    watches: Vec<&'a Watch>,
    /// The current pulses, and the instant at which they end if no more follow.
    pulses: Vec<u64>,
    pulses_end: u64,
    bytes: usize,
}

impl<'a> Session<'a> {
    fn new(arguments: &'a Arguments, mut board: Board, log: LogDecoder<'a>) -> Self {
        board.line(|line| line.set_millibaud(u64::from(arguments.baud) * 1_000));
        let mut watches = Vec::new();
        for watch in &arguments.watch {
            match board.watch(&watch.0) {
                Ok(_) => watches.push(watch),
                Err(error) => eprintln!("{} is not shown: {error}", watch.0),
            }
        }
        Self {
            arguments,
            board,
            log,
            watches,
            pulses: Vec::new(),
            pulses_end: 0,
            bytes: 0,
        }
    }

    /// Sends the input at the line's rate. Emulates in real time if the input is live, and as fast
    /// as possible otherwise.
    fn play(&mut self, mut input: Input, interrupted: &AtomicBool) -> Result<()> {
        let seconds = self.arguments.seconds.map(Duration::from_secs_f64);
        let end = seconds.map(|time| cycles(time).max(1));
        self.slice(BOOT.min(end.unwrap_or(BOOT)))?;
        let (mut real, mut emulated) = (Instant::now(), self.board.now());
        let mut free_at = BOOT;
        loop {
            while !input.has_ended && free_at < self.board.now() + SLICE {
                let bytes = input.next()?;
                if bytes.is_empty() {
                    break;
                }
                self.bytes += bytes.len();
                free_at = self.board.send(&bytes);
            }
            let now = self.board.now();
            let end = end.or(input.has_ended.then_some(free_at + CYCLES_PER_SECOND));
            if interrupted.load(Relaxed) || end.is_some_and(|end| now >= end) {
                return Ok(());
            }
            self.slice((now + SLICE).min(end.unwrap_or(u64::MAX)))?;
            if input.is_live {
                let passed = Duration::from_micros((self.board.now() - emulated) / MICROSECOND);
                std::thread::sleep(passed.saturating_sub(real.elapsed()));
                if real.elapsed() > passed + LATE {
                    (real, emulated) = (Instant::now(), self.board.now());
                }
            }
        }
    }

    /// Emulates up to the instant `until`, and prints the events in their order.
    fn slice(&mut self, until: u64) -> Result<()> {
        let outcome = self.board.run_until(until);
        let trace = std::mem::take(self.board.trace());
        let mut events = Vec::new();
        for change in trace.changes {
            if let Some(watch) = self.watches.get(change.watch) {
                events.push((change.at, Event::Changed(watch, change.value)));
            }
        }
        for period in trace.pwm_periods {
            self.pulses_end = period.at + period.length;
            let pulses: Vec<u64> = period.pulses().into_iter().flatten().collect();
            if self.pulses != pulses {
                self.pulses.clone_from(&pulses);
                events.push((period.at, Event::Pulses(pulses)));
            }
        }
        if !self.pulses.is_empty() && self.board.now() > self.pulses_end {
            self.pulses.clear();
            events.push((self.pulses_end, Event::Pulses(Vec::new())));
        }
        let resets = trace.resets.iter();
        events.extend(resets.map(|reset| (reset.at, Event::Reset(reset.cause))));
        // A log line has no time of its own. The line is shown with the time at which it was fetched, at most a slice
        // after the firmware wrote the line.
        let (now, bytes) = (self.board.now(), self.board.take_rtt(0));
        let lines = self.log.lines(&bytes).into_iter();
        events.extend(lines.map(|line| (now, Event::Log(line))));
        events.sort_by_key(|(at, _)| *at);
        let mut out = std::io::stdout().lock();
        for (at, event) in &events {
            writeln!(out, "{}", line(*at, event))?;
        }
        out.flush()?;
        Ok(outcome?)
    }

    fn summary(&self) {
        let (now, board) = (self.board.now(), &self.board);
        eprintln!(
            "{} ms emulated: {} bytes sent; {} instructions, core asleep {} % of the time",
            now / MILLISECOND,
            self.bytes,
            board.instructions(),
            100 * board.slept() / now.max(1),
        );
    }
}

fn cycles(time: Duration) -> u64 {
    // At most a day.
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX) * MICROSECOND / 1_000
}
