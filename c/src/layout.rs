//! What a frame looks like, as C writes it down.

use core::mem::offset_of;

use framelock_formats::layout::{
    Algorithm, Appendix, ByteOrder, Checksum, Crc, FixedBits, Layout, Length, LengthField, Message,
    Messages, Number, Patterns, Table, Written,
};

use crate::layout::framelock_shipped_layout as Shipped;
use crate::memory::{bytes, values};

/// What a frame looks like. What you leave out is 0, and means that there is none.
///
/// A place in a frame is a number: 0 is the first byte, 1 the second; -1 is the last, -2 the one before it.
#[repr(C)]
pub struct framelock_layout {
    /// What a frame begins with.
    pub sync: framelock_patterns,
    /// What tells how long a frame is.
    pub length: framelock_length,
    /// Bytes in the shortest frame.
    pub shortest: usize,
    /// Bytes in the longest frame. It bounds memory, and how late a frame may come behind a false beginning.
    pub longest: usize,
    /// Bits that are the same in each frame, besides sync and terminator.
    pub fixed: *const framelock_fixed_bits,
    /// How many there are at `fixed`.
    pub fixed_count: usize,
    /// Which messages there are, if a frame of another is none.
    pub messages: framelock_messages,
    /// The checksum.
    pub checksum: framelock_checksum,
    /// What a frame ends with.
    pub terminator: framelock_patterns,
    /// What is behind some frames.
    pub appendix: framelock_appendix,
    /// NULL in yours. In the library's own layouts the rest of them: there, `longest` alone is yours to change.
    pub shipped: Option<&'static framelock_shipped_layout>,
}

