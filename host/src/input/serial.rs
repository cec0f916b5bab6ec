//! Serial ports: 8 data bits, no parity, 1 stop bit.

use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::time::Duration;

use anyhow::anyhow;

/// What most UARTs start at.
const DEFAULT_BAUD: u32 = 115_200;

/// How long a read waits. No matter how long: a silent line is read again.
const READ_TIMEOUT: Duration = Duration::from_secs(1);

/// An open serial port. It ends with an error only: a line has no end, but can be cut.
pub(super) struct Port(Box<dyn serialport::SerialPort>);

impl Read for Port {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let reason = match self.0.read(buffer) {
            Ok(0) => "end of file".to_owned(),
            Ok(count) => return Ok(count),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                return Err(error);
            }
            Err(error) => error.to_string(),
        };
        Err(io::Error::other(format!(
            "the serial port is gone ({reason}); connect it and start again"
        )))
    }
}

/// Opens `path` if it is a serial port.
pub(super) fn open_if_port(
    path: &Path,
    name: &str,
    baud: Option<u32>,
) -> anyhow::Result<Option<Port>> {
    if !is_port(path, name)? {
        return Ok(None);
    }
    let baud = baud.unwrap_or(DEFAULT_BAUD);
    let port = serialport::new(name, baud)
        .timeout(READ_TIMEOUT)
        .open()
        .map_err(|error| {
            anyhow!(
                "cannot open the serial port {name} at {baud} baud: {error}; \
                 is it connected, not in use elsewhere, and the rate one that it can do?"
            )
        })?;
    Ok(Some(Port(port)))
}

/// Whether `path` is a serial port: on Unix, a terminal device that is not the user's own terminal.
#[cfg(unix)]
fn is_port(path: &Path, name: &str) -> anyhow::Result<bool> {
    use std::fs::{File, Metadata};
    use std::io::IsTerminal;
    use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};

    let is_device = |data: Metadata| data.file_type().is_char_device();
    if !path.metadata().is_ok_and(is_device) {
        return Ok(false);
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
        return Ok(false);
    }
    if crate::standard::is_users_terminal(&file) {
        anyhow::bail!(
            "{name} is the terminal that you type at, no serial port; to type bytes, give -"
        );
    }
    Ok(true)
}

/// Whether `path` is a serial port: on Windows, `COM` and a number.
#[cfg(windows)]
fn is_port(path: &Path, _name: &str) -> anyhow::Result<bool> {
    let name = path.to_string_lossy().to_ascii_uppercase();
    let number = name.trim_start_matches(r"\\.\").strip_prefix("COM");
    Ok(number.is_some_and(|number| number.parse::<u16>().is_ok()))
}
