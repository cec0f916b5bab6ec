//! Serial ports: their settings, opening them, and opening them again after they disappeared.

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

/// The rate without `--baud`. Most firmware uses this rate.
const DEFAULT_BAUD: u32 = 115_200;

/// The longest time that a read or a write waits. A read that finds a silent line is repeated. If a port
/// accepts no byte for this long, nobody reads at its other end.
const TIMEOUT: Duration = Duration::from_secs(1);

/// The time between two attempts to find a port that disappeared.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// The advice for a port that this user has no permission to open.
pub(crate) const NO_PERMISSION: &str = "this user has no permission; on most Linux systems \
     `sudo usermod -aG dialout $USER` grants it from the next login on (on some, the group is uucp: see ls -l)";

/// The settings of a serial port. There are always 8 data bits.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct PortOptions {
    /// Set the serial port's baud rate [default: 115200]
    #[arg(long, value_name = "RATE", value_parser = baud)]
    baud: Option<u32>,
    /// Set the parity: none, even or odd [default: none]
    #[arg(long, value_name = "PARITY", value_parser = parity(), hide_possible_values = true)]
    parity: Option<Parity>,
    /// Set the number of stop bits: 1 or 2 [default: 1]. SBUS needs --baud 100000 --parity even
    /// --stop-bits 2
    #[arg(long, value_name = "COUNT", value_parser = |text: &str| whole::<u8>(text, 1, 2))]
    stop_bits: Option<u8>,
    /// Wait for the port if it does not exist yet
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

fn baud(text: &str) -> Result<u32> {
    whole(text, 1, u32::MAX.into())
        .map_err(|_| anyhow!("expected a rate in bits per second, for example 115200"))
}

impl PortOptions {
    /// Checks that no option is given for `name`, which is not a port.
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
                "{option} is for serial ports, and {name} is not one: leave {option} out, or name a port"
            )),
        }
    }

    pub(crate) fn baud(&self) -> u32 {
        self.baud.unwrap_or(DEFAULT_BAUD)
    }

    /// Returns the baud rate at which a byte in 8N1 takes the same time as a byte with these settings.
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

/// Writes the settings, such as `115200 baud` or `100000 baud 8E2`.
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

/// An open serial port. Reading it never reports the end of the stream. Reading ends only with an error,
/// for example when the port is unplugged.
pub(crate) struct Port {
    port: Box<dyn serialport::SerialPort>,
    pub(crate) device: Device,
}

/// The device of a port, for its settings.
#[cfg(unix)]
pub(crate) type Device = std::sync::Arc<std::fs::File>;
/// The device of a port. On Windows its settings are not needed.
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
                "the port accepts no more bytes; check that a program or board reads them at the other end",
            ),
            _ => gone(error),
        })
    }

    /// Waits until the last byte is on the line.
    fn flush(&mut self) -> io::Result<()> {
        self.port.flush()
    }
}

/// Replaces a permanent error by an error which says that the port is gone. Keeps temporary errors.
fn gone(error: io::Error) -> io::Error {
    match error.kind() {
        ErrorKind::TimedOut | ErrorKind::Interrupted => error,
        _ => io::Error::new(
            ErrorKind::NotConnected,
            format!("the serial port is gone ({error}); connect it again"),
        ),
    }
}

/// Returns whether the error means that the port is gone. The port may then come back.
pub(crate) fn is_gone(error: &io::Error) -> bool {
    error.kind() == ErrorKind::NotConnected
}

/// Waits until the port can be opened again, or until `is_stopped` returns true. Before this call, close the port that
/// is gone. As long as the old port is open, the operating system may give the returning port another name.
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

/// A port for writing that is opened again after it disappeared.
pub(crate) struct LastingPort<S> {
    pub(crate) path: PathBuf,
    pub(crate) options: PortOptions,
    pub(crate) port: Option<Port>,
    /// Returns true to stop waiting for the port.
    pub(crate) is_stopped: S,
}

impl<S: Fn() -> bool> Write for LastingPort<S> {
    /// Writes to the port. If the port is gone, waits until it is back. The bytes that were being written when the port
    /// disappeared are lost, like all bytes on the line. So the rest of a frame is never sent later.
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

/// Opens `path` if it is a serial port. With `--wait`, first waits until `path` exists.
pub(crate) fn open_or_wait(path: &Path, options: &PortOptions) -> Result<Option<Port>> {
    if options.wait && !is_there(path) {
        let name = path.display();
        note(&format!(
            "waiting for {name}; `framelock ports` lists the ports that exist"
        ));
        while !is_there(path) {
            std::thread::sleep(LOOK_EVERY);
        }
        // A port exists a moment before the system grants permission to open it.
        std::thread::sleep(LOOK_EVERY);
    }
    open_if_port(path, options)
}

#[cfg(unix)]
fn is_there(path: &Path) -> bool {
    path.exists()
}

/// Returns whether the port exists. On Windows a name belongs to a port only while the port exists.
#[cfg(windows)]
fn is_there(path: &Path) -> bool {
    let name = path.to_string_lossy();
    serialport::available_ports().is_ok_and(|ports| {
        let mut names = ports.iter().map(|port| &port.port_name);
        names.any(|port| port.eq_ignore_ascii_case(&name))
    })
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
        // Debug probes connect their UART only while DTR is set. Linux sets DTR by itself, but Windows does not.
        .dtr_on_open(true)
        .open()
        .map_err(|error| {
            anyhow!(
                "cannot open the serial port {name} at {options}: {error}; \
                 check that it is connected (`framelock ports` lists the ports that are), that no other program uses it, \
                 and that it supports this rate"
            )
        })?;
    Ok(Some(Port { port, device }))
}

/// Returns the device if `path` is a serial port. On Unix, a serial port is a terminal device that is
/// not the user's own terminal.
#[cfg(unix)]
fn device(path: &Path) -> Result<Option<Device>> {
    use rustix::fs::{FileType, Mode, OFlags, Stat, open, stat};
    use rustix::termios::{isatty, tcgetsid};

    let is_device = |stat: Stat| FileType::from_raw_mode(stat.st_mode) == FileType::CharacterDevice;
    if !stat(path).is_ok_and(is_device) {
        return Ok(None);
    }
    let name = path.display();
    // Do not wait for a modem's carrier, and do not make the port the terminal of this process.
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
    let device = open(path, flags, Mode::empty()).map_err(|error| match error {
        rustix::io::Errno::ACCESS => anyhow!("cannot open {name}: {NO_PERMISSION}"),
        _ => anyhow!("cannot open {name}: {error}"),
    })?;
    if !isatty(&device) {
        return Ok(None);
    }
    // The system reveals the session only for this process's own terminal.
    if tcgetsid(&device).is_ok() {
        anyhow::bail!(
            "{name} is the terminal that you type at, not a serial port; to type bytes, name - instead"
        );
    }
    Ok(Some(Device::new(device.into())))
}

/// Returns the device if `path` is a serial port. On Windows, a serial port is `COM` and a number.
#[cfg(windows)]
fn device(path: &Path) -> Result<Option<Device>> {
    let name = path.to_string_lossy().to_ascii_uppercase();
    let number = name.trim_start_matches(r"\\.\").strip_prefix("COM");
    Ok(number
        .is_some_and(|number| number.parse::<u16>().is_ok())
        .then_some(()))
}
