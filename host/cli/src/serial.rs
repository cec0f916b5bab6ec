//! Serial ports: their settings, opening them, and listing them.

use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use framelock_description::text::harmless;
use serialport::{DataBits, Parity, SerialPortInfo, SerialPortType, StopBits};

use crate::options::whole;
use crate::output::{Output, note};

/// The rate without `--baud`. Most firmware uses this rate.
const DEFAULT_BAUD: u32 = 115_200;

/// The longest time that a read or a write waits. A read that finds a silent line is repeated. A write to a port that
/// accepts no byte fails. Then probably nobody reads at its other end.
const TIMEOUT: Duration = Duration::from_secs(1);

/// The time between two attempts to find a port that does not exist yet.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// The advice for a port that this user has no permission to open.
const NO_PERMISSION: &str = "this user has no permission; on most Linux systems \
     `sudo usermod -aG dialout $USER` grants it from the next login on (on some, the group is uucp: see ls -l)";

/// The settings of a serial port.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct PortOptions {
    /// Set the serial port's baud rate [default: 115200]
    #[arg(long, value_name = "RATE", value_parser = baud)]
    baud: Option<u32>,
    /// Set the parity: none, even or odd [default: none]
    #[arg(long, value_name = "PARITY", value_parser = parity(), hide_possible_values = true)]
    parity: Option<Parity>,
    /// Set the number of data bits: 7 or 8 [default: 8]
    #[arg(long, value_name = "COUNT", value_parser = |text: &str| whole::<u8>(text, 7, 8))]
    data_bits: Option<u8>,
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
    /// Checks that no option is given for `name`, which is not a port. `--data-bits` is allowed for recordings.
    pub(crate) fn check_none(&self, name: &str, is_recording: bool) -> Result<()> {
        let given = [
            ("--baud", self.baud.is_some()),
            ("--parity", self.parity.is_some()),
            ("--data-bits", self.data_bits.is_some() && !is_recording),
            ("--stop-bits", self.stop_bits.is_some()),
            ("--wait", self.wait),
        ];
        match given.iter().find(|(_, is_given)| *is_given) {
            None => Ok(()),
            Some((option, _)) => bail!(
                "{option} is for serial ports, and {name} is not one: leave {option} out, or name a port"
            ),
        }
    }

    /// Returns a mask with the data bits of a byte.
    pub(crate) fn data_mask(&self) -> u8 {
        0xFF >> (8 - self.data_bits())
    }

    pub(crate) fn baud(&self) -> u32 {
        self.baud.unwrap_or(DEFAULT_BAUD)
    }

    /// Returns the baud rate at which a byte in 8N1 takes the same time as a byte with these settings.
    pub(crate) fn usual_baud(&self) -> u32 {
        let bits = 1 + self.data_bits() + u8::from(self.has_parity()) + self.stop_bits();
        let baud = u64::from(self.baud()) * 10 / u64::from(bits);
        u32::try_from(baud).unwrap_or(u32::MAX).max(1)
    }

    fn data_bits(&self) -> u8 {
        self.data_bits.unwrap_or(8)
    }

    fn stop_bits(&self) -> u8 {
        self.stop_bits.unwrap_or(1)
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
        match (self.data_bits(), parity, self.stop_bits()) {
            (8, 'N', 1) => Ok(()),
            (data_bits, parity, stop_bits) => write!(f, " {data_bits}{parity}{stop_bits}"),
        }
    }
}

/// An open serial port. Reading it never reports the end of the stream. Reading ends only with an error,
/// for example when the port is unplugged.
pub(crate) struct Port(Box<dyn serialport::SerialPort>);

impl Read for Port {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.0.read(buffer) {
            Ok(0) => Err(gone(io::Error::other("end of file"))),
            outcome => outcome.map_err(gone),
        }
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes).map_err(|error| match error.kind() {
            ErrorKind::TimedOut => io::Error::new(
                ErrorKind::TimedOut,
                "the port accepts no more bytes; check that a program or board reads them at the other end",
            ),
            _ => gone(error),
        })
    }

    /// Waits until the last byte is on the line.
    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
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

