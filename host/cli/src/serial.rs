//! Serial ports: how they are set, opened, and opened again when they come back.

use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Result, anyhow};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serialport::{Parity, StopBits};

use crate::options::whole;
use crate::output::note;
use crate::process::time_of_day;

/// What most UARTs start at.
const DEFAULT_BAUD: u32 = 115_200;

/// How long a read or a write waits. A silent line is read again; a port that takes nothing for this
/// long has no reader at its other end.
const TIMEOUT: Duration = Duration::from_secs(1);

/// How often a port that is gone is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// What to do where a port may not be opened.
pub(crate) const NO_PERMISSION: &str = "this user may not; on most Linux systems \
     `sudo usermod -aG dialout $USER` allows it from the next login on (or the group uucp: see ls -l)";

/// How a serial port is set. There are always 8 data bits.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct PortOptions {
    /// The serial port's rate [default: 115200]
    #[arg(long, value_name = "RATE", value_parser = baud)]
    baud: Option<u32>,
    /// Its parity bit: none, even or odd [default: none]
    #[arg(long, value_name = "PARITY", value_parser = parity(), hide_possible_values = true)]
    parity: Option<Parity>,
    /// Its stop bits: 1 or 2 [default: 1]. SBUS has even parity and 2, at 100000
    #[arg(long, value_name = "COUNT", value_parser = |text: &str| whole::<u8>(text, 1, 2))]
    stop_bits: Option<u8>,
    /// Wait for a port that is not there yet
    #[arg(long)]
    wait: bool,
}

fn parity() -> impl TypedValueParser<Value = Parity> {
    PossibleValuesParser::new(["none", "even", "odd"]).map(|name| match name.as_str() {
        "even" => Parity::Even,
        "odd" => Parity::Odd,
        _ => Parity::None,
    })
}

fn baud(text: &str) -> Result<u32, String> {
    whole(text, 1, u32::MAX.into())
        .map_err(|_| "a rate in bits per second is wanted, for example 115200".into())
}

impl PortOptions {
    /// That none is given where `name` is no port.
    pub(crate) fn check_none(&self, name: &str) -> Result<()> {
        let given = [
            ("--baud", self.baud.is_some()),
            ("--parity", self.parity.is_some()),
            ("--stop-bits", self.stop_bits.is_some()),
            ("--wait", self.wait),
        ];
        match given.iter().find(|(_, is_given)| *is_given) {
            None => Ok(()),
            Some((option, _)) => Err(anyhow!(
                "{option} is for serial ports, and {name} is none: leave it out, or name a port"
            )),
        }
    }

    pub(crate) fn baud(&self) -> u32 {
        self.baud.unwrap_or(DEFAULT_BAUD)
    }

    /// The rate at which bytes without parity and with one stop bit take as long as these.
    pub(crate) fn usual_baud(&self) -> u32 {
        let more = u64::from(self.has_parity()) + u64::from(self.stop_bits == Some(2));
        let baud = u64::from(self.baud()) * 10 / (10 + more);
        u32::try_from(baud).unwrap_or(u32::MAX).max(1)
    }

    fn parity(&self) -> Parity {
        self.parity.unwrap_or(Parity::None)
    }

    pub(crate) fn has_parity(&self) -> bool {
        self.parity() != Parity::None
    }
}

/// As `115200 baud`, or `100000 baud 8E2`.
impl fmt::Display for PortOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} baud", self.baud())?;
        let parity = match self.parity() {
            Parity::None => 'N',
            Parity::Even => 'E',
            Parity::Odd => 'O',
        };
        match (parity, self.stop_bits.unwrap_or(1)) {
            ('N', 1) => Ok(()),
            (parity, stop_bits) => write!(f, " 8{parity}{stop_bits}"),
        }
    }
}

/// An open serial port. It ends with an error only: a line has no end, but can be cut.
pub(crate) struct Port {
    port: Box<dyn serialport::SerialPort>,
    pub(crate) device: Device,
}

/// The device that a port is, for its settings.
#[cfg(unix)]
pub(crate) type Device = std::sync::Arc<std::fs::File>;
/// The device that a port is: elsewhere it has no settings of use.
#[cfg(windows)]
pub(crate) type Device = ();

impl Read for Port {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.port.read(buffer) {
            Ok(0) => Err(gone(io::Error::other("end of file"))),
            outcome => outcome.map_err(gone),
        }
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.port.write(bytes).map_err(|error| match error.kind() {
            ErrorKind::TimedOut => io::Error::new(
                ErrorKind::TimedOut,
                "it takes no more bytes; does nobody read them at the other end?",
            ),
            _ => gone(error),
        })
    }

    /// Waits until the last byte is on the line.
    fn flush(&mut self) -> io::Result<()> {
        self.port.flush()
    }
}

/// What an error means, unless it passes.
fn gone(error: io::Error) -> io::Error {
    match error.kind() {
        ErrorKind::TimedOut | ErrorKind::Interrupted => error,
        _ => io::Error::new(
            ErrorKind::NotConnected,
            format!("the serial port is gone ({error}); connect it again"),
        ),
    }
}

/// Whether an error is that the port is gone: then it may come back.
pub(crate) fn is_gone(error: &io::Error) -> bool {
    error.kind() == ErrorKind::NotConnected
}

