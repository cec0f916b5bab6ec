//! Frames to a board: from a motion profile, a built-in motion or UDP datagrams, on time.

mod datagrams;
mod faults;
mod motion;
mod pacer;
mod profile;
mod session;
mod source;
mod told;

use std::io::{IsTerminal, Write};
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Sender};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::value_parser;
use framelock::{Bin, BinCrc8, Setpoint};

use crate::input::Input;
use crate::line_rate;
use crate::names::FrameName;
use crate::numbers::{number, probability};
use crate::setpoints;
use crate::stream::Failure;
use crate::{interrupt, serial, standard};
use datagrams::Datagrams;
use faults::{FaultRates, Faults};
use motion::{Axis, Motion, MotionName};
use pacer::RealClock;
use profile::Profile;
use session::{Parking, Session};
use source::{PacedMotion, Rate, Source};

/// Frames to a board: from a motion profile, a built-in motion or UDP datagrams, on time.
///
/// Each frame's deadline counts from the beginning, so that lateness never adds up. At the end,
/// Ctrl-C included, the axes go to park and stay there for five frames; a second Ctrl-C ends at
/// once. What was sent, and how late the latest frame was, is told on standard error.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
#[command(group(clap::ArgGroup::new("source").required(true).args(["motion", "profile", "udp"])))]
pub struct Arguments {
    /// A serial port such as /dev/ttyUSB0 or COM3, a pseudo-terminal, or - for standard output
    #[arg(value_name = "PORT|PTY|-")]
    line: PathBuf,

    /// A built-in motion, around level
    #[arg(long, value_enum, value_name = "MOTION", help_heading = "What is sent")]
    motion: Option<MotionName>,
    /// Setpoints from a file, or - for standard input; read to its end before any is sent
    #[arg(long, value_name = "FILE", help_heading = "What is sent")]
    profile: Option<PathBuf>,
    /// Setpoints from datagrams that come to this address; port 0 is any that is free
    #[arg(long, value_name = "ADDRESS:PORT", help_heading = "What is sent")]
    udp: Option<SocketAddr>,

    /// Frames in a second [default: 50, or the profile's own times]
    #[arg(long, value_name = "HZ", value_parser = value_parser!(u32).range(1..=100_000))]
    rate: Option<u32>,
    /// End after so long; without it, where the profile ends, or never
    #[arg(long, value_name = "SECONDS", value_parser = some_seconds)]
    seconds: Option<f64>,
    /// The frame format
    #[arg(long, value_enum, default_value_t = FrameName::Bin)]
    frame: FrameName,
    /// The serial port's rate [default: 115200]; 8 data bits, no parity, 1 stop bit
    #[arg(long, value_name = "RATE", value_parser = value_parser!(u32).range(1..))]
    baud: Option<u32>,

    #[command(flatten)]
    shape: Shape,

    /// How old the last datagram may be; then nothing is sent, and the board's failsafe takes over
    #[arg(long, value_name = "MILLISECONDS", default_value_t = 200, value_parser = value_parser!(u64).range(1..), help_heading = "Datagrams")]
    stale_after: u64,

    #[command(flatten)]
    end: End,

    #[command(flatten)]
    faults: FaultArguments,
}

/// Of a built-in motion.
#[derive(clap::Args)]
#[command(next_help_heading = "The built-in motions")]
struct Shape {
    /// The way from level to either end, in units of demand
    #[arg(long, value_name = "UNITS", default_value_t = 100, value_parser = value_parser!(u8).range(1..=127))]
    amplitude: u8,
    /// How long until it repeats [default: 20 for the sweep, 4 for the others]
    #[arg(long, value_name = "SECONDS", value_parser = some_seconds)]
    period: Option<f64>,
    /// The sweep's lowest frequency
    #[arg(long, value_name = "HZ", default_value_t = 0.1, value_parser = frequency)]
    from: f64,
    /// The sweep's highest frequency
    #[arg(long, value_name = "HZ", default_value_t = 2.0, value_parser = frequency)]
    to: f64,
    /// Which axes move; the others stay level
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "AXIS,..",
        default_value = "pitch,roll,yaw"
    )]
    axes: Vec<Axis>,
}

