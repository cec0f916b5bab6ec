//! The sender's output: payloads, and the sequence of frames that carry them.

use std::fmt;
use std::str::FromStr;

use anyhow::{Context, Error, Result};
use framelock::motion::Setpoint;
use framelock_receiving::FrameFormat;
use rand::{Rng, RngCore};

use crate::motion::SmoothMotion;
use crate::parameters::Parameters;
use crate::random::{Purpose, Seed, whole};

/// The contents of the four bytes between sync and terminator: reserved, pitch, roll, yaw.
///
/// The text form is `motion`, `random`, `random:40-43`, `repeated`, `repeated:40-43`, `00414200`,
/// `ambiguous` or `noise`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Payload {
    /// Smooth motion; the reserved byte is 0.
    Motion,
    /// Random bytes from the first to the second value, both included. They are drawn for each
    /// frame.
    Random(u8, u8),
    /// Random bytes from the first to the second value, both included. They are drawn once per
    /// trial, so that all frames of a trial are the same.
    Repeated(u8, u8),
    /// The same four bytes in every frame.
    Constant([u8; 4]),
    /// One of the 512 payloads of clause N2 in docs/protocol.md. The payload is drawn once per
    /// trial, so that all frames of a trial are the same.
    Ambiguous,
    /// No frames at all. Random bytes in place of each frame, as many as the frame has.
    Noise,
}

impl FromStr for Payload {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (kind, range) = text.split_once(':').unwrap_or((text, "00-FF"));
        let bytes = || {
            let (from, to) = range.split_once('-')?;
            let ([from], [to]) = (hexadecimal(from)?, hexadecimal(to)?);
            (from <= to).then_some((from, to))
        };
        let payload = match kind {
            "random" => bytes().map(|(from, to)| Self::Random(from, to)),
            "repeated" => bytes().map(|(from, to)| Self::Repeated(from, to)),
            _ => match text {
                "motion" => Some(Self::Motion),
                "ambiguous" => Some(Self::Ambiguous),
                "noise" => Some(Self::Noise),
                _ => hexadecimal(text).map(Self::Constant),
            },
        };
        payload.context(
            "expected one of these: motion, random, repeated, random:40-43 or repeated:40-43 \
             (from one byte to another, in hexadecimal), 00414200 (the four payload bytes, in \
             hexadecimal), ambiguous or noise",
        )
    }
}

/// Parses exactly `COUNT` bytes of two digits each.
fn hexadecimal<const COUNT: usize>(text: &str) -> Option<[u8; COUNT]> {
    // Reject a sign, which the standard library would accept.
    if text.len() != 2 * COUNT || text.starts_with('+') {
        return None;
    }
    let number = u32::from_str_radix(text, 16).ok()?;
    number.to_be_bytes().last_chunk().copied()
}

impl fmt::Display for Payload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Motion => f.write_str("motion"),
            Self::Random(0x00, 0xFF) => f.write_str("random"),
            Self::Random(from, to) => write!(f, "random:{from:02X}-{to:02X}"),
            Self::Repeated(0x00, 0xFF) => f.write_str("repeated"),
            Self::Repeated(from, to) => write!(f, "repeated:{from:02X}-{to:02X}"),
            Self::Constant(bytes) => bytes.iter().try_for_each(|byte| write!(f, "{byte:02X}")),
            Self::Ambiguous => f.write_str("ambiguous"),
            Self::Noise => f.write_str("noise"),
        }
    }
}

/// One transmission: the bytes of a frame, or noise in place of a frame.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Transmission {
    /// The bytes sent.
    pub bytes: Vec<u8>,
    /// The setpoint that the frame carries; `None` for noise.
    pub setpoint: Option<Setpoint>,
}

impl Transmission {
    /// Creates a frame in this format with this payload.
    #[must_use]
    pub fn new(format: FrameFormat, payload: [u8; 4]) -> Self {
        let [reserved, pitch, roll, yaw] = payload;
        let mut bytes = vec![b'A', b'B', reserved, pitch, roll, yaw];
        if format == FrameFormat::BinCrc8 {
            bytes.push(framelock::motion::crc8(payload));
        }
        bytes.push(b'\r');
        Self {
            bytes,
            setpoint: Some(Setpoint { pitch, roll, yaw }),
        }
    }
}

/// Returns an endless sequence of transmissions.
pub(crate) fn frames(
    parameters: &Parameters,
    seed: Seed,
) -> impl Iterator<Item = Transmission> + use<> {
    let (format, payload) = (parameters.frame, parameters.payload);
    let mut random = seed.random(Purpose::Sender);
    // The motion takes two seconds from one point to the next.
    let mut motion = SmoothMotion::new(seed, whole(2.0 * parameters.rate).max(1));
    let repeated = match payload {
        Payload::Repeated(from, to) => [(); 4].map(|()| random.random_range(from..=to)),
        Payload::Constant(payload) => payload,
        Payload::Ambiguous => {
            let x = random.random();
            if random.random() {
                [0x0D, 0x41, 0x42, x]
            } else {
                [x, 0x0D, 0x41, 0x42]
            }
        }
        Payload::Motion | Payload::Random(..) | Payload::Noise => [0; 4],
    };
    (0..).map(move |slot| {
        let payload = match payload {
            Payload::Motion => {
                let [pitch, roll, yaw] = motion.setpoint(slot).into();
                [0, pitch, roll, yaw]
            }
            Payload::Random(from, to) => [(); 4].map(|()| random.random_range(from..=to)),
            Payload::Noise => {
                let bytes = random.next_u64().to_le_bytes().into_iter();
                return Transmission {
                    bytes: bytes.take(format.length()).collect(),
                    setpoint: None,
                };
            }
            Payload::Repeated(..) | Payload::Constant(_) | Payload::Ambiguous => repeated,
        };
        Transmission::new(format, payload)
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    #[test]
    fn payloads_are_written_as_they_are_read() {
        for text in [
            "motion",
            "random",
            "random:40-43",
            "repeated",
            "repeated:40-43",
            "00414200",
            "ambiguous",
            "noise",
        ] {
            assert_eq!(text.parse::<Payload>().unwrap().to_string(), text);
        }
        assert_eq!(
            "0d4142ff".parse::<Payload>().unwrap(),
            Payload::Constant([0x0D, 0x41, 0x42, 0xFF])
        );
        for text in [
            "",
            "00",
            "0041420",
            "0041420000",
            "random:43-40",
            "repeated:4-5",
            "noise:00-01",
            "+0041420",
            "random:+4-43",
            "ä0000000",
        ] {
            let complaint = text.parse::<Payload>().unwrap_err().to_string();
            assert!(complaint.contains("random:40-43"), "{text}: {complaint}");
        }
    }
}
