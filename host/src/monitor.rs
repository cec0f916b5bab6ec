//! A live view of a line: the machine's state, values, rates, counters and what was discarded.

mod live;
mod session;
mod view;
mod watch;

use std::io::{self, IsTerminal, Write};
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::value_parser;
use framelock::FailsafeParameters;
use framelock_simulation::LEVEL;

use crate::frame::Frame;
use crate::input::Input;
use crate::line::Line;
use crate::line_errors::{Marking, Marks};
use crate::names::{PolicyName, name};
use crate::output::Output;
use crate::{screen, serial};
use session::{Recording, Session};
use watch::Watch;

/// A live view of a line: the machine's state, values, rates, counters and what was discarded.
///
/// Behind a receiver of setpoints is a failsafe as a board has it. Keys: ? help, space pauses, r records, z
/// sets the counters to zero, q quits. It ends with one line of counters on standard output.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/monitor.txt"))]
pub(crate) struct Arguments {
    /// A serial port such as /dev/ttyUSB0 or COM3, a pseudo-terminal, or - for standard input;
    /// keys are then read from the terminal all the same
    #[arg(value_name = "PORT|PTY|-")]
    line: PathBuf,
    /// What to do with the bytes behind a broken frame
    #[arg(long, value_enum, default_value_t = PolicyName::Rescan)]
    policy: PolicyName,
    /// The frames: a name, or a file that describes them [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = Frame::named)]
    frame: Frame,
    /// The serial port's rate [default: 115200]; 8 data bits, no parity, 1 stop bit
    #[arg(long, value_name = "RATE", value_parser = value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// Record the line in this new file from the start
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Drop the current frame after a pause of this length; not done unless given, since USB adapters
    /// deliver in batches
    #[arg(long, value_name = "MILLISECONDS", value_parser = value_parser!(u64).range(1..=1_000_000))]
    idle_gap: Option<u64>,
    /// Silence after which the failsafe holds
    #[arg(long, value_name = "MILLISECONDS", default_value_t = 100, value_parser = value_parser!(u32).range(1..=1_000_000))]
    hold_after: u32,
    /// Silence after which it moves to park, 128 on every axis, the full travel in a second
    #[arg(long, value_name = "MILLISECONDS", default_value_t = 500, value_parser = value_parser!(u32).range(1..=1_000_000))]
    ramp_after: u32,
}

/// The full travel in one second, as the firmware has it.
const MICROSECONDS_PER_UNIT: NonZeroU32 = NonZeroU32::new(3_922).unwrap();

/// Runs `framelock monitor`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let line = Line::new(&arguments.frame, arguments.policy)?;
    let idle_gap = arguments.idle_gap.map(Duration::from_millis);
    let failsafe = FailsafeParameters {
        hold_after: arguments.hold_after * 1000,
        ramp_after: arguments.ramp_after * 1000,
        park: LEVEL,
        ticks_per_unit: [MICROSECONDS_PER_UNIT; 3],
    };
    let watch = Watch::new(arguments.frame.clone(), line, failsafe, idle_gap)
        .context("--hold-after and --ramp-after")?;
    arguments.check_terminal()?;
    let input = Input::open(&arguments.line, arguments.baud)?;
    let recording = arguments.record.clone().map(|path| {
        let cannot = format!("cannot record in {}: a new file is wanted", path.display());
        Recording::begin(path).context(cannot)
    });
    let recording = recording.transpose()?;
    // Until the end: then the port is as before.
    let marking: Option<Marking> = input.port.clone().and_then(Marking::begin);
    let marks = marking.as_ref().map(|_| Marks::default());
    let title = arguments.title(&input);
    let mut session = Session::new(title, watch, marks, recording);
    let outcome = live::run(&mut session, input);
    // However it ended, this was seen.
    let told = session.finish().join("\n") + "\n";
    let is_told = Output::standard()?.write_all(told.as_bytes());
    outcome?;
    Ok(is_told?)
}

impl Arguments {
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
        let baud = match self.baud.unwrap_or(serial::DEFAULT_BAUD) {
            baud if input.port.is_some() => format!(", {baud} baud"),
            _ => String::new(),
        };
        let (frame, policy) = (&self.frame, name(&self.policy));
        format!("{}{baud}, {frame}, {policy}", input.name)
    }
}
