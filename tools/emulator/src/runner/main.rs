//! Runs a firmware's ELF in the emulator in real time, and prints the board's events as they happen.

use std::io::{Read, Write as _};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::Parser;
use nrf52840_emulator::{Board, CYCLES_PER_SECOND, Image, MICROSECOND, MILLISECOND};

/// The cycles of a slice. The board's events are read after each slice.
const SLICE: u64 = MILLISECOND;
/// The time to boot before bytes are sent, in cycles.
const BOOT: u64 = 5 * MILLISECOND;

/// Runs a firmware's ELF on an emulated nRF52840 in real time. Sends it bytes at 115200 baud, and prints servo pulses,
/// the log, resets and watched words. Ends one second after the input's end.
#[derive(Parser)]
struct Arguments {
    /// The firmware's ELF file
    #[arg(long, value_name = "ELF")]
    elf: PathBuf,

    /// Bytes to send to the board: from standard input (-), or from a new pseudo-terminal (pty), whose name is printed
    #[arg(long, value_name = "-|pty", default_value = "-", value_parser = ["-", "pty"])]
    input: String,

    /// Show each change of the word at SYMBOL in RAM, as four bytes, the lowest address first
    #[arg(long, value_name = "SYMBOL")]
    watch: Vec<String>,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let elf = std::fs::read(&arguments.elf)
        .with_context(|| format!("cannot read {}", arguments.elf.display()))?;
    let mut board = Board::new(Image::parse(&elf)?)?;
    let mut events = Events::default();
    for symbol in arguments.watch {
        match board.watch(&symbol) {
            Ok(_) => events.watches.push(symbol),
            Err(error) => eprintln!("{symbol} is not shown: {error}"),
        }
    }
    events.run_until(&mut board, BOOT)?;
    let input = open(&arguments.input)?;
    let (real, emulated) = (Instant::now(), board.now());
    let (mut free_at, mut end) = (BOOT, u64::MAX);
    while board.now() < end {
        // Read the channel only if the line is free by the end of the next slice, so that a sender that is faster than
        // the line has to wait.
        if end == u64::MAX
            && free_at < board.now() + SLICE
            && let Ok(bytes) = input.try_recv()
        {
            let bytes = bytes.context("cannot read the input")?;
            free_at = board.send(&bytes);
            if bytes.is_empty() {
                end = free_at.max(board.now()) + CYCLES_PER_SECOND;
            }
        }
        let slice_ends = board.now() + SLICE;
        events.run_until(&mut board, slice_ends)?;
        let passed = Duration::from_micros((board.now() - emulated) / MICROSECOND);
        std::thread::sleep(passed.saturating_sub(real.elapsed()));
    }
    Ok(())
}

/// Opens the input, which a thread reads piece by piece. The last piece is empty or an error.
fn open(name: &str) -> Result<Receiver<std::io::Result<Vec<u8>>>> {
    let mut from: Box<dyn Read + Send> = match name {
        #[cfg(unix)]
        "pty" => Box::new(pseudo_terminal().context("no pseudo-terminal")?),
        _ => Box::new(std::io::stdin()),
    };
    let (to, pieces) = sync_channel(1);
    // No code joins this thread. It ends with the program.
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        loop {
            let read = from.read(&mut buffer);
            let is_last = !matches!(read, Ok(1..));
            let piece = read.map(|count| buffer.iter().copied().take(count).collect());
            if to.send(piece).is_err() || is_last {
                return;
            }
        }
    });
    Ok(pieces)
}

/// Opens a new pseudo-terminal and returns its master end. Prints the name of its slave end, which can be opened as a
/// serial port.
#[cfg(unix)]
fn pseudo_terminal() -> Result<std::fs::File> {
    use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

    let ends = nix::pty::openpty(None, None)?;
    // Pass bytes unchanged: no echo, no line editing, no control characters.
    let mut attributes = tcgetattr(&ends.slave)?;
    cfmakeraw(&mut attributes);
    tcsetattr(&ends.slave, SetArg::TCSANOW, &attributes)?;
    let name = nix::unistd::ttyname(&ends.slave)?;
    eprintln!("the board's serial port is {}; Ctrl-C ends", name.display());
    // Keep the slave end open in this program. Otherwise reading would end when a writer closes the slave end, before
    // the next writer opens it.
    std::mem::forget(ends.slave);
    Ok(ends.master.into())
}

/// Collects the board's events, and prints them.
#[derive(Default)]
struct Events {
    /// The watched symbols, in the order of their watch numbers.
    watches: Vec<String>,
    /// The widths of the current pulses in microseconds.
    pulses: Vec<u64>,
    /// The instant at which the pulses end if no more follow.
    pulses_end: u64,
}

impl Events {
    /// Emulates up to the instant `until`, and prints the events in their order.
    fn run_until(&mut self, board: &mut Board, until: u64) -> Result<()> {
        let outcome = board.run_until(until);
        let trace = std::mem::take(board.trace());
        let mut events: Vec<(u64, &str, String)> = Vec::new();
        for change in trace.changes {
            let symbol = self.watches.get(change.watch).expect("a watch");
            let [a, b, c, d] = change.value.to_le_bytes();
            events.push((change.at, symbol, format!("{a:3} {b:3} {c:3} {d:3}")));
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
        // A log line has no time of its own. It is shown with the time at which it was fetched: the end of the slice or
        // of the boot.
        events.extend(
            board
                .log()
                .into_iter()
                .map(|line| (board.now(), "log", line)),
        );
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
