//! Setpoints from UDP datagrams, as motion software sends them.

use std::io::Write;
use std::net::{SocketAddr, UdpSocket};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use framelock::{Bin, BinCrc8, Parser, Receiver, Setpoint};

use super::source::{Rate, Source};
use crate::setpoints;

/// Longer than any datagram that means something.
const LONGEST: usize = 512;

/// What has been heard.
#[derive(Debug, Default)]
struct Heard {
    latest: Option<(Setpoint, Instant)>,
    count: u64,
    bad: u64,
    /// Why nothing more is heard.
    failure: Option<String>,
}

/// The latest datagram's setpoint, at a rate, as long as it is not stale.
pub(super) struct Datagrams {
    heard: Arc<Mutex<Heard>>,
    rate: Rate,
    /// How long a datagram is good for: then nothing is sent, so that the board's failsafe sees the
    /// silence that there is.
    stale_after: Duration,
}

/// How many datagrams came, and how many of them were bad.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct DatagramTally {
    pub(super) count: u64,
    pub(super) bad: u64,
}

impl Datagrams {
    /// Listens at `address` from now on; should that fail later, sends to `stop`. Also gives the
    /// address with the port that the operating system chose, if it is asked to.
    pub(super) fn listen(
        address: SocketAddr,
        rate: Rate,
        stale_after: Duration,
        stop: Sender<()>,
    ) -> Result<(Self, SocketAddr)> {
        let socket = UdpSocket::bind(address)
            .with_context(|| format!("cannot listen for datagrams at {address}"))?;
        let address = socket.local_addr().unwrap_or(address);
        let heard = Arc::new(Mutex::new(Heard::default()));
        let to_fill = Arc::clone(&heard);
        // It ends with the process.
        thread::spawn(move || {
            let failure = hear(&socket, &to_fill);
            lock(&to_fill).failure = Some(failure);
            let _ = stop.send(());
        });
        let datagrams = Self {
            heard,
            rate,
            stale_after,
        };
        Ok((datagrams, address))
    }

    pub(super) fn tally(&self) -> DatagramTally {
        let Heard { count, bad, .. } = *lock(&self.heard);
        DatagramTally { count, bad }
    }

    /// Why it heard nothing more, if it stopped by itself.
    pub(super) fn failure(&self) -> Option<String> {
        lock(&self.heard).failure.clone()
    }

    fn setpoint_at(&self, now: Instant) -> Option<Setpoint> {
        let (setpoint, came) = lock(&self.heard).latest?;
        (now.saturating_duration_since(came) < self.stale_after).then_some(setpoint)
    }
}

impl Source for Datagrams {
    fn due(&mut self, number: u64) -> Option<Duration> {
        Some(self.rate.due(number))
    }

    fn setpoint(&mut self, _number: u64, _due: Duration) -> Option<Setpoint> {
        self.setpoint_at(Instant::now())
    }
}

/// What is in there is whole whoever panicked.
fn lock(heard: &Mutex<Heard>) -> MutexGuard<'_, Heard> {
    heard.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes datagrams until the socket fails; gives the reason.
fn hear(socket: &UdpSocket, heard: &Mutex<Heard>) -> String {
    // Room for any: a longer one is never taken for one that ends there.
    let mut buffer = vec![0; 1 << 16];
    loop {
        let (length, sender) = match socket.recv_from(&mut buffer) {
            Ok(received) => received,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(error) => return error.to_string(),
        };
        let came = Instant::now();
        let outcome = parse(buffer.get(..length).unwrap_or_default());
        let mut heard = lock(heard);
        heard.count += 1;
        match outcome {
            Ok(setpoint) => heard.latest = Some((setpoint, came)),
            Err(problem) => {
                heard.bad += 1;
                if heard.bad == 1 {
                    let told = format!(
                        "framelock: a bad datagram from {sender}: {problem}; further bad ones are \
                         only counted\n"
                    );
                    // Nobody may be there to be told.
                    let _ = std::io::stderr().write_all(told.as_bytes());
                }
            }
        }
    }
}