/// Opens `path` if it is a serial port. With `--wait`, first waits until `path` exists.
pub(crate) fn open(path: &Path, options: &PortOptions) -> Result<Option<Port>> {
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
    // Keep the device open until the port is open. Otherwise the board would see the port opened twice.
    let Some(_device) = device(path)? else {
        return Ok(None);
    };
    let name = path.to_string_lossy();
    let port = serialport::new(name.clone(), options.baud())
        .data_bits(DataBits::try_from(options.data_bits()).unwrap_or(DataBits::Eight))
        .parity(options.parity())
        .stop_bits(StopBits::try_from(options.stop_bits()).unwrap_or(StopBits::One))
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
    Ok(Some(Port(port)))
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

/// Returns the open device if `path` is a serial port. On Unix, a serial port is a terminal device that is not the
/// user's own terminal.
#[cfg(unix)]
fn device(path: &Path) -> Result<Option<impl Sized>> {
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
        bail!(
            "{name} is the terminal that you type at, not a serial port; to type bytes, name - instead"
        );
    }
    Ok(Some(device))
}

/// Returns `Some` if `path` is a serial port. On Windows, a serial port is `COM` and a number.
#[cfg(windows)]
fn device(path: &Path) -> Result<Option<impl Sized>> {
    let name = path.to_string_lossy().to_ascii_uppercase();
    let number = name.trim_start_matches(r"\\.\").strip_prefix("COM");
    Ok(number.and_then(|number| number.parse::<u16>().ok()))
}

/// Runs `framelock ports`.
pub(crate) fn list() -> Result<()> {
    // The library panics on Linux if this folder is missing, as in some containers.
    let can_list = !cfg!(target_os = "linux") || Path::new("/sys/class/tty").is_dir();
    let ports = can_list.then(serialport::available_ports).transpose();
    let mut ports = ports
        .context("cannot list the serial ports")?
        .unwrap_or_default();
    ports.sort_by(|one, other| one.port_name.cmp(&other.port_name));
    if ports.is_empty() {
        note(
            "there is no serial port: check that the board is connected, that its cable carries data, \
             and that its driver is installed",
        );
    }
    let mut output = Output::standard()?;
    for port in &ports {
        writeln!(output, "{}", description(port))?;
    }
    if ports.iter().any(|port| is_forbidden(&port.port_name)) {
        note(&format!("some ports cannot be opened: {NO_PERMISSION}"));
    }
    Ok(())
}

/// Returns the port's name and the kind of its hardware.
fn description(port: &SerialPortInfo) -> String {
    let what = match &port.port_type {
        SerialPortType::UsbPort(usb) => {
            let names = [&usb.manufacturer, &usb.product].into_iter().flatten();
            let names: Vec<&str> = names.map(String::as_str).collect();
            let number = usb.serial_number.as_ref();
            let number = number.map(|number| format!(", serial number {number}"));
            let number = number.unwrap_or_default();
            let (vendor, product, names) = (usb.vid, usb.pid, names.join(" "));
            format!("USB {vendor:04x}:{product:04x}  {names}{number}")
        }
        SerialPortType::BluetoothPort => "Bluetooth".into(),
        SerialPortType::PciPort => "PCI".into(),
        SerialPortType::Unknown => "built in".into(),
    };
    // A device may send any text as its name.
    harmless(&format!("{:<14}  {what}", port.port_name))
}

#[cfg(unix)]
fn is_forbidden(path: &str) -> bool {
    use rustix::fs::{Access, access};
    access(path, Access::READ_OK | Access::WRITE_OK) == Err(rustix::io::Errno::ACCESS)
}

#[cfg(windows)]
fn is_forbidden(_: &str) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use serialport::UsbPortInfo;

    use super::*;

    #[test]
    fn a_port_is_shown_with_what_tells_it_from_others() {
        let usb = UsbPortInfo {
            vid: 0x0403,
            pid: 0x6001,
            serial_number: Some("A50285BI".into()),
            manufacturer: Some("FTDI".into()),
            product: Some("FT232R USB UART".into()),
        };
        let nameless = UsbPortInfo {
            serial_number: None,
            manufacturer: None,
            product: Some("J-\x1BLink".into()),
            ..usb.clone()
        };
        for (port_type, expected) in [
            (
                SerialPortType::UsbPort(usb),
                "/dev/ttyUSB0    USB 0403:6001  FTDI FT232R USB UART, serial number A50285BI",
            ),
            (
                SerialPortType::UsbPort(nameless),
                "/dev/ttyUSB0    USB 0403:6001  J-\\x1BLink",
            ),
            (SerialPortType::Unknown, "/dev/ttyUSB0    built in"),
        ] {
            let port_name = "/dev/ttyUSB0".into();
            let port = SerialPortInfo {
                port_name,
                port_type,
            };
            assert_eq!(description(&port), expected);
        }
    }
}
