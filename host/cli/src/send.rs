//! Frames to a board: from a motion profile, a built-in motion or UDP datagrams, on time.

mod datagrams;
mod pacer;
mod profile;
mod transmission;

use std::io::IsTerminal;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use anyhow::{Result, bail};
use framelock::motion::Setpoint;
use framelock_receiving::Protocol;
use framelock_simulation::{
    Axis, ByteFaults, FaultRates, Motion, Seed, Shape, check_rate, time_on_line,
};

use crate::frame_option::ProtocolParser;
use crate::input::Input;
use crate::options::{number, probability, setpoint, whole};
use crate::output::{Output, note};
use crate::process::on_interrupt;
use crate::serial::{self, LastingPort, PortOptions};
use datagrams::{Datagrams, Heard};
use pacer::{Clock, Rate, RealClock};
use profile::Profile;
use transmission::{Parking, Source, Transmission};

/// Frames to a board: from a motion profile, a built-in motion or UDP datagrams, on time
#[derive(clap::Args)]
#[command(after_help = include_str!("help/send.txt"))]
#[command(group(clap::ArgGroup::new("source").required(true).args(["motion", "profile", "udp"])))]
pub(crate) struct Arguments {
    /// A serial port such as /dev/ttyUSB0 or COM3, a pseudo-terminal, or - for standard output
    #[arg(value_name = "PORT|PTY|-")]
    line: PathBuf,

    /// A built-in motion, around level: sine-sweep, step or figure-of-eight
    #[arg(
        long,
        value_enum,
        value_name = "MOTION",
        hide_possible_values = true,
        help_heading = "What is sent"
    )]
    motion: Option<Shape>,
    /// Rows from a file, or - for standard input; read to its end before any is sent
    #[arg(long, value_name = "FILE", help_heading = "What is sent")]
    profile: Option<PathBuf>,
    /// Setpoints from datagrams that come to this address; port 0 is any that is free
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = address, help_heading = "What is sent")]
    udp: Option<SocketAddr>,

    /// Frames in a second [default: 50, or the profile's own times]
    #[arg(long, value_name = "HZ", value_parser = |text: &str| whole::<u32>(text, 1, 100_000))]
    rate: Option<u32>,
    /// End after this time; without it, where the profile ends, or never
    #[arg(long, value_name = "SECONDS", value_parser = |text: &str| number(text, 0.001, 1e9))]
    seconds: Option<f64>,
    /// The frames: a name, or a file that describes them [default: bin]. Those other than bin and
    /// bin-crc8 are sent from a profile, and do not park
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = ProtocolParser, hide_possible_values = true)]
    frame: Protocol,
    #[command(flatten)]
    port: PortOptions,
    /// End with an error when the port is gone, instead of waiting for it
    #[arg(long)]
    no_reconnect: bool,

    #[command(flatten)]
    shape: ShapeArguments,

    /// How old the last datagram may be, in milliseconds; then nothing is sent, and the board's
    /// failsafe takes over
    #[arg(long, value_name = "MS", default_value_t = 200, value_parser = |text: &str| whole::<u64>(text, 1, u64::MAX), help_heading = "Datagrams")]
    stale_after: u64,

    #[command(flatten)]
    end: End,

    #[command(flatten)]
    faults: FaultArguments,
}

/// Of a built-in motion.
#[derive(clap::Args)]
#[command(next_help_heading = "The built-in motions")]
struct ShapeArguments {
    /// The way from level to either end, in units of demand
    #[arg(long, value_name = "UNITS", default_value_t = 100, value_parser = |text: &str| whole::<u8>(text, 1, 127))]
    amplitude: u8,
    /// How long until it repeats [default: 20 for the sweep, 4 for the others]
    #[arg(long, value_name = "SECONDS", value_parser = |text: &str| number(text, 0.001, 1e9))]
    period: Option<f64>,
    /// The sweep's lowest frequency
    #[arg(long, value_name = "HZ", default_value_t = 0.1, value_parser = |text: &str| number(text, 0.001, 1000.0))]
    from: f64,
    /// The sweep's highest frequency
    #[arg(long, value_name = "HZ", default_value_t = 2.0, value_parser = |text: &str| number(text, 0.001, 1000.0))]
    to: f64,
    /// Which axes move; the others stay level
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "AXIS,..",
        default_value = "pitch,roll,yaw",
        hide_possible_values = true
    )]
    axes: Vec<Axis>,
}

