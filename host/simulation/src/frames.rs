//! The frames that a sender sends: frames with a setpoint for the simulation, and example frames of any description.
//! The layout of the description makes each frame from its payload.

use std::fmt;
use std::str::FromStr;

use anyhow::{Context, Error, Result};
use framelock::motion::Setpoint;
use framelock_description::{Description, Kind, Type, hex};
use framelock_oracles::{Purpose, Seed};
use framelock_receiving::Protocol;
use rand::seq::IndexedRandom as _;
use rand::{Rng, RngCore, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::motion::SmoothMotion;

/// The contents of the four bytes between sync and terminator: reserved, pitch, roll, yaw.
///
/// The text form is `motion`, `random`, `random:40-43`, `00414200`, `ambiguous` or `noise`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Payload {
    /// Smooth motion; the reserved byte is 0.
    Motion,
    /// Random bytes from the first to the second value, both included. They are drawn for each
    /// frame.
    Random(u8, u8),
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
        let bytes = |text: &str| hex::parse(&[text]).ok();
        let payload = match text {
            "motion" => Some(Self::Motion),
            "ambiguous" => Some(Self::Ambiguous),
            "noise" => Some(Self::Noise),
            "random" => Some(Self::Random(0x00, 0xFF)),
            _ => match text
                .strip_prefix("random:")
                .and_then(|it| it.split_once('-'))
            {
                Some((from, to)) => match (bytes(from).as_deref(), bytes(to).as_deref()) {
                    (Some(&[from]), Some(&[to])) if from <= to => Some(Self::Random(from, to)),
                    _ => None,
                },
                None => bytes(text).and_then(|bytes| bytes.try_into().ok().map(Self::Constant)),
            },
        };
        payload.context(
            "expected one of these: motion, random, random:40-43 (from one byte to another, in \
             hexadecimal), 00414200 (the four payload bytes, in hexadecimal), ambiguous or noise",
        )
    }
}

impl fmt::Display for Payload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Motion => f.write_str("motion"),
            Self::Random(0x00, 0xFF) => f.write_str("random"),
            Self::Random(from, to) => write!(f, "random:{from:02X}-{to:02X}"),
            Self::Constant(bytes) => f.write_str(&hex::glued(&bytes)),
            Self::Ambiguous => f.write_str("ambiguous"),
            Self::Noise => f.write_str("noise"),
        }
    }
}

/// One transmission: the bytes of a frame, or noise in place of a frame.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Transmission {
    /// The bytes sent.
    pub bytes: Vec<u8>,
    /// The setpoint that the frame carries; `None` for noise.
    pub setpoint: Option<Setpoint>,
}

impl Transmission {
    /// Creates a frame with this payload.
    ///
    /// # Panics
    /// Panics if the frames have no setpoints.
    #[must_use]
    pub fn new(protocol: &Protocol, payload: [u8; 4]) -> Self {
        let mut bytes = vec![0; protocol.longest()];
        bytes[2..6].copy_from_slice(&payload);
        let is_sealed = protocol.description.kinds[0].layout().seal(&mut bytes);
        assert!(is_sealed, "a frame of setpoints may have any payload");
        let [_, pitch, roll, yaw] = payload;
        Self {
            bytes,
            setpoint: Some(Setpoint { pitch, roll, yaw }),
        }
    }
}

/// Returns an endless sequence of transmissions. The frames must have setpoints. `slots_per_leg` is the number of
/// frames that the motion takes from one point to the next.
pub fn transmissions(
    protocol: &Protocol,
    payload: Payload,
    seed: Seed,
    slots_per_leg: u64,
) -> impl Iterator<Item = Transmission> {
    let mut random = seed.random(Purpose::Sender);
    let mut motion = SmoothMotion::new(seed, slots_per_leg);
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
                    bytes: bytes.take(protocol.longest()).collect(),
                    setpoint: None,
                };
            }
            Payload::Constant(_) | Payload::Ambiguous => repeated,
        };
        Transmission::new(protocol, payload)
    })
}

/// Returns an endless sequence of example frames that alternate between all kinds of a description. Their bytes are
/// random where the format allows any value. Leaves out a frame if no attempt makes one of its kind.
pub fn examples(description: &Description, seed: u64) -> impl Iterator<Item = Vec<u8>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    description.kinds.iter().cycle().filter_map(move |kind| {
        // Many message types have only one valid length, so try several lengths until the format accepts a frame.
        let mut frames = (0..64).filter_map(|nth| example(kind, nth / 8, &mut random));
        frames.find(|frame| description.is_frame(frame))
    })
}

/// Returns a frame of random bytes that is `longer` bytes longer than this kind requires, or a frame with a text of random
/// numbers. Returns `None` if the layout cannot turn the bytes into a frame.
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
        for text in [
            "motion",
            "random",
            "random:40-43",
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
            "noise:00-01",
            "+0041420",
            "repeated",
            "random:+4-43",
            "ä0000000",
        ] {
            let complaint = text.parse::<Payload>().unwrap_err().to_string();
            assert!(complaint.contains("random:40-43"), "{text}: {complaint}");
        }
    }
}
