//! The frames of a motion simulator: BIN, and BIN with a checksum.

use crate::{Encode, FixedFormat, Shape};

use super::Setpoint;

/// The motion simulator's "BIN" output: `'A' 'B' reserved pitch roll yaw CR`, seven bytes.
///
/// The format has no escaping and no checksum. So the payload may contain any byte, and a changed payload byte goes
/// unnoticed. If a sender repeats a frame without pause and the frame's payload is `(0D 41 42 x)` or `(x 0D 41 42)`,
/// the stream is ambiguous: after one lost byte, the receiver may deliver wrong setpoints for ever. To resolve the
/// ambiguity, report [`LineEvent::Idle`](crate::LineEvent::Idle) when the line pauses, or use [`BinCrc8`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Bin {}

impl FixedFormat for Bin {
    type Frame = [u8; 7];
    type Message = Setpoint;
    const SHAPE: Shape<[u8; 7]> =
        Shape::new([Some(b'A'), Some(b'B'), None, None, None, None, Some(b'\r')]);

    #[inline]
    fn decode([_, _, _reserved, pitch, roll, yaw, _]: [u8; 7]) -> Setpoint {
        Setpoint { pitch, roll, yaw }
    }
}

impl Encode for Bin {
    /// Encodes the setpoint. The reserved byte is 0.
    fn encode(Setpoint { pitch, roll, yaw }: Setpoint) -> [u8; 7] {
        [b'A', b'B', 0, pitch, roll, yaw, b'\r']
    }
}

/// BIN with a checksum: `'A' 'B' reserved pitch roll yaw crc CR`, eight bytes. Use it if you control both ends.
///
/// The checksum is [`crc8`] of the four bytes between the sync and the checksum. It detects every error of one to three
/// bits in the four bytes and the checksum. The encoder sends 0 as the reserved byte.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum BinCrc8 {}

impl FixedFormat for BinCrc8 {
    type Frame = [u8; 8];
    type Message = Setpoint;
    #[rustfmt::skip]
    const SHAPE: Shape<[u8; 8]> =
        Shape::new([Some(b'A'), Some(b'B'), None, None, None, None, None, Some(b'\r')]);
    const CHECK: Option<fn([u8; 8]) -> bool> =
        Some(|[_, _, reserved, pitch, roll, yaw, crc, _]| {
            crc8([reserved, pitch, roll, yaw]) == crc
        });

    #[inline]
    fn decode([_, _, _reserved, pitch, roll, yaw, _, _]: [u8; 8]) -> Setpoint {
        Setpoint { pitch, roll, yaw }
    }
}

impl Encode for BinCrc8 {
    #[rustfmt::skip]
    fn encode(Setpoint { pitch, roll, yaw }: Setpoint) -> [u8; 8] {
        [b'A', b'B', 0, pitch, roll, yaw, crc8([0, pitch, roll, yaw]), b'\r']
    }
}

/// Computes CRC-8/AUTOSAR: polynomial 0x2F, initial value 0xFF, not reflected, final exclusive or 0xFF.
///
/// Four bytes and their checksum form a code of Hamming distance 4. The function takes 32 steps, each with one shift
/// and one exclusive or. A faster function with a table would not be worth the flash, because the receiver computes a
/// checksum only when all fixed bytes are right.
#[inline]
#[must_use]
pub fn crc8(payload: [u8; 4]) -> u8 {
    // The CRC is linear, so a 32-bit register can hold all four bytes from the start. Its top byte is the CRC's
    // register.
    let mut register = u32::from_be_bytes(payload) ^ 0xFF00_0000;
    for _ in 0..32 {
        let divisor = if register >> 31 == 1 { 0x2F00_0000 } else { 0 };
        register = register << 1 ^ divisor;
    }
    register.to_be_bytes()[0] ^ 0xFF
}
