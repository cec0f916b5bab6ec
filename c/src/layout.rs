//! What a frame looks like, as C writes it down.

use core::borrow::Borrow;
use core::mem::MaybeUninit;

use framelock_formats::layout::{
    Algorithm, ByteOrder, Checksum, Crc, Encoding, FixedBits, KnownMessage, Layout, Length,
    LengthField, Messages, Number, Patterns, Trailer,
};
use framelock_formats::motion::BIN;

use crate::layout::framelock_shipped_layout as Shipped;
use crate::memory::{Memory, as_rust, values, values_mut};

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

/// Room for a layout as a receiver asks it: made once, not for each byte.
#[repr(C)]
pub struct framelock_made_layout {
    opaque: [MaybeUninit<usize>; 40],
}

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

/// The messages of a protocol, by a number in the header.
#[repr(C)]
pub struct framelock_messages {
    /// The number.
    pub number: framelock_number,
    /// What there is, by rising numbers: what is out of order may not be found.
    pub known: *const framelock_message,
    /// How many there are at `known`. 0: frames of any message.
    pub count: usize,
}

/// Bits of one byte that are the same in each frame.
#[repr(C)]
pub struct framelock_fixed_bits {
    /// The byte's place. In the header it is looked at before the rest of the frame is there.
    pub at: i16,
    /// Which of its bits.
    pub mask: u8,
    /// What they are.
    pub value: u8,
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
    /// Whether it does.
    pub has_extra: bool,
}

/// Bytes behind some frames, which neither the length nor the checksum counts: MAVLink's signature.
#[repr(C)]
pub struct framelock_appendix {
    /// The place of the byte, counted from the front, that says whether they are there.
    pub at: usize,
    /// They are if any of these bits is set.
    pub mask: u8,
    /// How many. 0: none are.
    pub bytes: usize,
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
    let (Some(layout), Some(frame)) = (layout, values_mut(frame, length)) else {
        return false;
    };
    layout.layout().is_some_and(|layout| layout.seal(frame))
}

impl Memory for framelock_made_layout {
    type Value = Layout<'static>;
}

impl Borrow<Layout<'static>> for framelock_made_layout {
    fn borrow(&self) -> &Layout<'static> {
        // A receiver has no layouts but those that were made.
        self.value().unwrap_or(&BIN)
    }
}

impl framelock_layout {
    /// As Rust writes it; nothing if it has a pointer or a constant that cannot be, or contradicts itself.
    #[inline(never)]
    pub(crate) fn layout(&self) -> Option<Layout<'static>> {
        if let Some(Shipped(shipped)) = self.shipped {
            return shipped.to_builder().longest(self.longest).build().ok();
        }
        let known = as_rust(values(self.messages.known, self.messages.count)?);
        let mut builder = Layout::builder()
            .sync(self.sync.patterns()?)
            .length(self.length.length()?)
            .shortest(self.shortest)
            .longest(self.longest)
            .fixed(as_rust(values(self.fixed, self.fixed_count)?))
            .terminator(self.terminator.patterns()?);
        if !known.is_empty() {
            builder = builder.messages(Messages::new(self.messages.number.number(), known));
        }
        if self.checksum.algorithm != FRAMELOCK_NO_CHECKSUM {
            builder = builder.checksum(self.checksum.checksum()?);
        }
        let framelock_appendix { at, mask, bytes } = self.appendix;
        if bytes > 0 {
            builder = builder.trailer(Trailer::new(at, mask, bytes));
        }
        builder.build().ok()
    }
}

impl framelock_patterns {
    fn patterns(&self) -> Option<Patterns<'static>> {
        let length = self.length;
        let bytes = values(self.bytes, self.count.checked_mul(length)?)?;
        Some(if bytes.is_empty() {
            Patterns::NONE
        } else {
            Patterns::any_of(bytes, length)
        })
    }
}

impl framelock_length {
    fn length(&self) -> Option<Length> {
        Some(match self.kind {
            FRAMELOCK_FIXED_LENGTH => Length::Fixed,
            FRAMELOCK_LENGTH_FIELD => {
                let mask = if self.mask == 0 { u32::MAX } else { self.mask };
                let field = LengthField::new(self.number.number()).mask(mask);
                Length::Field(field.factor(self.factor.max(1)).plus(self.plus))
            }
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
        Number::new(self.at, self.bytes.into(), order)
    }
}

impl framelock_checksum {
    fn checksum(&self) -> Option<Checksum<'static>> {
        let algorithm = match self.algorithm {
            FRAMELOCK_CRC => Algorithm::Crc(self.crc.crc()),
            FRAMELOCK_SUM => Algorithm::Sum,
            FRAMELOCK_INVERTED_SUM => Algorithm::InvertedSum,
            FRAMELOCK_NEGATED_SUM => Algorithm::NegatedSum,
            FRAMELOCK_XOR => Algorithm::Xor,
            FRAMELOCK_FLETCHER => Algorithm::Fletcher,
            _ => return None,
        };
        let encoding = match self.written {
            FRAMELOCK_LITTLE_ENDIAN => Encoding::Little,
            FRAMELOCK_BIG_ENDIAN => Encoding::Big,
            FRAMELOCK_HEX => Encoding::Hex,
            _ => return None,
        };
        Some(
            Checksum::at_the_end(self.bytes.into())
                .algorithm(algorithm)
                .encoding(encoding)
                .at(self.at)
                .from(self.from)
                .to(self.to),
        )
    }
}

impl framelock_crc {
    fn crc(&self) -> Crc<'static> {
        Crc::new(self.width.into(), self.polynomial)
            .initial(self.initial)
            .reflected_in(self.reflected_in)
            .reflected_out(self.reflected_out)
            .xor_out(self.xor_out)
    }
}

crate::memory::same!(framelock_fixed_bits as FixedBits: at = at, mask = mask, value = value);
crate::memory::same!(framelock_message as KnownMessage:
    number = number, most = longest_payload, extra = extra, has_extra = has_extra);
