//! Serial ports: 8 data bits, no parity, 1 stop bit.

use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::time::Duration;

use anyhow::anyhow;

/// What most UARTs start at.
pub(crate) const DEFAULT_BAUD: u32 = 115_200;

/// How long a read or a write waits. No matter how long a read does: a silent line is read again.
/// That a port takes nothing for so long means that nobody listens.
const TIMEOUT: Duration = Duration::from_secs(1);

/// An open serial port. It ends with an error only: a line has no end, but can be cut.
pub(crate) struct Port {
    port: Box<dyn serialport::SerialPort>,
    device: Device,
}

/// The device that a port is, for its settings.
#[cfg(unix)]
pub(crate) type Device = std::sync::Arc<std::fs::File>;
/// The device that a port is: elsewhere it has no settings of use.
#[cfg(windows)]
pub(crate) type Device = ();

impl Port {
    pub(crate) fn device(&self) -> Device {
        self.device.clone()
    }
}

impl Read for Port {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.port.read(buffer) {
            Ok(0) => Err(gone("end of file")),
            Err(error) if !passes(&error) => Err(gone(&error.to_string())),
            outcome => outcome,
        }
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.port.write(bytes) {
            Err(error) if error.kind() == ErrorKind::TimedOut => Err(io::Error::new(
                ErrorKind::TimedOut,
                "it takes no more bytes; does nobody read them at the other end?",
            )),
            Err(error) if !passes(&error) => Err(gone(&error.to_string())),
            outcome => outcome,
        }
    }

    /// Waits until the last byte is on the line.
    fn flush(&mut self) -> io::Result<()> {
        self.port.flush()
    }
}

/// Whether it may be tried again.
fn passes(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted)
}

fn gone(reason: &str) -> io::Error {
    io::Error::other(format!(
        "the serial port is gone ({reason}); connect it and start again"
    ))
}

/// Opens `path` if it is a serial port.
pub(crate) fn open_if_port(
    path: &Path,
    name: &str,
    baud: Option<u32>,
) -> anyhow::Result<Option<Port>> {
    let Some(device) = device(path, name)? else {
        return Ok(None);
    };
    let baud = baud.unwrap_or(DEFAULT_BAUD);
    let port = serialport::new(name, baud)
        .timeout(TIMEOUT)
        .open()
        .map_err(|error| {
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
fn device(path: &Path, name: &str) -> anyhow::Result<Option<Device>> {
    use std::fs::{File, Metadata};
    use std::io::IsTerminal;
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};

    let is_device = |data: Metadata| data.file_type().is_char_device();
    if !path.metadata().is_ok_and(is_device) {
        return Ok(None);
    }
    // Neither wait for a modem's carrier, nor let the port become the terminal of this process.
    let file = File::options()
        .read(true)
        .custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY)
        .open(path)
        .map_err(|error| {
            anyhow!("cannot open {name}: {error}; may this user? `ls -l {name}` shows its group")
        })?;
    if !file.is_terminal() {
        return Ok(None);
    }
    if crate::standard::is_users_terminal(&file) {
        anyhow::bail!(
            "{name} is the terminal that you type at, no serial port; to type bytes, give -"
        );
    }
    Ok(Some(Device::new(file)))
}

/// The device, if `path` is a serial port: on Windows, `COM` and a number.
#[cfg(windows)]
fn device(path: &Path, _name: &str) -> anyhow::Result<Option<Device>> {
    let name = path.to_string_lossy().to_ascii_uppercase();
    let number = name.trim_start_matches(r"\\.\").strip_prefix("COM");
    Ok(number
        .is_some_and(|number| number.parse::<u16>().is_ok())
        .then_some(()))
}
