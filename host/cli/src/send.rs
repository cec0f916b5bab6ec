//! Sends frames to a board on time: from a motion profile, a built-in motion or UDP datagrams.

mod datagrams;
mod pacer;
mod source;
mod transmission;

use std::io::IsTerminal;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use framelock::motion::Setpoint;
use framelock_receiving::Protocol;
use framelock_simulation::{Axis, Motion, Shape, check_rate};

use crate::input::Input;
use crate::options::{ProtocolParser, number, setpoint, whole};
use crate::output::{Output, note};
use crate::process::on_interrupt;
use crate::serial::{self, LastingPort, PortOptions};
use datagrams::Datagrams;
use pacer::{Clock, Rate, RealClock};
use source::{Profile, Source};
use transmission::{Parking, Transmission};

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

    /// Send this many frames per second [default: 50, or the profile's own times]
    #[arg(long, value_name = "HZ", value_parser = |text: &str| whole::<u32>(text, 1, 100_000))]
    rate: Option<u32>,
    /// Stop after this time [default: at the end of the profile, or never]
    #[arg(long, value_name = "SECONDS", value_parser = |text: &str| number(text, 0.001, 1e9))]
    seconds: Option<f64>,
    /// Send these frames: a name, or a description file; all but bin and bin-crc8 need --profile
    /// [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = ProtocolParser, hide_possible_values = true)]
    frame: Protocol,
    #[command(flatten)]
    port: PortOptions,
    /// If the port disappears, end with an error instead of waiting for it
    #[arg(long)]
    no_reconnect: bool,

    /// Move this far from the middle to either side, in units of the setpoint
    #[arg(long, value_name = "UNITS", default_value_t = 100, value_parser = |text: &str| whole::<u8>(text, 1, 127), help_heading = MOTIONS)]
    amplitude: u8,
    /// Repeat the motion after this time [default: 20 for the sweep, 4 for the others]
    #[arg(long, value_name = "SECONDS", value_parser = |text: &str| number(text, 0.001, 1e9), help_heading = MOTIONS)]
    period: Option<f64>,
    /// Set the sweep's lowest frequency
    #[arg(long, value_name = "HZ", default_value_t = 0.1, value_parser = |text: &str| number(text, 0.001, 1000.0), help_heading = MOTIONS)]
    from: f64,
    /// Set the sweep's highest frequency
    #[arg(long, value_name = "HZ", default_value_t = 2.0, value_parser = |text: &str| number(text, 0.001, 1000.0), help_heading = MOTIONS)]
    to: f64,
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
    #[arg(long, value_name = "MS", default_value_t = 200, value_parser = |text: &str| whole::<u64>(text, 1, u64::MAX), help_heading = "Datagrams")]
    stale_after: u64,

    /// Park at this setpoint
    #[arg(long, value_name = "PITCH,ROLL,YAW", default_value = "128,128,128", value_parser = setpoint, help_heading = PARKING)]
    park: Setpoint,
    /// Take this long to move to park
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = |text: &str| number(text, 0.0, 3600.0), help_heading = PARKING)]
    park_seconds: f64,
    /// Stop where the axes are, without parking
    #[arg(long, conflicts_with_all = ["park", "park_seconds"], help_heading = PARKING)]
    no_park: bool,
}

/// The headings of options.
const MOTIONS: &str = "Built-in motions";
const PARKING: &str = "Parking";

/// Parses the address at which datagrams arrive.
fn address(text: &str) -> Result<SocketAddr> {
    text.parse()
        .context("expected an address and a port, for example 127.0.0.1:4123")
}

/// The default of `--rate`, in frames per second.
const USUAL_RATE: Rate = Rate(NonZeroU32::new(50).unwrap());

