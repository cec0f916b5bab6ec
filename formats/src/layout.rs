//! What a frame looks like, as a value: a constant in Rust, a struct in C, a file for the command line.

/// What a frame looks like: enough to find each frame of a stream, check it, and write one.
///
/// ```text
///   sync   header: length, message, fixed bits     payload     checksum   terminator   appendix
///  ┌──────┬───────────────────────────────────┬──────────────┬──────────┬────────────┬──────────┐
///  │ B5 62│ 05 01 02 00                       │ 06 01        │ 0F 38    │            │          │
///  └──────┴───────────────────────────────────┴──────────────┴──────────┴────────────┴──────────┘
/// ```
///
/// A place in a frame is a number: 0 is the first byte, 1 the second; -1 is the last, -2 the one before it. What
/// is appended is behind the last.
///
/// Whatever stands in a layout, it keeps the laws of [`Format`](framelock::Format) and nothing panics (theorem
/// 13g): a layout that contradicts itself finds no frames, or too few.
///
/// # Examples
/// `'A' 'B' length payload crc8`, with up to 16 bytes of payload:
/// ```
/// use framelock::{BufferedReceiver, Format, Classification};
/// use framelock_formats::layout::*;
///
/// const SHORT: Layout = Layout {
///     sync: Patterns::one(b"AB"),
///     length: Length::Field(LengthField { plus: 4, ..LengthField::byte(2) }),
///     shortest: 4,
///     longest: 20,
///     checksum: Some(Checksum {
///         algorithm: Algorithm::Crc(Crc { width: 8, polynomial: 0x07, ..Crc::ZERO }),
///         ..Checksum::at_the_end(1)
///     }),
///     ..Layout::NONE
/// };
///
/// #[derive(Clone, Copy)]
/// struct Short;
///
/// impl Format for Short {
///     framelock_formats::classify_by!(SHORT);
///     type Message<'a> = &'a [u8];
///
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
///         &frame[3..frame.len() - 1]
///     }
/// }
///
/// let mut frame = *b"AB\x05hello\0";
/// assert!(SHORT.seal(&mut frame));
/// let mut receiver = BufferedReceiver::<_, [u8; 40]>::new(Short);
/// let mut received = Vec::new();
/// for &byte in [b"AB\x09noise", &frame[..]].concat().iter() {
///     received.extend(receiver.push(byte).map(|frame| frame.message().to_vec()));
/// }
/// assert_eq!(received, [b"hello"]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Layout<'a> {
    /// What a frame begins with.
    pub sync: Patterns<'a>,
    /// What says how long a frame is.
    pub length: Length,
    /// Bytes in the shortest frame.
    pub shortest: usize,
    /// Bytes in the longest frame. It bounds memory, and how late a frame may come behind a false beginning.
    pub longest: usize,
    /// Bits that are the same in each frame, besides the sync and the terminator.
    pub fixed: &'a [FixedBits],
    /// Which messages there are, if a frame of another is none.
    pub messages: Option<Messages<'a>>,
    /// The checksum.
    pub checksum: Option<Checksum<'a>>,
    /// What a frame ends with; if it has no length, it ends where the first of these is.
    pub terminator: Patterns<'a>,
    /// What is behind some frames.
    pub appendix: Option<Appendix>,
}

impl Layout<'_> {
    /// Nothing at all, to begin with: it finds no frames.
    pub const NONE: Self = Self {
        sync: Patterns::NONE,
        length: Length::Fixed,
        shortest: 0,
        longest: 0,
        fixed: &[],
        messages: None,
        checksum: None,
        terminator: Patterns::NONE,
        appendix: None,
    };
}

/// Where in a frame of that length a place is, counted from the front; nothing if it would be in front of it.
#[inline]
#[must_use]
pub fn index(place: i16, length: usize) -> Option<usize> {
    let distance = usize::from(place.unsigned_abs());
    if place < 0 {
        length.checked_sub(distance)
    } else {
        Some(distance)
    }
}

/// What a frame begins or ends with: some bytes, or one of several sequences of the same length.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Patterns<'a> {
    /// All of them, one behind the other.
    pub bytes: &'a [u8],
    /// Bytes in each.
    pub length: usize,
}

impl<'a> Patterns<'a> {
    /// Nothing: a frame may begin, or end, with any bytes.
    pub const NONE: Self = Self::one(&[]);

    /// These bytes.
    #[must_use]
    pub const fn one(bytes: &'a [u8]) -> Self {
        let length = bytes.len();
        Self { bytes, length }
    }

    /// Any one of these bytes.
    #[must_use]
    pub const fn any_byte_of(bytes: &'a [u8]) -> Self {
        Self { bytes, length: 1 }
    }

    /// Each of them.
    pub fn each(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        self.bytes.chunks_exact(self.length.max(1))
    }
}

/// What says how long a frame is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Length {
    /// Each has [`longest`](Layout::longest) bytes.
    Fixed,
    /// A number in its header.
    Field(LengthField),
    /// The first terminator behind the sync is its end.
    Delimiter,
}

/// A number in the header that tells a frame's length: `(number & mask) * factor + plus` bytes, all of
/// the frame counted but what is appended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LengthField {
    /// Where it is and how it is written.
    pub number: Number,
    /// Which of its bits count.
    pub mask: u32,
    /// Bytes for each one of it.
    pub factor: u32,
    /// What is to be added: the bytes that it does not count, or less than nothing.
    pub plus: i32,
}

