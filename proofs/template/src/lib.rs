//! A frame of your own: `AA`, the payload's length, the payload, and the sum of all preceding bytes.
//!
//! Change the layout, the message, `decode` and `encode` to those of your frame. `proofs.rs` has the theorems.
#![no_std]
#![forbid(unsafe_code)]

use framelock::Format;
use framelock_formats::classify_by;
use framelock_formats::layout::{
    Algorithm, CheckedLayout, Checksum, Layout, Length, LengthField, Patterns,
};

#[cfg(kani)]
extern crate kani;
#[cfg(kani)]
mod proofs;

const LAYOUT: CheckedLayout = Layout {
    sync: Patterns::one(&[0xAA]),
    length: Length::Field(LengthField {
        plus: 3,
        ..LengthField::byte(1)
    }),
    shortest: 5,
    longest: 6,
    checksum: Some(Checksum {
        algorithm: Algorithm::Sum,
        ..Checksum::at_the_end(1)
    }),
    ..Layout::NONE
}
.checked();

/// The values of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Motor {
    /// Tenths of a degree.
    pub angle: i16,
    /// Degrees Celsius. A short frame has no temperature.
    pub temperature: Option<i8>,
}

/// The format of the frames.
#[derive(Clone, Copy, Debug)]
pub struct OwnFrame;

impl Format for OwnFrame {
    classify_by!(LAYOUT);
    type Message<'a> = Motor;

    /// `frame` is a frame that `classify` has accepted.
    fn decode(&self, frame: &[u8]) -> Motor {
        Motor {
            angle: i16::from_le_bytes([frame[2], frame[3]]),
            temperature: (frame.len() == 6).then(|| frame[4].cast_signed()),
        }
    }
}

/// Writes the frame with these values into the buffer, and returns it.
pub fn encode(motor: Motor, into: &mut [u8; OwnFrame::LONGEST]) -> &[u8] {
    let [low, high] = motor.angle.to_le_bytes();
    let frame = match motor.temperature {
        Some(temperature) => {
            *into = [0, 0, low, high, temperature.cast_unsigned(), 0];
            &mut into[..]
        }
        None => {
            *into = [0, 0, low, high, 0, 0];
            &mut into[..5]
        }
    };
    // Writes the sync, the length and the checksum.
    let is_frame = LAYOUT.seal(frame);
    debug_assert!(is_frame);
    frame
}