/// The setpoint of a datagram: three bytes, a frame, or text.
fn parse(datagram: &[u8]) -> Result<Setpoint, String> {
    if datagram.len() > LONGEST {
        return Err(format!("it is longer than {LONGEST} bytes"));
    }
    if let &[pitch, roll, yaw] = datagram {
        return Ok(Setpoint { pitch, roll, yaw });
    }
    let frame = frame::<Receiver<Bin>>(datagram).or_else(|| frame::<Receiver<BinCrc8>>(datagram));
    frame.map_or_else(|| text(datagram), Ok)
}

/// The setpoint of exactly one frame.
fn frame<P: Parser<Message = Setpoint> + Default>(datagram: &[u8]) -> Option<Setpoint> {
    if datagram.len() != P::FRAME_LENGTH {
        return None;
    }
    let mut found = None;
    P::default().feed(datagram, &mut |_, setpoint| found = Some(setpoint));
    found
}

/// `pitch,roll,yaw`, each a whole number.
fn text(datagram: &[u8]) -> Result<Setpoint, String> {
    let text = String::from_utf8_lossy(datagram);
    // Some programs send the end of their string too.
    setpoints::parse(text.trim_end_matches('\0').trim())
        .map_err(|problem| format!("it is neither three bytes nor a frame, and {problem}"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use std::num::NonZeroU32;

    use framelock::Format;

    use super::*;

    #[test]
    fn each_form_of_datagram_is_read() {
        let setpoint = Setpoint::from([127, 200, 74]);
        for datagram in [
            &b"\x7F\xC8\x4A"[..],
            b"127,200,74",
            b" 127 , 200 ,74\r\n",
            b"127,200,74\n\0",
            &Bin::encode(setpoint),
            &BinCrc8::encode(setpoint),
        ] {
            assert_eq!(parse(datagram), Ok(setpoint), "{datagram:?}");
        }
        // Three bytes are bytes, whatever they look like.
        assert_eq!(parse(b"1,2"), Ok(Setpoint::from(*b"1,2")));
    }

    #[test]
    fn a_bad_datagram_is_told_with_its_reason() {
        let broken_check = {
            let mut frame = BinCrc8::encode(Setpoint::default());
            frame[6] ^= 1;
            frame
        };
        let long = vec![b'0'; 600];
        for (datagram, reason) in [
            (&b""[..], "neither three bytes"),
            (b"1,2,3,4", "neither three bytes"),
            (b"AB\0\x01\x02\x03\x04", "neither three bytes"),
            (&broken_check, "neither three bytes"),
            (
                b"1,2,256",
                "yaw \"256\" is not a whole number from 0 to 255",
            ),
            (b"-1,2,3", "pitch \"-1\""),
            (b"1,2.5,3", "roll \"2.5\""),
            (&long, "longer than 512 bytes"),
        ] {
            let problem = parse(datagram).unwrap_err();
            assert!(problem.contains(reason), "{datagram:?}: {problem}");
        }
    }

    #[test]
    fn a_stale_datagram_is_not_sent_any_more() {
        let came = Instant::now();
        let setpoint = Setpoint::from([1, 2, 3]);
        let datagrams = |latest| Datagrams {
            heard: Arc::new(Mutex::new(Heard {
                latest,
                ..Heard::default()
            })),
            rate: Rate(NonZeroU32::MIN),
            stale_after: Duration::from_millis(200),
        };
        assert_eq!(datagrams(None).setpoint_at(came), None);
        let heard = datagrams(Some((setpoint, came)));
        let after = |milliseconds| heard.setpoint_at(came + Duration::from_millis(milliseconds));
        assert_eq!(after(0), Some(setpoint));
        assert_eq!(after(199), Some(setpoint));
        assert_eq!(after(200), None);
    }
}
