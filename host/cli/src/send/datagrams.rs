//! Receives setpoints from UDP datagrams, as motion software sends them.

use std::net::{SocketAddr, UdpSocket};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, bail};
use framelock::Receiver;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock_receiving::Protocol;

use super::pacer::Rate;
use super::transmission::Source;
use crate::options;
use crate::output::note;

/// The limit on the length of a datagram. No valid datagram is longer.
const LONGEST: usize = 512;

/// The datagrams that were received.
#[derive(Clone, Debug, Default)]
pub(super) struct Heard {
    latest: Option<(Setpoint, Instant)>,
    pub(super) count: u64,
    pub(super) bad: u64,
    /// The error that ended reception.
    pub(super) failure: Option<String>,
}

/// Listens for datagrams.
#[derive(Clone)]
pub(super) struct Datagrams(Arc<Mutex<Heard>>);

impl Datagrams {
    /// Listens at `address`. Prints the address, because the operating system may choose the port.
    pub(super) fn listen(address: SocketAddr) -> Result<Self> {
        let socket = UdpSocket::bind(address)
            .with_context(|| format!("cannot listen for datagrams at {address}"))?;
        let address = socket.local_addr().unwrap_or(address);
        note(&format!("listening for datagrams at {address}"));
        let datagrams = Self(Arc::default());
        let to_fill = datagrams.clone();
        // This thread ends with the process.
        thread::spawn(move || {
            let failure = to_fill.hear(&socket).to_string();
            to_fill.lock().failure = Some(failure);
        });
        Ok(datagrams)
    }

    /// Returns a copy of the counts and the latest setpoint.
    pub(super) fn heard(&self) -> Heard {
        self.lock().clone()
    }

    /// Returns a source that sends the latest setpoint at a rate, until the socket fails. It sends nothing
    /// while the latest setpoint is older than `stale_after`, so that the board's failsafe takes over.
    pub(super) fn source(&self, frame: Protocol, rate: Rate, stale_after: Duration) -> Source {
        let (listening, heard) = (self.clone(), self.clone());
        let is_listening = move |_: &Duration| listening.lock().failure.is_none();
        Source {
            dues: Box::new(rate.dues().take_while(is_listening)),
            frame: Box::new(move |_| {
                let setpoint = heard.lock().setpoint_at(Instant::now(), stale_after)?;
                Some(frame.encode_setpoint(setpoint))
            }),
        }
    }

    /// Locks the state, even after a panic of another thread, since the state is always valid.
    fn lock(&self) -> MutexGuard<'_, Heard> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Receives datagrams until the socket fails, and returns the error.
    fn hear(&self, socket: &UdpSocket) -> std::io::Error {
        // The buffer has room for any datagram, so that none is cut.
        let mut buffer = vec![0; 1 << 16];
        loop {
            let (length, sender) = match socket.recv_from(&mut buffer) {
                Ok(received) => received,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(error) => return error,
            };
            let came = Instant::now();
            let outcome = parse(&buffer[..length]);
            let mut heard = self.lock();
            heard.count += 1;
            match outcome {
                Ok(setpoint) => heard.latest = Some((setpoint, came)),
                Err(problem) => {
                    heard.bad += 1;
                    if heard.bad == 1 {
                        note(&format!(
                            "a bad datagram from {sender}: {problem}; further bad ones are only counted"
                        ));
                    }
                }
            }
        }
    }
}

impl Heard {
    fn setpoint_at(&self, now: Instant, stale_after: Duration) -> Option<Setpoint> {
        let (setpoint, came) = self.latest?;
        (now.saturating_duration_since(came) < stale_after).then_some(setpoint)
    }
}

/// Parses a datagram: three bytes, a frame, or text.
fn parse(datagram: &[u8]) -> Result<Setpoint> {
    if datagram.len() > LONGEST {
        bail!("it is longer than {LONGEST} bytes");
    }
    if let &[pitch, roll, yaw] = datagram {
        return Ok(Setpoint { pitch, roll, yaw });
    }
    let (mut bin, mut bin_crc8) = (Receiver::<Bin>::new(), Receiver::<BinCrc8>::new());
    let mut bytes = datagram.iter();
    let frame = match datagram.len() {
        7 => bytes.find_map(|&byte| bin.push(byte)),
        8 => bytes.find_map(|&byte| bin_crc8.push(byte)),
        _ => None,
    };
    // Some programs also send the zero byte at the end of a string.
    let text = String::from_utf8_lossy(datagram);
    let text = || options::setpoint(text.trim_end_matches('\0').trim());
    frame
        .map_or_else(text, Ok)
        .map_err(|problem| anyhow!("it is neither three bytes nor a frame, and {problem}"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use framelock::Encode;

    use super::*;

    #[test]
    fn each_form_of_datagram_is_parsed_and_a_bad_one_is_reported_with_the_reason() {
        let setpoint = Setpoint::from([127, 200, 74]);
        let mut broken_check = BinCrc8::encode(setpoint);
        broken_check[6] ^= 1;
        for (datagram, outcome) in [
            (&b"\x7F\xC8\x4A"[..], Ok(setpoint)),
            (b"127,200,74", Ok(setpoint)),
            (b" 127 , 200 ,74\r\n", Ok(setpoint)),
            (b"127,200,74\n\0", Ok(setpoint)),
            (&Bin::encode(setpoint), Ok(setpoint)),
            (&BinCrc8::encode(setpoint), Ok(setpoint)),
            // Three bytes are always taken as bytes, even if they look like text.
            (b"1,2", Ok(Setpoint::from(*b"1,2"))),
            (b"", Err("neither three bytes")),
            (b"1,2,3,4", Err("neither three bytes")),
            (b"AB\0\x01\x02\x03\x04", Err("neither three bytes")),
            (&broken_check, Err("neither three bytes")),
            (
                b"1,2,256",
                Err("yaw \"256\" is not a whole number from 0 to 255"),
            ),
            (b"-1,2,3", Err("pitch \"-1\"")),
            (b"1,2.5,3", Err("roll \"2.5\"")),
            (&[b'0'; 600], Err("longer than 512 bytes")),
        ] {
            match (parse(datagram), outcome) {
                (Err(problem), Err(reason)) => {
                    assert!(problem.to_string().contains(reason), "{problem}");
                }
                (parsed, outcome) => assert_eq!(parsed.ok(), outcome.ok(), "{datagram:?}"),
            }
        }
    }

    #[test]
    fn a_stale_datagram_is_not_sent_any_more() {
        let (came, ms) = (Instant::now(), Duration::from_millis);
        let setpoint = Setpoint::from([1, 2, 3]);
        let mut heard = Heard::default();
        assert_eq!(heard.setpoint_at(came, ms(200)), None);
        heard.latest = Some((setpoint, came));
        for (age, expected) in [(0, Some(setpoint)), (199, Some(setpoint)), (200, None)] {
            assert_eq!(heard.setpoint_at(came + ms(age), ms(200)), expected);
        }
    }
}