/// What one of the library's own layouts is.
pub struct framelock_shipped_layout(pub(crate) Layout<'static>);

/// What a frame begins or ends with: some bytes, or one of several sequences of the same length.
#[repr(C)]
pub struct framelock_patterns {
    /// All sequences, one behind the other.
    pub bytes: *const u8,
    /// Bytes in each.
    pub length: usize,
    /// How many sequences there are.
    pub count: usize,
}

/// What tells a frame's length.
pub type framelock_length_kind = u8;
/// Each frame has `longest` bytes.
pub const FRAMELOCK_FIXED_LENGTH: framelock_length_kind = 0;
/// A number in the header.
pub const FRAMELOCK_LENGTH_FIELD: framelock_length_kind = 1;
/// The first terminator behind the sync is the end.
pub const FRAMELOCK_DELIMITER: framelock_length_kind = 2;

/// What tells a frame's length; a number says that it has `(number & mask) * factor + plus` bytes, without what
/// is appended.
#[repr(C)]
pub struct framelock_length {
    /// One of the constants below.
    pub kind: framelock_length_kind,
    /// The number.
    pub number: framelock_number,
    /// Which of its bits count. 0: all.
    pub mask: u32,
    /// Bytes for each one of it. 0: one.
    pub factor: u32,
    /// What is to be added: the bytes that it does not count, or less than nothing.
    pub plus: i32,
}

/// A number without sign in the header.
#[repr(C)]
pub struct framelock_number {
    /// The place of its first byte, counted from the front.
    pub at: usize,
    /// How many bytes it has, 1 to 4.
    pub bytes: u8,
    /// Whether the highest comes first.
    pub big_endian: bool,
}

/// Bits of one byte that are the same in each frame.
#[repr(C)]
pub struct framelock_fixed_bits {
    /// The byte's place.
    pub at: i16,
    /// Which of its bits.
    pub mask: u8,
    /// What they are.
    pub value: u8,
}

const _: () = assert!(
    size_of::<framelock_fixed_bits>() == size_of::<FixedBits>()
        && offset_of!(framelock_fixed_bits, at) == offset_of!(FixedBits, at)
        && offset_of!(framelock_fixed_bits, mask) == offset_of!(FixedBits, mask)
        && offset_of!(framelock_fixed_bits, value) == offset_of!(FixedBits, value),
    "they are used as those of Rust"
);

/// The messages of a protocol, by a number in the header.
#[repr(C)]
pub struct framelock_messages {
    /// The number.
    pub number: framelock_number,
    /// What there is, by rising numbers: what is out of order may not be found.
    pub known: *const framelock_message,
    /// How many there are at `known`. 0: frames of any message.
    pub count: usize,
    /// Whether the checksum covers each message's `extra`.
    pub has_extra: bool,
}

/// A message.
#[repr(C)]
pub struct framelock_message {
    /// Its number.
    pub number: u32,
    /// The most that the length field says, without what its mask leaves out.
    pub most: u16,
    /// A byte that the checksum covers at the end, though it is not sent: MAVLink's `CRC_EXTRA`.
    pub extra: u8,
}

/// How a checksum is computed.
pub type framelock_algorithm = u8;
/// There is no checksum.
pub const FRAMELOCK_NO_CHECKSUM: framelock_algorithm = 0;
/// A cyclic redundancy check.
pub const FRAMELOCK_CRC: framelock_algorithm = 1;
/// The bytes added up.
pub const FRAMELOCK_SUM: framelock_algorithm = 2;
/// All bits of the sum inverted: 0xFFFF - sum, in two bytes.
pub const FRAMELOCK_INVERTED_SUM: framelock_algorithm = 3;
/// What makes the sum zero.
pub const FRAMELOCK_NEGATED_SUM: framelock_algorithm = 4;
/// The exclusive or of the bytes.
pub const FRAMELOCK_XOR: framelock_algorithm = 5;
/// Two sums of 8 bits: the second adds up what the first has been. The first is the low byte.
pub const FRAMELOCK_FLETCHER: framelock_algorithm = 6;

/// How a checksum is written.
pub type framelock_written = u8;
/// As a number, the lowest byte first.
pub const FRAMELOCK_LITTLE_ENDIAN: framelock_written = 0;
/// As a number, the highest byte first.
pub const FRAMELOCK_BIG_ENDIAN: framelock_written = 1;
/// As two hexadecimal digits for each byte, the highest first; read in capitals or not.
pub const FRAMELOCK_HEX: framelock_written = 2;

/// A checksum in a frame.
#[repr(C)]
pub struct framelock_checksum {
    /// How it is computed.
    pub algorithm: framelock_algorithm,
    /// How it is written.
    pub written: framelock_written,
    /// How many bytes of it are kept, 1 to 4: the lowest.
    pub bytes: u8,
    /// Where they are.
    pub at: i16,
    /// The first byte that it covers.
    pub from: i16,
    /// The last.
    pub to: i16,
    /// The parameters of a CRC.
    pub crc: framelock_crc,
}

/// A CRC of 8 to 32 bits by its parameters, as <https://reveng.sourceforge.io/crc-catalogue> has them.
#[repr(C)]
pub struct framelock_crc {
    /// `width`.
    pub width: u8,
    /// `refin`.
    pub reflected_in: bool,
    /// `refout`.
    pub reflected_out: bool,
    /// `poly`.
    pub polynomial: u32,
    /// `init`.
    pub initial: u32,
    /// `xorout`.
    pub xor_out: u32,
}

/// Bytes behind some frames, which neither the length nor the checksum counts: MAVLink's signature.
#[repr(C)]
pub struct framelock_appendix {
    /// The place of the byte, counted from the front, that says whether they are there.
    pub at: usize,
    /// They are if any of these bits is set.
    pub mask: u8,
    /// How many.
    pub bytes: usize,
}

/// Makes `length` bytes a frame: writes sync, length, fixed bits, terminator and checksum, and leaves the rest as
/// it is. Of several syncs or terminators it writes the first, unless one is there. Set the bits that announce an
/// appendix before, and put it behind the frame.
///
/// Returns whether it is a frame then: not if no frame has so many bytes, there is no such message, a terminator
/// stands where none may, or the layout has something wrong.
#[unsafe(no_mangle)]
pub extern "C" fn framelock_seal(
    layout: Option<&framelock_layout>,
    frame: *mut u8,
    length: usize,
) -> bool {
    let (Some(layout), Some(frame)) = (layout, bytes(frame, length)) else {
        return false;
    };
    // The first time writes what of a message's number is fixed.
    (0..2).any(|_| {
        let message = layout.message(frame);
        let layout = layout.layout(message.as_slice());
        layout.is_some_and(|layout| layout.seal(frame))
    })
}

impl framelock_layout {
    /// What `ask` says of it, with no message but the one that `bytes` name; nothing if it has a pointer or a
    /// constant that cannot be.
    pub(crate) fn ask<T>(&self, bytes: &[u8], ask: impl FnOnce(&Layout) -> T) -> Option<T> {
        let message = self.message(bytes);
        self.layout(message.as_slice()).map(|layout| ask(&layout))
    }

    /// As Rust writes it, with these messages.
    #[inline(never)]
    fn layout<'a>(&self, known: &'a [Message]) -> Option<Layout<'a>> {
        if let Some(Shipped(shipped)) = self.shipped {
            let longest = self.longest;
            return Some(Layout {
                longest,
                ..*shipped
            });
        }
        let number = self.messages.number.number();
        self.messages.known()?;
        Some(Layout {
            sync: self.sync.patterns()?,
            length: self.length.length()?,
            shortest: self.shortest,
            longest: self.longest,
            fixed: values(self.fixed.cast(), self.fixed_count)?,
            messages: (self.messages.count > 0).then_some(Messages { number, known }),
            checksum: match self.checksum.algorithm {
                FRAMELOCK_NO_CHECKSUM => None,
                _ => Some(self.checksum.checksum()?),
            },
            terminator: self.terminator.patterns()?,
            appendix: Some(Appendix {
                at: self.appendix.at,
                mask: self.appendix.mask,
                bytes: self.appendix.bytes,
            }),
        })
    }

    /// The message of yours that these bytes name, if there is such a one.
    fn message(&self, bytes: &[u8]) -> Option<Message> {
        let Number {
            at,
            bytes: n,
            order,
        } = self.messages.number.number();
        let number = bytes.get(at..at.checked_add(n)?)?;
        let add = |number: u32, byte: &u8| number << 8 | u32::from(*byte);
        let number = match order {
            ByteOrder::Little => number.iter().rev().fold(0, add),
            ByteOrder::Big => number.iter().fold(0, add),
        };
        let known = self.messages.known()?;
        let place = known.binary_search_by_key(&number, |message| message.number);
        known.get(place.ok()?).map(|message| Message {
            number,
            extra: self.messages.has_extra.then_some(message.extra),
            most: message.most,
        })
    }
}

