//! The guide `docs/own-frame.md`: its commands do what it says, and its Rust receives the same frames.

use std::fs;

use framelock::{BufferedReceiver, Framing, Headed, Verdict, check_laws};

use crate::guide;

const GUIDE: &str = include_str!("../../../docs/own-frame.md");

#[test]
#[cfg(unix)]
fn the_commands_do_what_the_guide_says() {
    let folder = guide::runs(GUIDE);
    // What the commands made from values is what the guide's capture has of kind 1.
    let capture = fs::read(folder.path().join("capture.bin")).unwrap();
    assert!(capture.starts_with(&[
        0xAA, 0x55, 0x06, 0x01, 0xE8, 0x03, 0x2C, 0x01, 0x15, 0x1D, 0x14
    ]));

    let mut receiver = BufferedReceiver::<_, 21>::new(Motor);
    let mut values = Vec::new();
    receiver.feed(&capture, |found| {
        if let Some(message) = found.message() {
            values.push((message.position, message.current, message.temperature));
        }
    });
    assert_eq!(values, [(1000, 300, 21), (1010, 310, 21), (-20, 45, 22)]);
    check_laws(&Motor, &mut capture[..12].to_vec()).unwrap();
}

#[test]
fn the_guides_rust_is_this_tests() {
    let (code, _) = guide::blocks(GUIDE, "rust")[0];
    assert!(include_str!("own_frame.rs").contains(code));
}

fn crc16_modbus(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &byte| {
        let step = |crc: u16, _| (crc >> 1) ^ (0xA001 * (crc & 1));
        (0..8).fold(crc ^ u16::from(byte), step)
    })
}

struct Motor;

struct Measurement {
    position: i16,
    current: u16,
    temperature: i8,
}

impl Framing for Motor {
    const LONGEST: usize = 21;
    type Message<'a> = Measurement;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        let format = Headed {
            sync: &[0xAA, 0x55],
            header: 4,
            longest: Self::LONGEST,
        };
        format.judge(
            bytes,
            |header| match header {
                &[_, _, length @ 6..=16, 1] => Some(usize::from(length) + 5),
                _ => None,
            },
            |frame| match frame {
                [_, _, covered @ .., low, high] => {
                    crc16_modbus(covered) == u16::from_le_bytes([*low, *high])
                }
                _ => false,
            },
        )
    }

    fn decode(&self, frame: &[u8]) -> Measurement {
        Measurement {
            position: i16::from_le_bytes([frame[4], frame[5]]),
            current: u16::from_le_bytes([frame[6], frame[7]]),
            temperature: frame[8].cast_signed(),
        }
    }
}
