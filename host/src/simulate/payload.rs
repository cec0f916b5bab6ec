//! What the sender says, frame by frame.

use std::fmt;
use std::str::FromStr;

use rand::{Rng, RngCore};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::occurrences::whole;
use super::parameters::Parameters;
use crate::names::FrameName;
use crate::smooth_motion::SmoothMotion;

/// What the four bytes between sync and terminator are: reserved, pitch, roll, yaw.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Payload {
    /// Smooth motion; the reserved byte is 0.
    Motion,
    /// Every byte at random from one to the other, both included, anew for each frame.
    Random(u8, u8),
    /// The same in every frame of a trial: every byte at random from one to the other, both
    /// included, drawn for each trial.
    Repeated(u8, u8),
    /// The same in every frame.
    Constant([u8; 4]),
    /// The same in every frame of a trial: one of the 512 payloads of clause N2, drawn for each
    /// trial.
    Ambiguous,
    /// No frames at all, but as many random bytes in the place of each.
    Noise,
}

const WANTED: &str = "motion, random, repeated, random:40-43 or repeated:40-43 (from one byte to \
                      another, in hexadecimal), 00414200 (the four payload bytes, in hexadecimal), \
                      ambiguous or noise";

impl FromStr for Payload {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, bytes) = text
            .split_once(':')
            .map_or((text, Some((0x00, 0xFF))), |(kind, bytes)| {
                (kind, range(bytes))
            });
        let payload = match (kind, bytes) {
            ("random", Some((from, to))) => Some(Self::Random(from, to)),
            ("repeated", Some((from, to))) => Some(Self::Repeated(from, to)),
            _ => match text {
                "motion" => Some(Self::Motion),
                "ambiguous" => Some(Self::Ambiguous),
                "noise" => Some(Self::Noise),
                _ => constant(text).map(Self::Constant),
            },
        };
        payload.ok_or_else(|| format!("one of these is wanted: {WANTED}"))
    }
}

fn range(text: &str) -> Option<(u8, u8)> {
    let (from, to) = text.split_once('-')?;
    let (from, to) = (byte(from)?, byte(to)?);
    (from <= to).then_some((from, to))
}

fn constant(text: &str) -> Option<[u8; 4]> {
    let mut bytes = [0; 4];
    let mut rest = text;
    for place in &mut bytes {
        let (digits, behind) = rest.split_at_checked(2)?;
        *place = byte(digits)?;
        rest = behind;
    }
    rest.is_empty().then_some(bytes)
}

fn byte(digits: &str) -> Option<u8> {
    // A sign is no digit.
    let is_plain = digits.len() == 2 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    u8::from_str_radix(digits, 16).ok().filter(|_| is_plain)
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

impl Serialize for Payload {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A frame as it is sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    bytes: [u8; 8],
    length: usize,
}

impl Frame {
    /// The format's frame with that payload.
    fn new(format: FrameName, payload: [u8; 4]) -> Self {
        let [reserved, pitch, roll, yaw] = payload;
        let [sync_a, sync_b, terminator] = [b'A', b'B', b'\r'];
        match format {
            FrameName::Bin => Self {
                bytes: [sync_a, sync_b, reserved, pitch, roll, yaw, terminator, 0],
                length: 7,
            },
            FrameName::BinCrc8 => {
                let crc = framelock::crc8(payload);
                Self {
                    bytes: [sync_a, sync_b, reserved, pitch, roll, yaw, crc, terminator],
                    length: 8,
                }
            }
        }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    pub(super) fn setpoint(&self) -> framelock::Setpoint {
        let [_, _, _, pitch, roll, yaw, ..] = self.bytes;
        framelock::Setpoint { pitch, roll, yaw }
    }
}

/// Gives one frame after the other.
#[derive(Debug)]
pub(super) struct Sender {
    format: FrameName,
    next: Next,
    frames: u64,
}

#[derive(Debug)]
enum Next {
    Motion(SmoothMotion),
    Random(ChaCha8Rng, u8, u8),
    Constant([u8; 4]),
    Noise(ChaCha8Rng),
}

impl Sender {
    pub(super) fn new(parameters: &Parameters, mut random: ChaCha8Rng) -> Self {
        let next = match parameters.payload {
            Payload::Motion => {
                // Two seconds from one point to the next.
                let slots = whole(2.0 * parameters.rate).max(1);
                Next::Motion(SmoothMotion::new(random, slots))
            }
            Payload::Random(from, to) => Next::Random(random, from, to),
            Payload::Repeated(from, to) => {
                Next::Constant([(); 4].map(|()| random.random_range(from..=to)))
            }
            Payload::Constant(payload) => Next::Constant(payload),
            Payload::Ambiguous => {
                let x = random.random();
                Next::Constant(if random.random() {
                    [0x0D, 0x41, 0x42, x]
                } else {
                    [x, 0x0D, 0x41, 0x42]
                })
            }
            Payload::Noise => Next::Noise(random),
        };
        Self {
            format: parameters.frame,
            next,
            frames: 0,
        }
    }

    pub(super) fn next(&mut self) -> Frame {
        let slot = self.frames;
        self.frames += 1;
        let payload = match &mut self.next {
            Next::Motion(motion) => {
                let [pitch, roll, yaw] = motion.setpoint(slot).into();
                [0, pitch, roll, yaw]
            }
            Next::Random(random, from, to) => [(); 4].map(|()| random.random_range(*from..=*to)),
            Next::Constant(payload) => *payload,
            Next::Noise(random) => {
                let length = Frame::new(self.format, [0; 4]).length;
                return Frame {
                    bytes: random.next_u64().to_le_bytes(),
                    length,
                };
            }
        };
        Frame::new(self.format, payload)
    }
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
            "0d4142ff".parse(),
            Ok(Payload::Constant([0x0D, 0x41, 0x42, 0xFF]))
        );
        for text in [
            "",
            "00",
            "0041420",
            "0041420000",
            "random:43-40",
            "repeated:4-5",
            "noise:00-01",
            "+0+0+0+0",
            "ä0000000",
        ] {
            let complaint = text.parse::<Payload>().unwrap_err();
            assert!(complaint.contains("random:40-43"), "{text}: {complaint}");
        }
    }
}