/// Where it ends.
#[derive(clap::Args)]
#[command(next_help_heading = "The end")]
struct End {
    /// Where the axes go at the end
    #[arg(long, value_name = "PITCH,ROLL,YAW", default_value = "128,128,128", value_parser = setpoints::parse)]
    park: Setpoint,
    /// How long the way there takes
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = park_seconds)]
    park_seconds: f64,
    /// Just stop
    #[arg(long, conflicts_with_all = ["park", "park_seconds"])]
    no_park: bool,
}

/// Faults on purpose.
#[derive(clap::Args)]
#[command(next_help_heading = "Faults on purpose, for each byte but those that park")]
struct FaultArguments {
    /// Probability that it is not sent, 0 to 1
    #[arg(long, value_name = "PROBABILITY", default_value_t = 0.0, value_parser = probability, allow_negative_numbers = true)]
    drop: f64,
    /// Probability that one bit of it is inverted
    #[arg(long, value_name = "PROBABILITY", default_value_t = 0.0, value_parser = probability, allow_negative_numbers = true)]
    flip: f64,
    /// Probability that it is sent twice
    #[arg(long, value_name = "PROBABILITY", default_value_t = 0.0, value_parser = probability, allow_negative_numbers = true)]
    duplicate: f64,
    /// Probability that a random byte is sent in front of it
    #[arg(long, value_name = "PROBABILITY", default_value_t = 0.0, value_parser = probability, allow_negative_numbers = true)]
    insert: f64,
    /// The same seed makes the same faults
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
}

const EXAMPLES: &str = "\
Examples:
  framelock send /dev/ttyACM0 --motion figure-of-eight         until Ctrl-C, which parks
  framelock send /dev/ttyACM0 --motion step --axes pitch --amplitude 20
  framelock send /dev/ttyACM0 --profile moves.csv --rate 100   a row in each frame
  framelock send /dev/ttyACM0 --udp 0.0.0.0:4123               what motion software sends
  framelock send - --motion step --drop 0.01 | framelock monitor -
                                                               both ends of a bad line

A profile is what `framelock encode` reads, comma-separated values or JSON lines, and may have a
column or field time, in seconds (without a header: the first of four columns). With times each row
is sent at its time, counted from the first row's; with --rate as well, a frame is sent at that rate
with the last row whose time has come. Without times a row is sent in each frame.

A datagram is three bytes (pitch, roll, yaw), or text such as 127,200,74, or one frame of either
format. Frames go out at --rate with the latest datagram's setpoint. Bad datagrams are counted.

A frame is up to 250 ms late without consequence for those behind it. After a longer delay (the
computer slept, nobody took the bytes) all that is left is sent that much later, and it is told.";

/// What is sent unless a rate is asked for, in hertz.
const USUAL_RATE: Rate = Rate(NonZeroU32::new(50).unwrap());

/// Runs `framelock send`.
///
/// # Errors
/// The line cannot be opened or takes no more, or cannot carry so many frames; the profile cannot
/// be read or has a mistake; nobody can listen at the address. That the reader of standard output
/// has gone is no error.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (stop, stopped) = mpsc::channel();
    let mut what = arguments.source(&stop)?;
    arguments.check_line_carries(&what)?;
    let (mut line, name) = arguments.open_line()?;
    interrupt::watch(move || {
        // Nobody listens any more if it has just ended by itself.
        let _ = stop.send(());
    })
    .context("cannot watch for Ctrl-C")?;
    let clock = RealClock::new(stopped);
    let faults = Faults::new(arguments.faults.rates(), arguments.faults.seed);
    let mut session = match arguments.frame {
        FrameName::Bin => Session::new::<Bin>(clock, &mut line, faults),
        FrameName::BinCrc8 => Session::new::<BinCrc8>(clock, &mut line, faults),
    };
    let length = arguments.seconds.map(Duration::from_secs_f64);
    let outcome = session.run(what.source(), length, arguments.parking());
    let report = session.report();
    let datagrams = match &what {
        What::Datagrams(datagrams) => Some(datagrams.tally()),
        What::Motion(_) | What::Profile(_) => None,
    };
    // Nobody may be there to be told.
    let _ = told::write(
        &mut std::io::stderr().lock(),
        &report,
        &name,
        arguments.faults.seed,
        datagrams,
    );
    outcome.or_else(|error| Failure::Write(error).told("", &name))?;
    if let What::Datagrams(datagrams) = &what
        && let Some(failure) = datagrams.failure()
    {
        bail!("cannot hear datagrams any more: {failure}");
    }
    Ok(())
}