/// Runs `framelock send`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let parking = arguments.parking()?;
    let source = arguments.source()?;
    let is_stopped = Arc::new(AtomicBool::new(false));
    let mut line = arguments.open_line(&is_stopped)?;
    let name = line.name.clone();
    let (stop, stopped) = mpsc::channel();
    on_interrupt(move || {
        is_stopped.store(true, Ordering::Relaxed);
        // The receiver of this message is gone if the transmission has just ended.
        let _ = stop.send(());
    })?;
    let clock = RealClock::new(stopped);
    let mut transmission = Transmission::new(clock, &mut line, &arguments.frame, arguments.rate());
    let length = arguments.seconds.map(Duration::from_secs_f64);
    let outcome = transmission.run(&source, length, parking);
    for line in report(&transmission, &name) {
        note(&line);
    }
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

/// Returns the lines of the final report: the frames sent, and their lateness.
fn report(transmission: &Transmission<RealClock, Output>, line: &str) -> Vec<String> {
    let pacer = &transmission.pacer;
    let seconds = |time: Duration| time.as_secs_f64();
    let mut report = vec![
        format!(
            "frames sent to {line} in {:.2} s: {}, and {} to park",
            seconds(pacer.clock.now()),
            transmission.frames,
            transmission.park_frames
        ),
        format!(
            "the most delayed frame was {:.2} ms late",
            seconds(pacer.worst) * 1e3
        ),
    ];
    if pacer.hold_ups > 0 {
        report.push(format!(
            "held up {} times, {:.2} s in all; later frames were moved back by that time",
            pacer.hold_ups,
            seconds(pacer.held_up)
        ));
    }
    report
}

impl Arguments {
    /// Returns the rate that `--rate` gives, or the default rate.
    fn rate(&self) -> Rate {
        self.rate.and_then(NonZeroU32::new).map_or(USUAL_RATE, Rate)
    }

    /// Returns whether the line is a port. Standard output has no known speed.
    fn is_port(&self) -> bool {
        self.line.as_os_str() != "-"
    }

    /// Returns how to park at the end. Frames without setpoints are not parked. Checks that a port is fast enough for
    /// the parking, which always uses `rate`, even if the profile has times of its own.
    fn parking(&self) -> Result<Option<Parking>> {
        if self.frame.has_setpoints() {
            if self.is_port() {
                let (rate, baud) = (self.rate().0.get(), self.port.usual_baud());
                check_rate(rate.into(), self.frame.longest(), baud, 1.0)?;
            }
            return Ok((!self.no_park).then_some(Parking {
                at: self.park,
                seconds: self.park_seconds,
            }));
        }
        if self.profile.is_none() {
            bail!(
                "--motion and --udp send pitch, roll and yaw, which --frame {} does not have: give \
                 its fields with --profile, a row for each frame",
                self.frame
            );
        }
        Ok(None)
    }

    /// Returns the source of the frames. Reads the file of `--profile`, if the option was given.
    fn source(&self) -> Result<Source> {
        if let Some(path) = &self.profile {
            let input = Input::open(path, &PortOptions::default())?;
            let profile = Profile::read(input, &self.frame)?;
            if profile.has_times() && self.rate.is_some() {
                bail!("--rate: the profile has times of its own: leave --rate or the times out");
            }
            return Ok(Source::Profile(profile));
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
            period: self.period.unwrap_or(shape.usual_period()),
            frequencies: [self.from, self.to],
            axes: self.axes.clone(),
        }))
    }

    fn open_line(&self, is_stopped: &Arc<AtomicBool>) -> Result<Output> {
        let name = self.line.to_string_lossy();
        if self.is_port() {
            return match serial::open_or_wait(&self.line, &self.port)? {
                Some(port) if self.no_reconnect => Ok(Output::new(&name, port)),
                Some(port) => {
                    let is_stopped = Arc::clone(is_stopped);
                    let lasting = LastingPort {
                        path: self.line.clone(),
                        options: self.port.clone(),
                        port: Some(port),
                        is_stopped: move || is_stopped.load(Ordering::Relaxed),
                    };
                    Ok(Output::new(&name, lasting))
                }
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
        self.port.check_none("standard output")?;
        if std::io::stdout().is_terminal() {
            bail!(
                "standard output is a terminal, and frames are binary: redirect it, or name a \
                 serial port"
            );
        }
        Output::standard()
    }
}
