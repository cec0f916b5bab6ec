//! A run: bytes in, events out, slice by slice of emulated time.

use std::io::{ErrorKind, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
#[cfg(unix)]
use std::time::{Duration, Instant};

use anyhow::Context;
use framelock_emulator::{
    Board, CYCLES_PER_SECOND, Faults, Image, LogDecoder, LogTable, MILLISECOND,
};

use crate::arguments::{Arguments, Format};
use crate::input::{self, Input};
use crate::report::{self, Event};

/// The word that the firmware publishes: sequence number, pitch, roll, yaw, from the highest byte.
const SETPOINT: &str = "SETPOINT";
/// Bytes given to the line at once, so that a long input need not lie on it as a whole.
const CHUNK: usize = 4096;
/// How much time is emulated between two looks.
const SLICE: u64 = MILLISECOND;
/// How far emulated time may be behind real time.
#[cfg(unix)]
const LATE: u64 = 20 * MILLISECOND;

/// Emulates until the end, or Ctrl-C.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let elf = std::fs::read(&arguments.elf)
        .with_context(|| format!("cannot read {}", arguments.elf.display()))?;
    let image = Image::parse(&elf)?;
    let table = LogTable::parse(&elf)?;
    let mut session = Session::new(arguments, Board::new(image)?, table.decoder());
    let ended = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&ended);
    ctrlc::set_handler(move || flag.store(true, Relaxed)).context("cannot listen for Ctrl-C")?;
    let outcome = match input::open(arguments.input.as_deref())? {
        Input::Bytes(bytes) => session.play(&bytes, &ended),
        #[cfg(unix)]
        Input::Terminal(terminal) => session.listen(terminal, &ended),
    };
    // Whoever reads the output may stop reading: `| head`.
    let closed = |error: &anyhow::Error| {
        let cause = error.downcast_ref::<std::io::Error>();
        cause.is_some_and(|cause| cause.kind() == ErrorKind::BrokenPipe)
    };
    match outcome {
        Err(error) if closed(&error) => Ok(()),
        outcome => {
            session.summary();
            outcome
        }
    }
}

struct Session<'a> {
    board: Board,
    faults: Faults,
    log: LogDecoder<'a>,
    format: Format,
    /// When to end, in cycles, if that was said.
    end: Option<u64>,
    setpoint: Option<usize>,
    /// How many there were.
    setpoints: u64,
    /// How many were printed already.
    resets: usize,
    /// What the servos get, and until when if nothing follows.
    pulses: Option<[Option<u64>; 4]>,
    pulses_end: u64,
    lit: [bool; 4],
    bytes: u64,
}

