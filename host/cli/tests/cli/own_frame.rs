//! The guide `docs/own-frame.md`: its commands do what it says, and its Rust receives the same frames.

use std::fs;

use crate::guide;

const GUIDE: &str = include_str!("../../../../docs/own-frame.md");

#[test]
#[cfg(unix)]
fn the_commands_do_what_the_guide_says() {
    let folder = guide::runs(GUIDE);
    // What the commands made from values is what the guide's capture has of kind 1.
    let capture = fs::read(folder.path().join("capture.bin")).unwrap();
    assert!(capture.starts_with(&[
        0xAA, 0x55, 0x06, 0x01, 0xE8, 0x03, 0x2C, 0x01, 0x15, 0x1D, 0x14
    ]));

    let mut receiver = BufferedReceiver::<_, 42>::new(Motor);
    let mut values = Vec::new();
    receiver.feed(&capture, |found| {
        if let Some(message) = found.message() {
            values.push((message.position, message.current, message.temperature));
        }
    });
    assert_eq!(values, [(1000, 300, 21), (1010, 310, 21), (-20, 45, 22)]);
}

#[test]
fn the_guides_rust_is_this_tests() {
    let blocks = guide::blocks(GUIDE, "rust");
    assert_eq!(blocks.len(), 2);
    for (code, _) in blocks {
        assert!(include_str!("own_frame.rs").contains(code), "{code}");
    }
}

// From here on it is what the guide shows, with the `use` lines that a reader needs.

use framelock::{BufferedReceiver, Format};
use framelock_formats::layout::{
    Algorithm, Checksum, Crc, FixedBits, Layout, Length, LengthField, Patterns,
};
use framelock_formats::{check_laws, judged_by};

const MEASUREMENT: Layout = Layout {
    sync: Patterns::one(&[0xAA, 0x55]),
    length: Length::Field(LengthField {
        plus: 5,
        ..LengthField::byte(2)
    }),
    shortest: 11,
    longest: 21,
    fixed: &[FixedBits {
        at: 3,
        mask: 0xFF,
        value: 1,
    }],
    checksum: Some(Checksum {
        // CRC-16/MODBUS.
        algorithm: Algorithm::Crc(Crc {
            width: 16,
            polynomial: 0x8005,
            initial: 0xFFFF,
            reflected_in: true,
            reflected_out: true,
            ..Crc::ZERO
        }),
        from: 2,
        ..Checksum::at_the_end(2)
    }),
    ..Layout::NONE
};

struct Motor;

struct Measurement {
    /// Hundredths of a degree.
    position: i16,
    current: u16,
    temperature: i8,
}

impl Format for Motor {
    judged_by!(MEASUREMENT);
    type Message<'a> = Measurement;

    fn decode(&self, frame: &[u8]) -> Measurement {
        Measurement {
            position: i16::from_le_bytes([frame[4], frame[5]]),
            current: u16::from_le_bytes([frame[6], frame[7]]),
            temperature: i8::from_le_bytes([frame[8]]),
        }
    }
}

#[test]
fn what_was_captured_is_received() {
    let captured = b"\xAA\x55\x06\x01\xE8\x03\x2C\x01\x15\x1D\x14\xAA";
    let mut receiver = BufferedReceiver::<_, 42>::new(Motor);
    let mut values = Vec::new();
    for &byte in captured {
        if let Some(message) = receiver.push(byte) {
            values.push((message.position, message.current, message.temperature));
        }
    }
    assert_eq!(values, [(1000, 300, 21)]);
    check_laws(&Motor, &mut captured.to_vec()).unwrap();
}

use framelock::{Encode, FixedFormat, Receiver, Shape};
use framelock_formats::check_encoding;

/// FE, 16 bits of throttle, 0A.
struct Throttle;

impl FixedFormat for Throttle {
    type Frame = [u8; 4];
    type Message = u16;
    const SHAPE: Shape<[u8; 4]> = Shape::new([Some(0xFE), None, None, Some(0x0A)]);

    fn decode([_, high, low, _]: [u8; 4]) -> u16 {
        u16::from_be_bytes([high, low])
    }
}

// So that `cargo check` says if no receiver takes it.
const _: Receiver<Throttle> = Receiver::new();

// Only to make frames: for a sender, for tests.
impl Encode for Throttle {
    fn encode(throttle: u16) -> [u8; 4] {
        let [high, low] = throttle.to_be_bytes();
        [0xFE, high, low, 0x0A]
    }
}

#[test]
fn every_frame_that_is_made_means_what_it_should() {
    for throttle in 0..=u16::MAX {
        check_encoding::<Throttle>(throttle).unwrap();
    }
}
