//! Frames of motion platforms: layouts of the core's [`Bin`](framelock::motion::Bin) and
//! [`BinCrc8`](framelock::motion::BinCrc8), and six axes of 16 bits.

use framelock::{Encode, FixedFormat, Shape};

use crate::layout::{Algorithm, CheckedLayout, Checksum, Crc, Layout, Patterns};

/// The layout of a [`Bin`](framelock::motion::Bin) frame.
pub const BIN: CheckedLayout<'static> = Layout {
    sync: Patterns::one(b"AB"),
    longest: 7,
    terminator: Patterns::one(b"\r"),
    ..Layout::NONE
}
.checked();

/// The layout of a [`BinCrc8`](framelock::motion::BinCrc8) frame.
pub const BIN_CRC8: CheckedLayout<'static> = Layout {
    sync: Patterns::one(b"AB"),
    longest: 8,
    checksum: Some(Checksum {
        algorithm: Algorithm::Crc(Crc {
            initial: 0xFF,
            xor_out: 0xFF,
            ..Crc::new(8, 0x2F)
        }),
        at: -2,
        from: 2,
        to: -3,
        ..Checksum::at_the_end(1)
    }),
    terminator: Patterns::one(b"\r"),
    ..Layout::NONE
}
.checked();

/// The layout of a frame of six axes, for receivers that take a layout: see [`SixAxes`].
pub const SIX_AXES: CheckedLayout<'static> = Layout {
    sync: Patterns::one(&[0xFF, 0xFF]),
    longest: 16,
    terminator: Patterns::one(b"\n\r"),
    ..Layout::NONE
}
.checked();

/// Six axes of a motion platform: 16 bytes, `FF FF`, six numbers of 16 bits, `0A 0D`.
///
/// The numbers are little endian. They go from 0 at one end of an axis's travel to 65 535 at the other end.
/// [`SixAxesBigEndian`] has big-endian numbers instead. Use both formats with the small
/// [`Receiver`](framelock::Receiver), which delivers each frame with the frame's last byte.
///
/// There is no checksum. Only the first two and the last two bytes are checked, and the numbers may contain bytes of
/// the same values. Therefore report the idle gap after each frame as a [`LineEvent`](framelock::LineEvent).
///
/// Source: there is no standard. Motion software can be configured to send this frame for six axes of 16 bits.
///
/// # Examples
/// ```
/// use framelock::{Encode, Receiver};
/// use framelock_formats::motion::SixAxes;
/// let mut receiver = Receiver::<SixAxes>::new();
/// let axes = [0, 16_384, 32_768, 40_000, 65_535, 13];
/// let received = SixAxes::encode(axes).into_iter().find_map(|byte| receiver.push(byte));
/// assert_eq!(received, Some(axes));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct SixAxes;

/// [`SixAxes`] with big-endian numbers.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct SixAxesBigEndian;

const SHAPE: Shape<[u8; 16]> = {
    let mut places = [None; 16];
    [places[0], places[1]] = [Some(0xFF); 2];
    [places[14], places[15]] = [Some(b'\n'), Some(b'\r')];
    Shape::new(places)
};

impl FixedFormat for SixAxes {
    type Frame = [u8; 16];
    type Message = [u16; 6];
    const SHAPE: Shape<[u8; 16]> = SHAPE;

    #[inline]
    fn decode(frame: [u8; 16]) -> [u16; 6] {
        let mut words = frame.chunks_exact(2).skip(1);
        [(); 6].map(|()| match words.next() {
            Some(&[low, high]) => u16::from_le_bytes([low, high]),
            _ => 0,
        })
    }
}

impl Encode for SixAxes {
    fn encode(axes: [u16; 6]) -> [u8; 16] {
        let mut frame = [0; 16];
        for (place, axis) in frame.chunks_exact_mut(2).skip(1).zip(axes) {
            place.copy_from_slice(&axis.to_le_bytes());
        }
        SIX_AXES.seal(&mut frame);
        frame
    }
}

impl FixedFormat for SixAxesBigEndian {
    type Frame = [u8; 16];
    type Message = [u16; 6];
    const SHAPE: Shape<[u8; 16]> = SHAPE;

    #[inline]
    fn decode(frame: [u8; 16]) -> [u16; 6] {
        SixAxes::decode(frame).map(u16::swap_bytes)
    }
}

impl Encode for SixAxesBigEndian {
    fn encode(axes: [u16; 6]) -> [u8; 16] {
        SixAxes::encode(axes.map(u16::swap_bytes))
    }
}
