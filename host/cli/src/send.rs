//! Sends frames to a board on time: from a motion profile, a built-in motion or UDP datagrams.

mod source;
mod transmission;

use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use framelock_receiving::Protocol;
use framelock_simulation::{Axis, Motion, Shape, check_rate};

use crate::input::Input;
use crate::options::{number, protocol, whole};
use crate::output::{Output, note, on_interrupt};
use crate::serial::{self, PortOptions};
use source::{Datagrams, Source};
use transmission::{Rate, Transmission};

/// Send frames to a board on time: from a motion profile, a built-in motion or UDP datagrams
#[derive(clap::Args)]
#[command(after_help = include_str!("help/send.txt"))]
#[command(group(clap::ArgGroup::new("source").required(true).args(["motion", "profile", "udp"])))]
pub(crate) struct Arguments {
    /// Send to a serial port such as /dev/ttyUSB0 or COM3, a pseudo-terminal, or - for standard output
    #[arg(value_name = "PORT|PTY|-")]
    line: PathBuf,

    /// Send a built-in motion around the middle position: sine-sweep, step or figure-of-eight
    #[arg(
        long,
        value_enum,
        value_name = "MOTION",
        hide_possible_values = true,
        help_heading = "Source"
    )]
    motion: Option<Shape>,
    /// Send rows from a file, or from - for standard input. The whole input is read before the first
    /// row is sent
    #[arg(long, value_name = "FILE", help_heading = "Source")]
    profile: Option<PathBuf>,
    /// Send setpoints from the datagrams that arrive at this address; port 0 takes any free port
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = address, help_heading = "Source")]
    udp: Option<SocketAddr>,

    /// Send this many frames per second
    #[arg(long, value_name = "HZ", default_value = "50", value_parser = Rate::parse)]
    rate: Rate,
    /// Stop after this time [default: at the end of the profile, or never]
    #[arg(long, value_name = "SECONDS", value_parser = |text: &str| number(text, 0.001, 1e9))]
    seconds: Option<f64>,
    /// Send these frames: a name, or a description file; all but bin and bin-crc8 need --profile
    /// [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = protocol, hide_possible_values = true)]
    frame: Protocol,
    #[command(flatten)]
    port: PortOptions,

    /// Move this far from the middle to either side, in units of the setpoint
    #[arg(long, value_name = "UNITS", default_value_t = 100, value_parser = |text: &str| whole::<u8>(text, 1, 127), help_heading = MOTIONS)]
    amplitude: u8,
    /// Move only these axes; the others stay in the middle
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "AXIS,..",
        default_value = "pitch,roll,yaw",
        hide_possible_values = true,
        help_heading = MOTIONS
    )]
    axes: Vec<Axis>,

    /// Send nothing while the last datagram is older than this; the board's failsafe takes over
    #[arg(long, value_name = "MS", default_value_t = 200, value_parser = |text: &str| whole::<u64>(text, 1, u64::MAX))]
    stale_after: u64,
    /// Stop where the axes are, without parking
    #[arg(long)]
    no_park: bool,
}

/// The heading of options.
const MOTIONS: &str = "Built-in motions";

/// Parses the address at which datagrams arrive.
fn address(text: &str) -> Result<SocketAddr> {
    text.parse()
        .context("expected an address and a port, for example 127.0.0.1:4123")
}

/// Runs `framelock send`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let parks = arguments.check_frames()? && !arguments.no_park;
    let source = arguments.source()?;
    let mut line = arguments.open_line()?;
    let name = line.name.clone();
    let (stop, stopped) = mpsc::channel();
    on_interrupt(move || {
        // The receiver of this message is gone if the transmission has just ended.
        let _ = stop.send(());
    })?;
    let mut transmission = Transmission::new(stopped, &mut line, &arguments.frame, arguments.rate);
    let length = arguments.seconds.map(Duration::from_secs_f64);
    let outcome = transmission.run(&source, length, parks);
    report(&transmission, &name);
    if let Source::Datagrams(datagrams) = source {
        let received = datagrams.received();
        note(&format!(
            "datagrams received: {}, of which bad: {}; frames not sent for lack of a fresh datagram: {}",
            received.count, received.bad, transmission.silent
        ));
        outcome?;
        if let Some(failure) = received.failure {
            bail!("cannot receive datagrams any more: {failure}");
        }
        return Ok(());
    }
    Ok(outcome?)
}

/// Prints the final report: the frames sent, and their lateness.
fn report(transmission: &Transmission, line: &str) {
    let Transmission {
        pacer,
        frames,
        park_frames,
        ..
    } = transmission;
    let seconds = pacer.now().as_secs_f64();
    note(&format!(
        "frames sent to {line} in {seconds:.2} s: {frames}, and {park_frames} to park"
    ));
    let worst = pacer.worst.as_secs_f64() * 1e3;
    note(&format!("the most delayed frame was {worst:.2} ms late"));
    if pacer.hold_ups > 0 {
        let (hold_ups, held_up) = (pacer.hold_ups, pacer.held_up.as_secs_f64());
        note(&format!(
            "held up {hold_ups} times, {held_up:.2} s in all; later frames were moved back by that time"
        ));
    }
}

impl Arguments {
    /// Returns whether the line is a port and not standard output, whose speed is unknown.
    fn is_port(&self) -> bool {
        self.line.as_os_str() != "-"
    }

    /// Checks that the source can give these frames. Returns true if the frames have setpoints, because only then can the
    /// axes be parked. If such frames go to a port, also checks that the port is fast enough.
    fn check_frames(&self) -> Result<bool> {
        if self.frame.has_setpoints() {
            if self.is_port() {
                let (rate, baud) = (self.rate.0, self.port.usual_baud());
                check_rate(rate.into(), self.frame.longest(), baud, 1.0)?;
            }
            return Ok(true);
        }
        if self.profile.is_none() {
            bail!(
                "--motion and --udp send pitch, roll and yaw, which --frame {} does not have: give \
                 its fields with --profile, a row for each frame",
                self.frame
            );
        }
        Ok(false)
    }

    /// Returns the source of the frames. Reads the file of `--profile`, if the option was given.
    fn source(&self) -> Result<Source> {
        if let Some(path) = &self.profile {
            let input = Input::open(path, &PortOptions::default())?;
            return Source::profile(input, &self.frame);
        }
        if let Some(address) = self.udp {
            let stale_after = Duration::from_millis(self.stale_after);
            return Ok(Source::Datagrams(Datagrams::listen(address, stale_after)?));
        }
        let Some(shape) = self.motion else {
            bail!("nothing to send: give --motion, --profile or --udp");
        };
        Ok(Source::Motion(Motion {
            shape,
            amplitude: self.amplitude,
            axes: self.axes.clone(),
        }))
    }

    fn open_line(&self) -> Result<Output> {
        let name = self.line.to_string_lossy();
        if self.is_port() {
            return match serial::open(&self.line, &self.port)? {
                Some(port) => Ok(Output::new(&name, port)),
                None if self.line.exists() => bail!(
                    "{name} is not a serial port: name one, or - for standard output; `framelock \
                     encode` writes frames to a file"
                ),
                None => bail!(
                    "there is no {name}: name a serial port (`framelock ports` lists them), or - for \
                     standard output"
                ),
            };
        }
        self.port.check_none("standard output", false)?;
        if std::io::stdout().is_terminal() {
            bail!(
                "standard output is a terminal, and frames are binary: redirect it, or name a \
                 serial port"
            );
        }
        Output::standard()
    }
}
