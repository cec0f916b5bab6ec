//! The parts of a layout, except the checksum.

/// The bytes that a frame begins or ends with: one sequence, or one of several sequences of the same length.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Patterns<'a> {
    /// All sequences, concatenated.
    pub bytes: &'a [u8],
    /// The number of bytes in each sequence.
    pub length: usize,
}

impl<'a> Patterns<'a> {
    /// No sequence: a frame may begin or end with any bytes.
    pub const NONE: Self = Self::one(&[]);

    /// Returns patterns with one sequence: these bytes.
    #[inline]
    #[must_use]
    pub const fn one(bytes: &'a [u8]) -> Self {
        Self::any_of(bytes, bytes.len())
    }

    /// Returns patterns with sequences of one byte each.
    #[inline]
    #[must_use]
    pub const fn any_byte_of(bytes: &'a [u8]) -> Self {
        Self::any_of(bytes, 1)
    }

    /// Returns patterns with sequences of `length` bytes each, which are concatenated in `bytes`.
    #[inline]
    #[must_use]
    pub const fn any_of(bytes: &'a [u8], length: usize) -> Self {
        Self { bytes, length }
    }

    /// Returns an iterator over the sequences.
    // Does not use `chunks_exact`, which contains a division.
    #[inline]
    pub fn each(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (mut rest, length) = (self.bytes, self.length.max(1));
        core::iter::from_fn(move || {
            let (one, others) = rest.split_at_checked(length)?;
            rest = others;
            Some(one)
        })
    }
}

/// The part that determines the length of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Length {
    /// Every frame has [`longest`](super::Layout::longest) bytes.
    Fixed,
    /// A number in the header.
    Field(LengthField),
    /// The first terminator after the sync ends the frame, together with the bytes [behind](super::Layout::behind) the
    /// terminator.
    Delimiter,
    /// The frame ends where the line falls silent: at a pause or a break. So report each pause to the receiver. The
    /// receiver then delivers only the longest frame that ends at the pause and begins after the previous line event. A
    /// framing, parity or overrun error never completes a frame.
    Silence,
}

/// A number in the header that determines the length of the frame: `value * factor + plus` bytes, without the trailer.
/// The value consists of the bits of the mask, shifted down to the lowest bit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LengthField {
    /// The number in the header.
    pub number: Number,
    /// The mask of the number's bits that are part of the length.
    pub mask: u32,
    /// The unit of the number, in bytes: for example 2 if the number counts 16-bit words.
    pub factor: u32,
    /// The correction in bytes, positive or negative: the number of bytes in the frame that the number does not count.
    pub plus: i32,
}

impl LengthField {
    /// Returns a length field whose number counts all bytes of a frame.
    #[inline]
    #[must_use]
    pub const fn new(number: Number) -> Self {
        Self {
            number,
            mask: u32::MAX,
            factor: 1,
            plus: 0,
        }
    }

    /// Returns a length field of one byte, which counts all bytes of a frame.
    #[inline]
    #[must_use]
    pub const fn byte(at: usize) -> Self {
        Self::new(Number::byte(at))
    }

    /// Returns the value of the length field in a number from a header.
    #[inline(always)]
    #[must_use]
    pub const fn value(&self, number: u32) -> u32 {
        (number & self.mask).wrapping_shr(self.mask.trailing_zeros())
    }
}

/// An unsigned number in the header.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Number {
    /// The offset of the number's first byte from the start of the frame.
    pub at: usize,
    /// The number of bytes in the number, 1 to 4.
    pub bytes: usize,
    /// The order of the number's bytes.
    pub order: ByteOrder,
}

impl Number {
    /// Returns a number of `bytes` bytes that begins at offset `at`.
    #[inline]
    #[must_use]
    pub const fn new(at: usize, bytes: usize, order: ByteOrder) -> Self {
        Self { at, bytes, order }
    }

    /// Returns a number of one byte.
    #[inline]
    #[must_use]
    pub const fn byte(at: usize) -> Self {
        Self::new(at, 1, ByteOrder::Little)
    }

    /// Returns the offset after the number's last byte.
    #[inline]
    #[must_use]
    pub const fn end(&self) -> usize {
        self.at.saturating_add(self.bytes)
    }
}

/// The order of a number's bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ByteOrder {
    /// The lowest byte comes first.
    Little,
    /// The highest byte comes first.
    Big,
}

/// Bits of one byte that are the same in every frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FixedBits {
    /// The offset of the byte. Bits in the header are checked before the rest of the frame has arrived.
    pub at: i16,
    /// The bits of the byte that are fixed.
    pub mask: u8,
    /// The values of these bits. All other bits of `value` must be 0.
    pub value: u8,
}

/// The known messages of a protocol, which a number in the header identifies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Messages<'a> {
    /// The number in the header.
    pub number: Number,
    /// The known messages, in ascending order of their numbers.
    pub known: &'a [KnownMessage],
}

/// A known message of a protocol.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KnownMessage {
    /// The message's number.
    pub number: u32,
    /// The greatest allowed value of the length field. In MAVLink this is the
    /// length of the longest payload.
    pub longest_payload: u16,
    /// A byte that the checksum covers after the frame's bytes, although it is not sent: MAVLink's `CRC_EXTRA`.
    pub extra: Option<u8>,
}

impl KnownMessage {
    /// Returns the message with this number. Its length field may have any value up to 65 535.
    #[inline]
    #[must_use]
    pub const fn new(number: u32) -> Self {
        Self {
            number,
            longest_payload: u16::MAX,
            extra: None,
        }
    }

    /// Returns a message whose checksum covers an extra byte.
    #[inline]
    #[must_use]
    pub const fn with_extra(number: u32, extra: u8, longest_payload: u8) -> Self {
        Self {
            number,
            longest_payload: longest_payload as u16,
            extra: Some(extra),
        }
    }
}

/// Bytes that follow some frames, such as MAVLink's signature. Neither the length field nor the checksum covers these
/// bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Trailer {
    /// The offset, from the start of the frame, of the byte that announces the trailer.
    pub at: usize,
    /// The mask of bits in that byte. Any of these bits announces the trailer.
    pub mask: u8,
    /// The number of bytes in the trailer.
    pub bytes: usize,
}