/// Where it ends.
#[derive(clap::Args)]
#[command(next_help_heading = "The end")]
struct End {
    /// Where the axes go at the end
    #[arg(long, value_name = "PITCH,ROLL,YAW", default_value = "128,128,128", value_parser = setpoint)]
    park: Setpoint,
    /// How long the way there takes
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = |text: &str| number(text, 0.0, 3600.0))]
    park_seconds: f64,
    /// Just stop
    #[arg(long, conflicts_with_all = ["park", "park_seconds"])]
    no_park: bool,
}

/// Faults on purpose.
#[derive(clap::Args)]
#[command(
    next_help_heading = "Faults on purpose, with probability P (0 to 1) for each byte not of parking"
)]
struct FaultArguments {
    /// It is not sent
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability, hide_default_value = true, allow_negative_numbers = true)]
    drop: f64,
    /// One bit of it is inverted
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability, hide_default_value = true, allow_negative_numbers = true)]
    flip: f64,
    /// It is sent twice
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability, hide_default_value = true, allow_negative_numbers = true)]
    duplicate: f64,
    /// A random byte is sent in front of it
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = probability, hide_default_value = true, allow_negative_numbers = true)]
    insert: f64,
    /// The same seed makes the same faults
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
}

/// Where datagrams come to.
fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse()
        .map_err(|_| "an address and a port are wanted, for example 127.0.0.1:4123".into())
}

/// What is sent unless a rate is asked for, in hertz.
const USUAL_RATE: Rate = Rate(NonZeroU32::new(50).unwrap());

/// Runs `framelock send`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let parking = arguments.parking()?;
    let profile = arguments.profile()?;
    if arguments.is_port() {
        arguments.check_line(profile.as_ref())?;
    }
    let (source, datagrams) = arguments.source(profile)?;
    let is_stopped = Arc::new(AtomicBool::new(false));
    let mut line = arguments.open_line(&is_stopped)?;
    let name = line.name.clone();
    let (stop, stopped) = mpsc::channel();
    on_interrupt(move || {
        is_stopped.store(true, Ordering::Relaxed);
        // It may just have ended by itself.
        let _ = stop.send(());
    })?;
    let clock = RealClock::new(stopped);
    let faults = arguments.faults.byte_faults();
    let mut transmission = Transmission::new(clock, &mut line, &arguments.frame, faults);
    let length = arguments.seconds.map(Duration::from_secs_f64);
    let outcome = transmission.run(source, length, parking);
    let heard = datagrams.map(|datagrams| datagrams.heard());
    for line in report(&transmission, &name, arguments.faults.seed, heard.as_ref()) {
        note(&line);
    }
    outcome?;
    if let Some(failure) = heard.and_then(|heard| heard.failure) {
        bail!("cannot hear datagrams any more: {failure}");
    }
    Ok(())
}

/// What was sent, and how well.
fn report(
    transmission: &Transmission<RealClock, Output>,
    line: &str,
    seed: u64,
    heard: Option<&Heard>,
) -> Vec<String> {
    let pacer = &transmission.pacer;
    let seconds = |time: Duration| time.as_secs_f64();
    let mut report = vec![
        format!(
            "frames sent to {line} in {:.2} s: {}, and {} to park",
            seconds(pacer.clock.now()),
            transmission.frames,
            transmission.park_frames
        ),
        format!("the latest was {:.2} ms late", seconds(pacer.worst) * 1e3),
    ];
    if pacer.hold_ups > 0 {
        report.push(format!(
            "held up {} times, {:.2} s in all, by which what was left was sent later",
            pacer.hold_ups,
            seconds(pacer.held_up)
        ));
    }
    if let Some(faults) = transmission.faults.as_ref().map(ByteFaults::counts) {
        report.push(format!(
            "faults (seed {seed}): of {} bytes {} dropped, {} with a bit inverted, {} sent twice; \
             {} inserted",
            faults.bytes, faults.dropped, faults.flipped, faults.duplicated, faults.inserted
        ));
    }
    if let Some(heard) = heard {
        report.push(format!(
            "datagrams heard: {}, bad ones among them: {}; frames not sent for want of a fresh \
             one: {}",
            heard.count, heard.bad, transmission.silent
        ));
    }
    report
}