/// What is sent.
enum What {
    Motion(PacedMotion),
    Profile(Profile),
    Datagrams(Datagrams),
}

impl What {
    fn source(&mut self) -> &mut dyn Source {
        match self {
            Self::Motion(motion) => motion,
            Self::Profile(profile) => profile,
            Self::Datagrams(datagrams) => datagrams,
        }
    }
}

impl Arguments {
    fn rate(&self) -> Option<Rate> {
        self.rate.and_then(NonZeroU32::new).map(Rate)
    }

    fn source(&self, stop: &Sender<()>) -> Result<What> {
        let rate = self.rate().unwrap_or(USUAL_RATE);
        if let Some(path) = &self.profile {
            let input = Input::open(path, None)?;
            return Ok(What::Profile(Profile::read(
                input,
                self.rate(),
                USUAL_RATE,
            )?));
        }
        if let Some(address) = self.udp {
            let stale_after = Duration::from_millis(self.stale_after);
            let (datagrams, address) = Datagrams::listen(address, rate, stale_after, stop.clone())?;
            eprintln!("framelock: listening for datagrams at {address}");
            return Ok(What::Datagrams(datagrams));
        }
        let Some(name) = self.motion else {
            bail!("nothing to send: give --motion, --profile or --udp");
        };
        Ok(What::Motion(PacedMotion {
            motion: self.shape.motion(name),
            rate,
        }))
    }

    /// A serial port only: nobody knows how fast what is behind standard output is.
    fn check_line_carries(&self, what: &What) -> Result<()> {
        if self.line.as_os_str() == "-" {
            return Ok(());
        }
        let frame_length = self.frame.length();
        let baud = self.baud.unwrap_or(serial::DEFAULT_BAUD);
        let rate = match what {
            What::Profile(profile) => {
                profile.check_line_carries(line_rate::frame_time(frame_length, baud))?;
                // It parks at the usual rate.
                profile.rate().unwrap_or(USUAL_RATE)
            }
            What::Motion(_) | What::Datagrams(_) => self.rate().unwrap_or(USUAL_RATE),
        };
        line_rate::check(rate.0.get(), frame_length, baud)
    }

    fn open_line(&self) -> Result<(Box<dyn Write>, String)> {
        let path: &Path = &self.line;
        if path.as_os_str() == "-" {
            if self.baud.is_some() {
                bail!("--baud is for serial ports, and standard output is none: leave it out");
            }
            if std::io::stdout().is_terminal() {
                bail!(
                    "standard output is a terminal, and frames are binary: redirect it, or name \
                     a serial port"
                );
            }
            let output = standard::output().context("cannot open standard output")?;
            return Ok((Box::new(output), "standard output".to_owned()));
        }
        let name = path.display().to_string();
        if let Some(port) = serial::open_if_port(path, &name, self.baud)? {
            return Ok((Box::new(port), name));
        }
        if path.exists() {
            bail!(
                "{name} is no serial port: name one, or - for standard output; frames go to a \
                 file by `framelock encode`"
            );
        }
        bail!("there is no {name}: name a serial port, or - for standard output");
    }

    fn parking(&self) -> Option<Parking> {
        let End {
            park,
            park_seconds,
            no_park,
        } = self.end;
        (!no_park).then_some(Parking {
            at: park,
            seconds: park_seconds,
            rate: self.rate().unwrap_or(USUAL_RATE),
        })
    }
}

impl Shape {
    fn motion(&self, name: MotionName) -> Motion {
        Motion {
            name,
            amplitude: self.amplitude,
            period: self.period.unwrap_or(name.usual_period()),
            frequencies: [self.from, self.to],
            moves: [Axis::Pitch, Axis::Roll, Axis::Yaw].map(|axis| self.axes.contains(&axis)),
        }
    }
}

impl FaultArguments {
    fn rates(&self) -> FaultRates {
        FaultRates {
            drop: self.drop,
            flip: self.flip,
            duplicate: self.duplicate,
            insert: self.insert,
        }
    }
}

fn some_seconds(text: &str) -> Result<f64, String> {
    number(text, 0.001, 1e9)
}

fn park_seconds(text: &str) -> Result<f64, String> {
    number(text, 0.0, 3600.0)
}

fn frequency(text: &str) -> Result<f64, String> {
    number(text, 0.001, 1000.0)
}