impl<'a> Session<'a> {
    fn new(arguments: &Arguments, mut board: Board, log: LogDecoder<'a>) -> Self {
        let factor = 1.0 + arguments.faults.baud_error / 100.0;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "at most 3e9, and positive"
        )]
        let millibaud = (arguments.baud as f64 * factor * 1000.0).round() as u64;
        board.line(|line| line.set_millibaud(millibaud));
        let setpoint = board.watch(SETPOINT);
        if let Err(error) = &setpoint {
            eprintln!("setpoints are not shown: {error}");
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "at most a day, and positive"
        )]
        let end = arguments
            .seconds
            .map(|s| (s * CYCLES_PER_SECOND as f64) as u64);
        Self {
            board,
            faults: Faults::new(arguments.faults.bytes, arguments.seed),
            log,
            format: arguments.format,
            end,
            setpoint: setpoint.ok(),
            setpoints: 0,
            resets: 0,
            pulses: None,
            pulses_end: 0,
            lit: [false; 4],
            bytes: 0,
        }
    }

    /// Sends all bytes at the line rate, as fast as the emulation goes.
    fn play(&mut self, bytes: &[u8], ended: &AtomicBool) -> anyhow::Result<()> {
        // The firmware boots before anyone sends.
        self.slice(5 * MILLISECOND)?;
        let mut chunks = bytes.chunks(CHUNK);
        let mut sent = self.board.now();
        let mut more = true;
        loop {
            if more && sent < self.board.now() + SLICE {
                match chunks.next() {
                    Some(chunk) => sent = self.send(chunk),
                    None => more = false,
                }
            }
            let end = self.end.or((!more).then_some(sent + CYCLES_PER_SECOND));
            if ended.load(Relaxed) || end.is_some_and(|end| self.board.now() >= end) {
                return Ok(());
            }
            self.slice(self.board.now() + SLICE)?;
        }
    }

    /// Sends what comes at the pseudo-terminal, in real time.
    #[cfg(unix)]
    fn listen(
        &mut self,
        mut terminal: input::terminal::Terminal,
        ended: &AtomicBool,
    ) -> anyhow::Result<()> {
        eprintln!("the board's serial port is {}; Ctrl-C ends", terminal.name);
        let (mut started, mut began) = (Instant::now(), self.board.now());
        loop {
            let bytes = terminal.take()?;
            self.send(&bytes);
            let passed = started.elapsed().as_nanos() * u128::from(CYCLES_PER_SECOND);
            let due = began + u64::try_from(passed / 1_000_000_000).unwrap_or(u64::MAX);
            let target = due.min(self.board.now() + LATE);
            if target < due {
                // A machine that is too slow falls behind, and does not make up for it later.
                (started, began) = (Instant::now(), target);
            }
            while self.board.now() < target {
                self.slice((self.board.now() + SLICE).min(target))?;
            }
            let over = self.end.is_some_and(|end| self.board.now() >= end);
            if over || ended.load(Relaxed) {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn send(&mut self, bytes: &[u8]) -> u64 {
        self.bytes += bytes.len() as u64;
        let symbols = self.faults.symbols(bytes);
        self.board.send_symbols(&symbols)
    }

    /// Emulates up to that instant, and prints what happened in the order in which it happened.
    fn slice(&mut self, until: u64) -> anyhow::Result<()> {
        let outcome = self.board.run_until(until);
        let mut events = Vec::new();
        if let Some(watch) = self.setpoint {
            for change in self.board.take_changes(watch) {
                let [pitch, roll, yaw, _sequence] = change.value.to_le_bytes();
                events.push((change.at, Event::Setpoint([pitch, roll, yaw])));
                self.setpoints += 1;
            }
        }
        for period in self.board.take_pwm_periods() {
            self.pulses_end = period.at + period.length;
            let pulses = Some(period.pulses());
            if std::mem::replace(&mut self.pulses, pulses) != pulses {
                events.push((period.at, Event::Pulses(pulses)));
            }
        }
        if self.pulses.is_some() && self.board.now() > self.pulses_end {
            self.pulses = None;
            events.push((self.pulses_end, Event::Pulses(None)));
        }
        for (at, pins) in self.board.take_pin_changes() {
            let lit = report::leds(pins);
            if std::mem::replace(&mut self.lit, lit) != lit {
                events.push((at, Event::Leds(lit)));
            }
        }
        let resets = self.board.resets();
        for reset in resets.get(self.resets..).unwrap_or_default() {
            events.push((reset.at, Event::Reset(reset.cause)));
        }
        self.resets = resets.len();
        // When a line was written is not in it; it is shown at the time it is fetched, a slice later at
        // most.
        let bytes = self.board.take_rtt(0);
        for line in self.log.lines(&bytes) {
            events.push((self.board.now(), Event::Log(line)));
        }
        events.sort_by_key(|(at, _)| *at);
        let mut out = std::io::stdout().lock();
        for (at, event) in &events {
            report::print(&mut out, self.format, *at, event)?;
        }
        out.flush()?;
        Ok(outcome?)
    }

    fn summary(&self) {
        let now = self.board.now();
        eprintln!(
            "{} ms emulated: {} bytes sent, {} faults, {} setpoints; {} instructions, core asleep \
             {} % of the time",
            now / MILLISECOND,
            self.bytes,
            self.faults.injected(),
            self.setpoints,
            self.board.instructions(),
            100 * self.board.slept() / now.max(1),
        );
    }
}
