//! Serial ports: 8 data bits, no parity, 1 stop bit.

use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::time::Duration;

use anyhow::{Result, anyhow};

/// What most UARTs start at.
pub(crate) const DEFAULT_BAUD: u32 = 115_200;

/// How long a read or a write waits. A silent line is read again; a port that takes nothing for this
/// long has no reader at its other end.
const TIMEOUT: Duration = Duration::from_secs(1);

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
        _ => io::Error::other(format!(
            "the serial port is gone ({error}); connect it and start again"
        )),
    }
}

/// Opens `path` if it is a serial port.
pub(crate) fn open_if_port(path: &Path, baud: Option<u32>) -> Result<Option<Port>> {
    let Some(device) = device(path)? else {
        return Ok(None);
    };
    let name = path.to_string_lossy();
    let baud = baud.unwrap_or(DEFAULT_BAUD);
    let port = serialport::new(name.clone(), baud)
        .timeout(TIMEOUT)
        // Debug probes connect their UART only then. Linux does it by itself, Windows does not.
        .dtr_on_open(true)
        .open();
    let port = port.map_err(|error| {
        anyhow!(
            "cannot open the serial port {name} at {baud} baud: {error}; \
             is it connected, not in use elsewhere, and the rate one that it can do?"
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
    let device = open(path, flags, Mode::empty()).map_err(|error| {
        anyhow!("cannot open {name}: {error}; may this user? `ls -l {name}` shows its group")
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
