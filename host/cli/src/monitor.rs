//! Shows a live view of a line: the receiver's state, values, rates, counters and discarded bytes.

mod view;
mod watch;

use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::mpsc::{self, TryRecvError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result, bail};
use framelock::motion::FailsafeParameters;
use framelock_description::text::harmless;
use framelock_receiving::{AnyLine, Policy, Protocol};
use framelock_simulation::LEVEL;
use ratatui::crossterm::event::KeyCode;
use ratatui::text::Line;

use crate::frame_writer::FrameWriter;
use crate::input::{Arrival, Input, for_each_arrival};
use crate::options::{ProtocolParser, check_has_no_breaks, whole};
use crate::output::Output;
use crate::screen::{self, DRAW_EVERY, Screen, key_within, quits};
use crate::serial::{Device, PortOptions};
use watch::{Connection, Watch};

/// Watch a line live: the receiver's state, values, rates, counters and discarded bytes
#[derive(clap::Args)]
#[command(after_help = include_str!("help/monitor.txt"))]
pub(crate) struct Arguments {
    /// Read a serial port such as /dev/ttyUSB0 or COM3, a pseudo-terminal, or - for standard input.
    /// Keys are always read from the terminal
    #[arg(value_name = "PORT|PTY|-")]
    line: PathBuf,
    /// Receive with framelock (searches a broken frame again) or lecture (the lecture's machine, which
    /// discards it; bin only)
    #[arg(long, value_enum, default_value_t = Policy::Framelock, hide_possible_values = true)]
    policy: Policy,
    /// Receive these frames: a name, or a description file [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = ProtocolParser, hide_possible_values = true)]
    frame: Protocol,
    #[command(flatten)]
    port: PortOptions,
    /// If the port disappears, end with an error instead of waiting for it
    #[arg(long)]
    no_reconnect: bool,
    /// After a silence of this length, the failsafe holds its output
    #[arg(long, value_name = "MILLISECONDS", default_value_t = 100, value_parser = |text: &str| whole::<u32>(text, 4, 1_000_000))]
    hold_after: u32,
    /// After a silence of this length, the failsafe moves to park (128 on every axis). It needs one
    /// second for the full travel
    #[arg(long, value_name = "MILLISECONDS", default_value_t = 500, value_parser = |text: &str| whole::<u32>(text, 4, 1_000_000))]
    ramp_after: u32,
}

/// Runs `framelock monitor`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    check_has_no_breaks(&arguments.frame)?;
    let line = AnyLine::new(&arguments.frame, arguments.policy)?;
    let failsafe = FailsafeParameters {
        hold_after: arguments.hold_after * 1000,
        ramp_after: arguments.ramp_after * 1000,
        ..FailsafeParameters::for_clock(watch::TICKS_PER_SECOND, watch::TICK, LEVEL.into())
    };
    let frame = FrameWriter::new(arguments.frame.clone());
    let mut watch = Watch::new(frame, line, failsafe).context("--hold-after and --ramp-after")?;
    arguments.check_terminal()?;
    let mut input = Input::open(&arguments.line, &arguments.port)?;
    input.reconnects = !arguments.no_reconnect;
    watch.title = arguments.title(&input);
    if let Some(port) = &input.port {
        watch.mark_errors(port.device.clone(), arguments.port.has_parity());
    }
    let outcome = arguments.watch_live(&mut watch, input);
    // Print the counters even if the view ended with an error.
    let lines = watch.report();
    let report: String = lines.iter().map(|line| harmless(line) + "\n").collect();
    let written = Output::standard()?.write_all(report.as_bytes());
    outcome?;
    Ok(written?)
}

/// The number of messages that may wait in the channel. It is large enough for a serial line. A program that writes
/// into a pipe faster than the view reads has to wait.
const MOST_WAITING: usize = 64;

/// The longest time for which messages are handled before keys are checked again.
const LONGEST_CATCHING_UP: Duration = Duration::from_millis(50);

/// A message from the thread that reads the input.
enum News {
    Bytes(Vec<u8>),
    Gone(String),
    Back(Device),
    Failed(Error),
}

impl Arguments {
    /// Shows the line until the user quits or reading fails. Restores the terminal afterwards, even after an error or a
    /// panic.
    fn watch_live(&self, watch: &mut Watch, input: Input<'static>) -> Result<()> {
        let mut screen = Screen::take()?;
        let beginning = Instant::now();
        let (sender, arrivals) = mpsc::sync_channel(MOST_WAITING);
        // If the reading thread still waits for input at the end, it ends with the process.
        thread::spawn(move || {
            // Sending fails after the view is gone. This is not an error.
            let send = |news| drop(sender.send((beginning.elapsed(), news)));
            let outcome = for_each_arrival(input, |arrival| {
                send(match arrival {
                    Arrival::Bytes(bytes) => News::Bytes(bytes.to_vec()),
                    Arrival::Gone(error) => News::Gone(error.to_string()),
                    Arrival::Back(device) => News::Back(device),
                });
                Ok(())
            });
            if let Err(failure) = outcome {
                send(News::Failed(failure));
            }
        });
        // The lines at the moment when the view was paused. The line is counted all the same.
        let mut paused: Option<Vec<Line>> = None;
        while !screen.is_ended() {
            let now = beginning.elapsed();
            while beginning.elapsed() < now + LONGEST_CATCHING_UP {
                match arrivals.try_recv() {
                    Ok((at, News::Bytes(bytes))) => watch.receive(at, &bytes),
                    Ok((at, News::Gone(why))) => watch.lose_port(at, &why),
                    Ok((_, News::Back(device))) => {
                        watch.regain_port(device, self.port.has_parity());
                    }
                    Ok((_, News::Failed(failure))) => return Err(failure),
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => {
                        watch.port = Connection::Ended;
                        break;
                    }
                }
            }
            // Later arrivals are handled after the next drawing.
            watch.advance_to(now);
            let lines = paused.clone().unwrap_or_else(|| view::lines(watch));
            screen.draw(|frame| view::draw(frame, lines, paused.is_some()))?;
            match key_within(DRAW_EVERY)? {
                Some(key) if quits(key) => break,
                Some(key) if key.code == KeyCode::Char(' ') => {
                    paused = match paused {
                        Some(_) => None,
                        None => Some(view::lines(watch)),
                    };
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Checks that there is a terminal for the view, and one to read keys from.
    fn check_terminal(&self) -> Result<()> {
        let line = self.line.display();
        if !screen::is_there() {
            bail!(
                "standard output is not a terminal that can show a view; \
                 `framelock decode {line} --format text` writes lines instead"
            );
        }
        let types_at_input = io::stdin().is_terminal();
        if self.line.as_os_str() == "-" && types_at_input {
            bail!(
                "standard input is the terminal, from which keys are read: name a serial port, or \
                 pipe a stream in"
            );
        }
        if !types_at_input && !screen::has_keys() {
            bail!(
                "there is no terminal to read keys from: neither standard input nor /dev/tty is \
                 one; use `framelock decode {line} --format text` instead"
            );
        }
        Ok(())
    }

    fn title(&self, input: &Input) -> String {
        let port = match input.port {
            Some(_) => format!(", {}", self.port),
            None => String::new(),
        };
        let (frame, policy) = (&self.frame, self.policy);
        format!("{}{port}, {frame}, {policy}", input.name)
    }
}
