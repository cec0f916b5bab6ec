//! Frame formats of fixed length. A further one is an `impl` of [`Format`]: a few lines.

use crate::Setpoint;
use crate::window::{Shape, Word};

/// A frame format of fixed length, 1 to 16 bytes, known at compile time.
///
/// # Examples
/// Six axes of 16 bits, big endian, between `'A' 'B'` and CR: 15 bytes, so the word is `u128`.
/// This is all that a new format takes; the receiver, its slice path, the accounting and the
/// theorems about every format come with it.
/// ```
/// use framelock::{Format, Parser, Receiver, Shape};
///
/// struct SixAxes;
///
/// impl Format for SixAxes {
///     type Word = u128;
///     type Frame = [u8; 15];
///     type Message = [u16; 6];
///     const SHAPE: Shape<u128> = {
///         let mut places = [None; 15];
///         places[0] = Some(b'A');
///         places[1] = Some(b'B');
///         places[14] = Some(b'\r');
///         Shape::<u128>::new(places)
///     };
///     fn decode([_, _, axes @ .., _]: [u8; 15]) -> [u16; 6] {
///         core::array::from_fn(|axis| u16::from_be_bytes([axes[2 * axis], axes[2 * axis + 1]]))
///     }
///     fn encode(axes: [u16; 6]) -> [u8; 15] {
///         let mut frame = *b"AB............\r";
///         for (place, axis) in frame[2..14].chunks_exact_mut(2).zip(axes) {
///             place.copy_from_slice(&axis.to_be_bytes());
///         }
///         frame
///     }
/// }
///
/// let axes = [0, 1, 0x4142, 40_000, 65_535, 13];
/// let mut receiver = Receiver::<SixAxes>::new();
/// let mut received = Vec::new();
/// receiver.feed(b"AB, noise", &mut |_, axes| received.push(axes));
/// receiver.feed(&SixAxes::encode(axes), &mut |_, axes| received.push(axes));
/// assert_eq!(received, [axes]);
/// ```
pub trait Format {
    /// The word that holds a frame: `u64` up to 8 bytes, `u128` up to 16.
    type Word: Word;
    /// `[u8; LENGTH]`.
    type Frame: Frame;
    /// What a frame means.
    type Message;

    /// Which byte may stand where. A length other than `Frame`'s does not compile.
    const SHAPE: Shape<Self::Word>;

    /// How many of a frame's bytes must be known before [`check`](Self::check) can be answered:
    /// a checksum in front of the terminator is known one byte before the frame ends. At most the
    /// frame's length, which it is unless stated.
    const CHECK_KNOWN_AT: u8 = Self::SHAPE.length();

    /// What is checked beyond the fixed bytes. Bytes from [`CHECK_KNOWN_AT`](Self::CHECK_KNOWN_AT)
    /// on are not to be looked at.
    #[must_use]
    fn check(frame: Self::Frame) -> bool {
        let _ = frame;
        true
    }

    /// What a frame means.
    #[must_use]
    fn decode(frame: Self::Frame) -> Self::Message;

    /// The frame that means it.
    #[must_use]
    fn encode(message: Self::Message) -> Self::Frame;
}

/// The bytes of a frame: `[u8; LENGTH]`.
pub trait Frame: AsRef<[u8]> + Copy {
    /// Bytes in the frame.
    const LENGTH: usize;

    /// The frame whose last byte is the lowest of `word`.
    #[must_use]
    fn from_word(word: impl Word) -> Self;
}

impl<const LENGTH: usize> Frame for [u8; LENGTH] {
    const LENGTH: usize = LENGTH;

    #[inline]
    fn from_word(word: impl Word) -> Self {
        word.to_be_bytes()
            .as_ref()
            .last_chunk()
            .copied()
            .unwrap_or([0; LENGTH])
    }
}

/// The motion simulator's "BIN" output: `'A' 'B' reserved pitch roll yaw CR`, seven bytes.
///
/// No escaping and no checksum: the payload may hold any byte, and a substituted payload byte
/// goes unnoticed.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Bin {}

impl Format for Bin {
    type Word = u64;
    type Frame = [u8; 7];
    type Message = Setpoint;
    const SHAPE: Shape<u64> =
        Shape::<u64>::new([Some(b'A'), Some(b'B'), None, None, None, None, Some(b'\r')]);

    #[inline]
    fn decode([_, _, _reserved, pitch, roll, yaw, _]: [u8; 7]) -> Setpoint {
        Setpoint { pitch, roll, yaw }
    }

    /// The reserved byte is sent as 0.
    fn encode(Setpoint { pitch, roll, yaw }: Setpoint) -> [u8; 7] {
        [b'A', b'B', 0, pitch, roll, yaw, b'\r']
    }
}

/// BIN with a checksum: `'A' 'B' reserved pitch roll yaw crc CR`, eight bytes, for whoever
/// controls both ends.
///
/// The checksum is [`crc8`] of the four bytes between sync and checksum: no error of one to three
/// bits in those five bytes goes unnoticed.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum BinCrc8 {}

impl Format for BinCrc8 {
    type Word = u64;
    type Frame = [u8; 8];
    type Message = Setpoint;
    const SHAPE: Shape<u64> = Shape::<u64>::new([
        Some(b'A'),
        Some(b'B'),
        None,
        None,
        None,
        None,
        None,
        Some(b'\r'),
    ]);
    const CHECK_KNOWN_AT: u8 = 7;

    #[inline]
    fn check([_, _, reserved, pitch, roll, yaw, crc, _]: [u8; 8]) -> bool {
        crc8([reserved, pitch, roll, yaw]) == crc
    }

    #[inline]
    fn decode([_, _, _reserved, pitch, roll, yaw, _, _]: [u8; 8]) -> Setpoint {
        Setpoint { pitch, roll, yaw }
    }

    /// The reserved byte is sent as 0.
    fn encode(Setpoint { pitch, roll, yaw }: Setpoint) -> [u8; 8] {
        [
            b'A',
            b'B',
            0,
            pitch,
            roll,
            yaw,
            crc8([0, pitch, roll, yaw]),
            b'\r',
        ]
    }
}

/// CRC-8/AUTOSAR: polynomial 0x2F, initial value 0xFF, not reflected, final exclusive or 0xFF.
///
/// Its Hamming distance over four bytes and itself is 4. A shift and an exclusive or per bit: 32
/// steps, and no table in flash, since it is asked only about windows whose sync is right.
#[inline]
#[must_use]
pub fn crc8(payload: [u8; 4]) -> u8 {
    // Its linearity lets all four bytes be taken at once, the register being the top byte.
    let mut register = u32::from_be_bytes(payload) ^ 0xFF00_0000;
    for _ in 0..32 {
        let carry = register >> 31;
        register = (register << 1) ^ (carry * 0x2F00_0000);
    }
    register.to_be_bytes()[0] ^ 0xFF
}
