//! Lists the serial ports of this computer.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use framelock_description::text::harmless;
use serialport::{SerialPortInfo, SerialPortType};

use crate::output::{Output, note};
use crate::serial::NO_PERMISSION;

/// Runs `framelock ports`.
pub(crate) fn run() -> Result<()> {
    // The library panics on Linux if this folder is missing, as in some containers.
    let can_list = !cfg!(target_os = "linux") || Path::new("/sys/class/tty").is_dir();
    let mut ports = if can_list {
        serialport::available_ports().context("cannot list the serial ports")?
    } else {
        Vec::new()
    };
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
            let serial_number = match &usb.serial_number {
                Some(number) => format!(", serial number {number}"),
                None => String::new(),
            };
            let (vendor, product, names) = (usb.vid, usb.pid, names.join(" "));
            format!("USB {vendor:04x}:{product:04x}  {names}{serial_number}")
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
