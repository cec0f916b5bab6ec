//! A live view of a line: the machine's state, setpoints, rates, counters and what was discarded.

mod live;
mod recording;
mod session;
mod view;
mod watch;

use std::io::{self, IsTerminal, Write};
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::{ValueEnum, value_parser};
use framelock::{Bin, BinCrc8, Discard, FailsafeParameters, Lecture, Parser, Receiver, Setpoint};

use crate::input::Input;
use crate::line_errors::Marking;
use crate::names::{FrameName, PolicyName};
use crate::setpoints::LEVEL;
use crate::stream::Failure;
use crate::{screen, serial};
use recording::Recording;
use session::Session;
use watch::Watch;

/// A live view of a line: the machine's state, setpoints, rates, counters and what was discarded.
///
/// Behind the receiver is a failsafe as a board has it. Keys: ? help, space pauses, r records, z
/// sets the counters to zero, q quits. It ends with one line of counters on standard output.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// A serial port such as /dev/ttyUSB0 or COM3, a pseudo-terminal, or - for standard input;
    /// keys are then read from the terminal all the same
    #[arg(value_name = "PORT|PTY|-")]
    line: PathBuf,
    /// What to do with the bytes behind a broken frame
    #[arg(long, value_enum, default_value_t = PolicyName::Rescan)]
    policy: PolicyName,
    /// The frame format
    #[arg(long, value_enum, default_value_t = FrameName::Bin)]
    frame: FrameName,
    /// The serial port's rate [default: 115200]; 8 data bits, no parity, 1 stop bit
    #[arg(long, value_name = "RATE", value_parser = value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// Record the line in this new file from the start
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// After so long without a byte, drop the frame under way; not done unless given, since USB
    /// adapters deliver in batches
    #[arg(long, value_name = "MILLISECONDS", value_parser = value_parser!(u64).range(1..=1_000_000))]
    idle_gap: Option<u64>,
    /// Silence after which the failsafe holds
    #[arg(long, value_name = "MILLISECONDS", default_value_t = 100, value_parser = value_parser!(u32).range(1..=1_000_000))]
    hold_after: u32,
    /// Silence after which it moves to park, 128 on every axis, the full travel in a second
    #[arg(long, value_name = "MILLISECONDS", default_value_t = 500, value_parser = value_parser!(u32).range(1..=1_000_000))]
    ramp_after: u32,
}

const EXAMPLES: &str = "\
Examples:
  framelock monitor /dev/ttyACM0                        watch a serial port
  framelock monitor /dev/ttyACM0 --record capture.bin   and keep what comes for decode and trace
  framelock monitor COM3 --policy discard               as the lecture's machine sees the line
  framelock send - --motion step --drop 0.01 | framelock monitor -

Times are those at which the bytes reached this program: behind a USB adapter some come together.
Framing errors and breaks are shown where the operating system reports them: of a serial port, not
on Windows. Overruns of the port it does not report. A recording holds the bytes that came without
an error.

Where there is no terminal, `framelock decode PORT --format text` writes lines.";

/// The full travel in one second, as the firmware has it.
const MICROSECONDS_PER_UNIT: NonZeroU32 = NonZeroU32::new(3_922).unwrap();

/// Runs `framelock monitor`.
///
/// # Errors
/// There is no terminal for the view or for keys; the line cannot be opened, or is cut; the
/// recording cannot be begun.
pub fn run(arguments: &Arguments) -> Result<()> {
    let run = match (arguments.policy, arguments.frame) {
        (PolicyName::Rescan, FrameName::Bin) => watch_with::<Receiver<Bin>>,
        (PolicyName::Rescan, FrameName::BinCrc8) => watch_with::<Receiver<BinCrc8>>,
        (PolicyName::Discard, FrameName::Bin) => watch_with::<Lecture>,
        (PolicyName::Discard, FrameName::BinCrc8) => watch_with::<Receiver<BinCrc8, Discard>>,
    };
    run(arguments)
}

fn watch_with<P>(arguments: &Arguments) -> Result<()>
where
    P: Parser<Message = Setpoint> + Default + Copy,
{
    let watch = Watch::<P>::new(
        arguments.failsafe(),
        arguments.idle_gap.map(Duration::from_millis),
    )
    .context("--hold-after and --ramp-after")?;
    arguments.check_terminal()?;
    let input = Input::open(&arguments.line, arguments.baud)?;
    let name = input.name.clone();
    let recording = match &arguments.record {
        Some(path) => Some(Recording::begin(path).with_context(|| {
            format!("cannot record in {}: a new file is wanted", path.display())
        })?),
        None => None,
    };
    // Until the end: then the port is as before.
    let marking: Option<Marking> = input.mark_line_errors();
    let title = arguments.title(&input);
    let mut session = Session::new(title, watch, marking.is_some(), recording, PathBuf::new());
    let outcome = live::run(&mut session, input);
    // However it ended, this was seen.
    let mut told = session.finish().join("\n");
    told.push('\n');
    let is_told = io::stdout().write_all(told.as_bytes());
    outcome?.or_else(|failure| failure.told(&name, "the terminal"))?;
    is_told.or_else(|error| Failure::Write(error).told("", "standard output"))
}

impl Arguments {
    fn failsafe(&self) -> FailsafeParameters {
        FailsafeParameters {
            hold_after: self.hold_after * 1000,
            ramp_after: self.ramp_after * 1000,
            park: LEVEL,
            ticks_per_unit: [MICROSECONDS_PER_UNIT; 3],
        }
    }

    /// That there is one for the view, and one for keys beside the stream.
    fn check_terminal(&self) -> Result<()> {
        let line = self.line.display();
        if !screen::is_there() {
            bail!(
                "standard output is no terminal that can show a view; \
                 `framelock decode {line} --format text` writes lines"
            );
        }
        let types_at_input = io::stdin().is_terminal();
        if self.line.as_os_str() == "-" && types_at_input {
            bail!(
                "standard input is the terminal that keys are typed at, no stream: name a serial \
                 port, or pipe a stream in"
            );
        }
        if !types_at_input && !screen::has_keys() {
            bail!(
                "there is no terminal to read keys from: neither standard input nor /dev/tty is \
                 one; `framelock decode {line} --format text` needs none"
            );
        }
        Ok(())
    }

    fn title(&self, input: &Input) -> String {
        let called = |name: &dyn Fn() -> Option<clap::builder::PossibleValue>| {
            name().map_or_else(String::new, |name| name.get_name().to_owned())
        };
        let baud = if input.is_port() {
            format!(", {} baud", self.baud.unwrap_or(serial::DEFAULT_BAUD))
        } else {
            String::new()
        };
        format!(
            "{}{baud}, {}, {}",
            input.name,
            called(&|| self.frame.to_possible_value()),
            called(&|| self.policy.to_possible_value())
        )
    }
}