impl Arguments {
    /// The rate that was asked for, or else the usual one.
    fn rate(&self) -> Rate {
        self.rate.and_then(NonZeroU32::new).map_or(USUAL_RATE, Rate)
    }

    /// What is behind standard output may be of any speed.
    fn is_port(&self) -> bool {
        self.line.as_os_str() != "-"
    }

    /// That the line carries what is sent.
    fn check_line(&self, profile: Option<&Profile>) -> Result<()> {
        let (rate, baud) = (self.rate(), self.port.usual_baud());
        let is_held = profile.is_some_and(Profile::has_times) && self.rate.is_some();
        if self.frame.has_setpoints() {
            // Whatever the times of a profile are, it parks at the rate.
            check_rate(rate.0.get().into(), self.frame.longest(), 0, baud, 1.0)?;
        }
        let time_of = |bytes| time_on_line(bytes, baud);
        profile.map_or(Ok(()), |profile| {
            profile.check_line_carries(rate, is_held, time_of)
        })
    }

    /// The profile, if there is one.
    fn profile(&self) -> Result<Option<Profile>> {
        let path = self.profile.as_ref();
        path.map(|path| Profile::read(Input::open(path, &PortOptions::default())?, &self.frame))
            .transpose()
    }

    /// How it ends. Frames without setpoints just stop.
    fn parking(&self) -> Result<Option<Parking>> {
        if self.frame.has_setpoints() {
            return Ok(self.end.parking(self.rate()));
        }
        if self.profile.is_none() {
            bail!(
                "--motion and --udp bring pitch, roll and yaw, which --frame {} does not have: give \
                 its fields by --profile, a row for each frame",
                self.frame
            );
        }
        Ok(None)
    }

    /// What is sent; and where it is heard, if it comes in datagrams.
    fn source(&self, profile: Option<Profile>) -> Result<(Source, Option<Datagrams>)> {
        let rate = self.rate();
        if let Some(profile) = profile {
            if !profile.has_times() || self.rate.is_some() {
                return Ok((profile.held(rate), None));
            }
            return Ok((profile.in_turn(rate), None));
        }
        let frame = self.frame.clone();
        if let Some(address) = self.udp {
            let datagrams = Datagrams::listen(address)?;
            let stale_after = Duration::from_millis(self.stale_after);
            return Ok((datagrams.source(frame, rate, stale_after), Some(datagrams)));
        }
        let Some(shape) = self.motion else {
            bail!("nothing to send: give --motion, --profile or --udp");
        };
        let motion = self.shape.motion(shape);
        let source = Source {
            dues: Box::new(rate.dues()),
            frame: Box::new(move |due| Some(frame.encode_setpoint(motion.at(due)))),
        };
        Ok((source, None))
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
                    "{name} is no serial port: name one, or - for standard output; frames go to a \
                     file by `framelock encode`"
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

impl End {
    fn parking(&self, rate: Rate) -> Option<Parking> {
        (!self.no_park).then_some(Parking {
            at: self.park,
            seconds: self.park_seconds,
            rate,
        })
    }
}

impl ShapeArguments {
    fn motion(&self, shape: Shape) -> Motion {
        Motion {
            shape,
            amplitude: self.amplitude,
            period: self.period.unwrap_or(shape.usual_period()),
            frequencies: [self.from, self.to],
            axes: self.axes.clone(),
        }
    }
}

impl FaultArguments {
    /// Nothing if every probability is 0.
    fn byte_faults(&self) -> Option<ByteFaults> {
        let rates = FaultRates {
            drop: self.drop,
            flip: self.flip,
            duplicate: self.duplicate,
            insert: self.insert,
        };
        let (seed, trial) = (self.seed, 0);
        (rates != FaultRates::default()).then(|| ByteFaults::new(rates, Seed { seed, trial }))
    }
}