impl framelock_messages {
    fn known(&self) -> Option<&'static [framelock_message]> {
        values(self.known, self.count)
    }
}

impl framelock_patterns {
    fn patterns(&self) -> Option<Patterns<'static>> {
        let length = self.length;
        let bytes = values(self.bytes, self.count.checked_mul(length)?)?;
        Some(Patterns { bytes, length })
    }
}

impl framelock_length {
    fn length(&self) -> Option<Length> {
        Some(match self.kind {
            FRAMELOCK_FIXED_LENGTH => Length::Fixed,
            FRAMELOCK_LENGTH_FIELD => Length::Field(LengthField {
                number: self.number.number(),
                mask: if self.mask == 0 { u32::MAX } else { self.mask },
                factor: self.factor.max(1),
                plus: self.plus,
            }),
            FRAMELOCK_DELIMITER => Length::Delimiter,
            _ => return None,
        })
    }
}

impl framelock_number {
    fn number(&self) -> Number {
        let order = if self.big_endian {
            ByteOrder::Big
        } else {
            ByteOrder::Little
        };
        let (at, bytes) = (self.at, self.bytes.into());
        Number { at, bytes, order }
    }
}

impl framelock_checksum {
    fn checksum(&self) -> Option<Checksum<'static>> {
        Some(Checksum {
            algorithm: match self.algorithm {
                FRAMELOCK_CRC => Algorithm::Crc(self.crc.crc()),
                FRAMELOCK_SUM => Algorithm::Sum,
                FRAMELOCK_INVERTED_SUM => Algorithm::InvertedSum,
                FRAMELOCK_NEGATED_SUM => Algorithm::NegatedSum,
                FRAMELOCK_XOR => Algorithm::Xor,
                FRAMELOCK_FLETCHER => Algorithm::Fletcher,
                _ => return None,
            },
            written: match self.written {
                FRAMELOCK_LITTLE_ENDIAN => Written::Little,
                FRAMELOCK_BIG_ENDIAN => Written::Big,
                FRAMELOCK_HEX => Written::Hex,
                _ => return None,
            },
            bytes: self.bytes.into(),
            at: self.at,
            from: self.from,
            to: self.to,
        })
    }
}

impl framelock_crc {
    fn crc(&self) -> Crc<'static> {
        Crc {
            width: self.width.into(),
            polynomial: self.polynomial,
            initial: self.initial,
            reflected_in: self.reflected_in,
            reflected_out: self.reflected_out,
            xor_out: self.xor_out,
            table: Table::None,
        }
    }
}
