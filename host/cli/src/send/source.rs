//! The frames to send: a built-in motion, the rows of a profile, or setpoints from UDP datagrams of motion software.

use std::net::{SocketAddr, UdpSocket};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use framelock::motion::Setpoint;
use framelock_receiving::Protocol;
use framelock_simulation::Motion;

use crate::input::Input;
use crate::options;
use crate::output::{lock, note};
use crate::rows::rows;

/// A source of frames.
pub(super) enum Source {
    Motion(Motion),
    /// The frames of a profile.
    Profile(Vec<Vec<u8>>),
    Datagrams(Datagrams),
}

impl Source {
    /// Reads the rows of `input` to its end, so that no frame of an invalid profile is sent.
    pub(super) fn profile(input: Input, frame: &Protocol) -> Result<Self> {
        let name = input.name.clone();
        let frames: Vec<Vec<u8>> = rows(input, frame)?.collect::<Result<_>>()?;
        if frames.is_empty() {
            bail!("{name} has no rows: give a row for each frame, such as 127,200,74");
        }
        Ok(Self::Profile(frames))
    }

    /// Returns whether the source has no frame with this number or a higher one.
    pub(super) fn is_over(&self, number: u64) -> bool {
        match self {
            Self::Motion(_) => false,
            Self::Datagrams(datagrams) => datagrams.received().failure.is_some(),
            Self::Profile(frames) => number >= frames.len() as u64,
        }
    }

    /// Returns the frame that is due at this time, or `None` if nothing is to be sent.
    pub(super) fn frame(&self, number: u64, due: Duration, protocol: &Protocol) -> Option<Vec<u8>> {
        let setpoint = match self {
            Self::Motion(motion) => motion.at(due),
            Self::Profile(frames) => return frames.get(usize::try_from(number).ok()?).cloned(),
            Self::Datagrams(datagrams) => datagrams.setpoint()?,
        };
        Some(protocol.encode_setpoint(setpoint))
    }
}

/// The latest setpoint with the time of its arrival, and the numbers of all datagrams and of bad ones.
#[derive(Clone, Debug, Default)]
pub(super) struct Received {
    latest: Option<(Setpoint, Instant)>,
    pub(super) count: u64,
    pub(super) bad: u64,
    /// The error that ended reception.
    pub(super) failure: Option<String>,
}

/// Listens for datagrams.
#[derive(Clone, Default)]
pub(super) struct Datagrams {
    received: Arc<Mutex<Received>>,
    stale_after: Duration,
}

impl Datagrams {
    /// Listens at `address`. Prints the address, because the operating system may choose the port.
    pub(super) fn listen(address: SocketAddr, stale_after: Duration) -> Result<Self> {
        let socket = UdpSocket::bind(address)
            .with_context(|| format!("cannot listen for datagrams at {address}"))?;
        let address = socket.local_addr().unwrap_or(address);
        note(&format!("listening for datagrams at {address}"));
        let datagrams = Self {
            received: Arc::default(),
            stale_after,
        };
        let listener = datagrams.clone();
        // This thread ends with the process.
        thread::spawn(move || {
            let failure = listener.receive(&socket).to_string();
            lock(&listener.received).failure = Some(failure);
        });
        Ok(datagrams)
    }

    /// Returns a copy of the counts and the latest setpoint.
    pub(super) fn received(&self) -> Received {
        lock(&self.received).clone()
    }

    /// Returns the latest setpoint, or `None` if it is stale or none has arrived. Then the board's failsafe takes over.
    pub(super) fn setpoint(&self) -> Option<Setpoint> {
        let latest = lock(&self.received).latest;
        latest.and_then(|(setpoint, at)| (at.elapsed() < self.stale_after).then_some(setpoint))
    }

    /// Receives datagrams until the socket fails, and returns the error.
    fn receive(&self, socket: &UdpSocket) -> std::io::Error {
        // The buffer has room for any datagram, so that none is cut.
        let mut buffer = vec![0; 1 << 16];
        loop {
            let (length, sender) = match socket.recv_from(&mut buffer) {
                Ok(received) => received,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(error) => return error,
            };
            let at = Instant::now();
            let outcome = parse(&buffer[..length]);
            let mut received = lock(&self.received);
            received.count += 1;
            match outcome {
                Ok(setpoint) => received.latest = Some((setpoint, at)),
                Err(problem) => {
                    received.bad += 1;
                    if received.bad == 1 {
                        note(&format!(
                            "a bad datagram from {sender}: {problem:#}; further bad ones are only counted"
                        ));
                    }
                }
            }
        }
    }
}

/// Parses a datagram: three bytes, or text.
fn parse(datagram: &[u8]) -> Result<Setpoint> {
    if let &[pitch, roll, yaw] = datagram {
        return Ok(Setpoint { pitch, roll, yaw });
    }
    // Some programs also send the zero byte at the end of a string.
    let text = String::from_utf8_lossy(datagram);
    options::setpoint(text.trim_end_matches('\0').trim())
        .context("it is neither three bytes nor text such as 127,200,74")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    #[test]
    fn each_form_of_datagram_is_parsed_and_a_bad_one_is_reported_with_the_reason() {
        let setpoint = Setpoint::from([127, 200, 74]);
        for (datagram, outcome) in [
            (&b"\x7F\xC8\x4A"[..], Ok(setpoint)),
            (b"127,200,74", Ok(setpoint)),
            (b" 127 , 200 ,74\r\n", Ok(setpoint)),
            (b"127,200,74\n\0", Ok(setpoint)),
            // Three bytes are always taken as bytes, even if they look like text.
            (b"1,2", Ok(Setpoint::from(*b"1,2"))),
            (b"", Err("neither three bytes")),
            (b"1,2,3,4", Err("neither three bytes")),
            (
                b"1,2,256",
                Err("yaw \"256\" is not a whole number from 0 to 255"),
            ),
            (b"-1,2,3", Err("pitch \"-1\"")),
            (b"1,2.5,3", Err("roll \"2.5\"")),
        ] {
            match (parse(datagram), outcome) {
                (Err(problem), Err(reason)) => {
                    let problem = format!("{problem:#}");
                    assert!(problem.contains(reason), "{problem}");
                }
                (parsed, outcome) => assert_eq!(parsed.ok(), outcome.ok(), "{datagram:?}"),
            }
        }
    }

    #[test]
    fn a_stale_datagram_is_not_sent_any_more() {
        let setpoint = Setpoint::from([1, 2, 3]);
        for (seconds, expected) in [(3_600, Some(setpoint)), (0, None)] {
            let datagrams = Datagrams {
                stale_after: Duration::from_secs(seconds),
                ..Datagrams::default()
            };
            assert_eq!(datagrams.setpoint(), None);
            lock(&datagrams.received).latest = Some((setpoint, Instant::now()));
            assert_eq!(datagrams.setpoint(), expected);
        }
    }
}