/// Waits until the port can be opened again, or there is a reason to stop. The one that is gone must be
/// closed by then: as long as it is open, its name may not be used again.
pub(crate) fn reopen(
    path: &Path,
    options: &PortOptions,
    is_stopped: impl Fn() -> bool,
) -> Option<Port> {
    while !is_stopped() {
        std::thread::sleep(LOOK_EVERY);
        if let Ok(Some(port)) = open_if_port(path, options) {
            return Some(port);
        }
    }
    None
}

/// A port to write to that is opened again when it is gone.
pub(crate) struct LastingPort<S> {
    pub(crate) path: PathBuf,
    pub(crate) options: PortOptions,
    pub(crate) port: Option<Port>,
    /// A reason to wait for it no longer.
    pub(crate) is_stopped: S,
}

impl<S: Fn() -> bool> Write for LastingPort<S> {
    /// What was being written when the port went is lost, as everything on the line was: half a frame
    /// is not sent later.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let port = self.port.as_mut().ok_or(ErrorKind::NotConnected)?;
        let error = match port.write(bytes) {
            Err(error) if is_gone(&error) => error,
            outcome => return outcome,
        };
        self.port = None;
        let path = self.path.display();
        note(&format!(
            "{}: {path}: {error}; waiting for it",
            time_of_day()
        ));
        self.port = reopen(&self.path, &self.options, &self.is_stopped);
        if self.port.is_none() {
            return Err(error);
        }
        note(&format!("{}: {path} is back", time_of_day()));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.port.as_mut().map_or(Ok(()), Write::flush)
    }
}

/// Opens `path` if it is a serial port; if it is not there yet, and that is asked for, as soon as it is.
pub(crate) fn open_or_wait(path: &Path, options: &PortOptions) -> Result<Option<Port>> {
    if options.wait && !is_there(path) {
        let name = path.display();
        note(&format!(
            "waiting for {name}; `framelock ports` lists those that are there"
        ));
        while !is_there(path) {
            std::thread::sleep(LOOK_EVERY);
        }
        // It is there before the system has said who may open it.
        std::thread::sleep(LOOK_EVERY);
    }
    open_if_port(path, options)
}

#[cfg(unix)]
fn is_there(path: &Path) -> bool {
    path.exists()
}

/// A name means a port only while there is one.
#[cfg(windows)]
fn is_there(path: &Path) -> bool {
    let name = path.to_string_lossy();
    let ports = serialport::available_ports().unwrap_or_default();
    ports
        .iter()
        .any(|port| port.port_name.eq_ignore_ascii_case(&name))
}

/// Opens `path` if it is a serial port.
pub(crate) fn open_if_port(path: &Path, options: &PortOptions) -> Result<Option<Port>> {
    let Some(device) = device(path)? else {
        return Ok(None);
    };
    let name = path.to_string_lossy();
    let port = serialport::new(name.clone(), options.baud())
        .parity(options.parity())
        .stop_bits(match options.stop_bits {
            Some(2) => StopBits::Two,
            _ => StopBits::One,
        })
        .timeout(TIMEOUT)
        // Debug probes connect their UART only then. Linux does it by itself, Windows does not.
        .dtr_on_open(true)
        .open();
    let port = port.map_err(|error| {
        anyhow!(
            "cannot open the serial port {name} at {options}: {error}; \
             is it connected (`framelock ports` lists those that are), not in use elsewhere, and the rate one that it \
             can do?"
        )
    })?;
    Ok(Some(Port { port, device }))
}

/// The device, if `path` is a serial port: on Unix, a terminal device that is not the user's own
/// terminal.
#[cfg(unix)]
fn device(path: &Path) -> Result<Option<Device>> {
    use rustix::fs::{FileType, Mode, OFlags, Stat, open, stat};
    use rustix::termios::{isatty, tcgetsid};

    let is_device = |stat: Stat| FileType::from_raw_mode(stat.st_mode) == FileType::CharacterDevice;
    if !stat(path).is_ok_and(is_device) {
        return Ok(None);
    }
    let name = path.display();
    // Neither wait for a modem's carrier, nor let the port become the terminal of this process.
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    let device = open(path, flags, Mode::empty()).map_err(|error| match error {
        rustix::io::Errno::ACCESS => anyhow!("cannot open {name}: {NO_PERMISSION}"),
        _ => anyhow!("cannot open {name}: {error}"),
    })?;
    if !isatty(&device) {
        return Ok(None);
    }
    // Of others' terminals this process is not told.
    if tcgetsid(&device).is_ok() {
        anyhow::bail!(
            "{name} is the terminal that you type at, no serial port; to type bytes, give -"
        );
    }
    Ok(Some(Device::new(device.into())))
}

/// The device, if `path` is a serial port: on Windows, `COM` and a number.
#[cfg(windows)]
fn device(path: &Path) -> Result<Option<Device>> {
    let name = path.to_string_lossy().to_ascii_uppercase();
    let number = name.trim_start_matches(r"\\.\").strip_prefix("COM");
    Ok(number
        .is_some_and(|number| number.parse::<u16>().is_ok())
        .then_some(()))
}