impl LengthField {
    /// One byte, the number of all bytes of a frame.
    #[must_use]
    pub const fn byte(at: usize) -> Self {
        Self {
            number: Number::byte(at),
            mask: u32::MAX,
            factor: 1,
            plus: 0,
        }
    }
}

/// A number without sign in the header.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Number {
    /// The place of its first byte, counted from the front.
    pub at: usize,
    /// How many bytes it has, 1 to 4.
    pub bytes: usize,
    /// Which of them comes first.
    pub order: ByteOrder,
}

impl Number {
    /// One byte.
    #[must_use]
    pub const fn byte(at: usize) -> Self {
        let (bytes, order) = (1, ByteOrder::Little);
        Self { at, bytes, order }
    }

    /// Where it ends.
    #[must_use]
    pub const fn end(&self) -> usize {
        self.at.saturating_add(self.bytes)
    }
}

/// Which byte of a number comes first.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ByteOrder {
    /// The lowest.
    Little,
    /// The highest.
    Big,
}

/// Bits of one byte that are the same in each frame.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FixedBits {
    /// The byte's place. In the header it is looked at before the rest of the frame is there.
    pub at: i16,
    /// Which of its bits.
    pub mask: u8,
    /// What they are.
    pub value: u8,
}

/// The messages of a protocol, by a number in the header.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Messages<'a> {
    /// The number.
    pub number: Number,
    /// What there is, by rising numbers: what is out of order may not be found.
    pub known: &'a [Message],
}

/// A message.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Message {
    /// Its number.
    pub number: u32,
    /// The most that the length field says, without what its mask leaves out.
    pub most: u16,
    /// A byte that the checksum covers at the end, though it is not sent: MAVLink's `CRC_EXTRA`.
    pub extra: u8,
    /// Whether it does.
    pub has_extra: bool,
}

impl Message {
    /// One whose checksum covers an extra byte.
    #[must_use]
    pub const fn with_extra(number: u32, extra: u8, most: u8) -> Self {
        Self {
            number,
            most: most as u16,
            extra,
            has_extra: true,
        }
    }
}

/// Bytes behind some frames, which neither the length nor the checksum counts: MAVLink's signature.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Appendix {
    /// The place of the byte, counted from the front, that says whether they are there.
    pub at: usize,
    /// They are if any of these bits is set.
    pub mask: u8,
    /// How many.
    pub bytes: usize,
}

/// A checksum in a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Checksum<'a> {
    /// How it is computed.
    pub algorithm: Algorithm<'a>,
    /// How many bytes of it are kept, 1 to 4: the lowest.
    pub bytes: usize,
    /// How they are written.
    pub written: Written,
    /// Where they are.
    pub at: i16,
    /// The first byte that it covers.
    pub from: i16,
    /// The last.
    pub to: i16,
}

impl Checksum<'_> {
    /// A sum of the whole frame in front of it, in so many bytes at the end of the frame, the lowest first.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "there are 4 at most"
    )]
    pub const fn at_the_end(bytes: usize) -> Self {
        let at = (bytes as i16).wrapping_neg();
        Self {
            algorithm: Algorithm::Sum,
            bytes,
            written: Written::Little,
            at,
            from: 0,
            to: at.wrapping_sub(1),
        }
    }
}

/// How a checksum is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Written {
    /// As a number, the lowest byte first.
    Little,
    /// As a number, the highest byte first.
    Big,
    /// As text: two hexadecimal digits for each byte, the highest first; written in capitals, read in either.
    Hex,
}

/// How a checksum is computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Algorithm<'a> {
    /// A cyclic redundancy check.
    Crc(Crc<'a>),
    /// The bytes added up.
    Sum,
    /// All bits of the sum inverted: 0xFFFF - sum, in two bytes.
    InvertedSum,
    /// What makes the sum zero.
    NegatedSum,
    /// The exclusive or of the bytes.
    Xor,
    /// Two sums of 8 bits: the second adds up what the first has been. The first is the low byte.
    Fletcher,
}

/// A cyclic redundancy check of 8 to 32 bits, by the parameters that the catalogue at
/// <https://reveng.sourceforge.io/crc-catalogue> has for each.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Crc<'a> {
    /// Bits.
    pub width: u32,
    /// The polynomial without its highest power: `poly`.
    pub polynomial: u32,
    /// What the register begins with: `init`.
    pub initial: u32,
    /// Whether bytes are taken from their lowest bit on: `refin`.
    pub reflected_in: bool,
    /// Whether the lowest bit of the result comes first: `refout`.
    pub reflected_out: bool,
    /// What the result is xored with: `xorout`.
    pub xor_out: u32,
    /// What each byte makes of the register: more flash, less time.
    pub table: Table<'a>,
}

impl Crc<'_> {
    /// No polynomial, and zeros: to name only what differs.
    pub const ZERO: Self = Self {
        width: 8,
        polynomial: 0,
        initial: 0,
        reflected_in: false,
        reflected_out: false,
        xor_out: 0,
        table: Table::None,
    };
}

/// What each byte makes of a CRC's register. [`Crc::table_of_bytes`] and its like compute it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Table<'a> {
    /// Bit by bit.
    None,
    /// Of a CRC of 8 bits: 256 bytes.
    Bytes(&'a [u8; 256]),
    /// Of any: 1 KiB.
    Words(&'a [u32; 256]),
    /// Of any, sixteen bytes at once: 16 KiB, for a PC.
    Sixteens(&'a [[u32; 256]; 16]),
}
