//! The frames that a sender sends: frames with a setpoint for the simulation, and example frames of any description.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use anyhow::{Context, Error, Result};
use framelock::motion::Setpoint;
use framelock_description::{Description, Kind, Type, hex};
use framelock_oracles::{Purpose, Seed};
use framelock_receiving::Protocol;
use rand::seq::IndexedRandom as _;
use rand::{Rng, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::motion::{Axis, Motion, Shape};

/// The contents of the four bytes after the sync: reserved, pitch, roll, yaw.
///
/// The text form is `motion`, `random`, `00414200` or `ambiguous`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Payload {
    /// A figure of eight; the reserved byte is 0.
    Motion,
    /// Random bytes, drawn for each frame.
    Random,
    /// The same four bytes in every frame.
    Constant([u8; 4]),
    /// One of the 512 payloads of clause N2 in docs/protocol.md. The payload is drawn once per
    /// trial, so that all frames of a trial are the same.
    Ambiguous,
}

impl FromStr for Payload {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "motion" => Ok(Self::Motion),
            "random" => Ok(Self::Random),
            "ambiguous" => Ok(Self::Ambiguous),
            _ => {
                let bytes = hex::parse(&[text]).ok();
                let payload = bytes.and_then(|bytes| bytes.try_into().ok());
                payload.map(Self::Constant).context(
                    "expected one of these: motion, random, 00414200 (the four payload bytes, in \
                     hexadecimal) or ambiguous",
                )
            }
        }
    }
}

impl fmt::Display for Payload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Motion => f.write_str("motion"),
            Self::Random => f.write_str("random"),
            Self::Constant(bytes) => f.write_str(&hex::glued(&bytes)),
            Self::Ambiguous => f.write_str("ambiguous"),
        }
    }
}

/// One sent frame.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Transmission {
    /// The bytes sent.
    pub bytes: Vec<u8>,
    /// The setpoint that the frame carries.
    pub setpoint: Setpoint,
}

impl Transmission {
    /// Creates a frame with this payload.
    ///
    /// # Panics
    /// May panic if the frames have no setpoints.
    #[must_use]
    pub fn new(protocol: &Protocol, payload: [u8; 4]) -> Self {
        let mut bytes = vec![0; protocol.longest()];
        bytes[2..6].copy_from_slice(&payload);
        let is_sealed = protocol.description.kinds[0].layout().seal(&mut bytes);
        assert!(is_sealed, "a frame of setpoints may have any payload");
        let [_, pitch, roll, yaw] = payload;
        Self {
            bytes,
            setpoint: Setpoint { pitch, roll, yaw },
        }
    }
}

/// Returns an endless sequence of transmissions. The frames must have setpoints. `frame_time` is the time from one
/// frame of the motion to the next.
pub fn transmissions(
    protocol: &Protocol,
    payload: Payload,
    seed: Seed,
    frame_time: Duration,
) -> impl Iterator<Item = Transmission> {
    let mut random = seed.random(Purpose::Sender);
    let motion = Motion {
        shape: Shape::FigureOfEight,
        amplitude: 100,
        axes: vec![Axis::Pitch, Axis::Roll, Axis::Yaw],
    };
    let repeated = match payload {
        Payload::Constant(payload) => payload,
        Payload::Ambiguous => {
            let x = random.random();
            if random.random() {
                [0x0D, 0x41, 0x42, x]
            } else {
                [x, 0x0D, 0x41, 0x42]
            }
        }
        Payload::Motion | Payload::Random => [0; 4],
    };
    (0..).map(move |slot| {
        let payload = match payload {
            Payload::Motion => {
                let [pitch, roll, yaw] = motion.at(frame_time * slot).into();
                [0, pitch, roll, yaw]
            }
            Payload::Random => [(); 4].map(|()| random.random_range(0..=u8::MAX)),
            Payload::Constant(_) | Payload::Ambiguous => repeated,
        };
        Transmission::new(protocol, payload)
    })
}

/// Returns an endless sequence of example frames that alternate between all kinds of a description. Their bytes are
/// random where the format allows any value. Frames with text have random capital letters or random numbers. If no
/// attempt makes a frame of a kind, the frame of the next kind follows.
pub fn examples(description: &Description, seed: u64) -> impl Iterator<Item = Vec<u8>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    description.kinds.iter().cycle().filter_map(move |kind| {
        // Many message types have only one valid length, so try several lengths until the format accepts a frame.
        let mut frames = (0..64).filter_map(|nth| example(kind, nth / 8, &mut random));
        frames.find(|frame| description.is_frame(frame))
    })
}

/// Returns a frame of random bytes, or a frame with a text of random numbers. `longer` makes a frame of random bytes
/// longer, up to the kind's longest length. Returns `None` if the layout cannot turn the bytes into a frame.
fn example(kind: &Kind, longer: usize, random: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let layout = kind.layout();
    if let Some(pattern) = kind.texts.first() {
        let mut text = pattern.first.clone();
        for value in &pattern.values {
            text.extend(random.random_range(0..=u8::MAX).to_string().bytes());
            text.extend(&value.after);
        }
        let bytes = [vec![0; kind.text_at], text, vec![0; kind.from_end]].concat();
        return kind.frame(bytes.len(), None, |at| bytes[at]);
    }
    let mut fields = kind.fields.iter();
    let takes_rest = fields.clone().any(|field| field.length().is_none());
    let rest = random.random_range(0..=12 * usize::from(takes_rest));
    let ends = fields.clone().filter_map(|field| field.end(rest));
    let length = kind.least_length(ends).max(layout.shortest) + longer;
    let is_text = fields.any(|field| field.kind == Type::Text);
    let mut bytes = kind.content_bytes();
    bytes.retain(|byte| !is_text || byte.is_ascii_uppercase());
    let messages = layout.messages.map_or(&[][..], |messages| messages.known);
    let message = messages.choose(random).map(|message| message.number);
    let fill = |_| *bytes.choose(random).expect("the content has bytes");
    kind.frame(length.min(layout.longest), message, fill)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    #[test]
    fn payloads_are_written_as_they_are_read() {
        for text in ["motion", "random", "00414200", "ambiguous"] {
            assert_eq!(text.parse::<Payload>().unwrap().to_string(), text);
        }
        let payload = "0d4142ff".parse::<Payload>().unwrap();
        assert_eq!(payload, Payload::Constant([0x0D, 0x41, 0x42, 0xFF]));
        for text in ["", "00", "0041420", "0041420000", "+0041420", "repeated"] {
            let complaint = text.parse::<Payload>().unwrap_err().to_string();
            assert!(complaint.contains("00414200"), "{text}: {complaint}");
        }
    }
}
