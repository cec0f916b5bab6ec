//! The layout of a protocol's frames. In Rust a layout is a constant. For the command line, a TOML file describes it.

mod builder;
pub(crate) mod check;
mod checksum;
mod contradiction;
mod parts;

pub use builder::LayoutBuilder;
pub use checksum::{Algorithm, Checksum, Crc, Encoding, Table};
pub use contradiction::{Contradiction, Part};
pub use parts::{
    ByteOrder, FixedBits, KnownMessage, Length, LengthField, Messages, Number, Patterns, Trailer,
};

/// The layout of a protocol's frames. It contains all that is needed to find, check and write frames.
///
/// ```text
///   sync   header: length, message, fixed bits     payload     checksum   terminator   trailer
///  ┌──────┬───────────────────────────────────┬──────────────┬──────────┬────────────┬──────────┐
///  │ B5 62│ 05 01 02 00                       │ 06 01        │ 0F 38    │            │          │
///  └──────┴───────────────────────────────────┴──────────────┴──────────┴────────────┴──────────┘
/// ```
///
/// An *offset* states the position of a byte in a frame: 0 is the first byte, 1 the second, -1 the last, -2 the second
/// to last. Offsets do not count the trailer, so -1 is the last byte before the trailer.
///
/// A [builder](Self::builder) creates and checks a layout. If the parts contradict each other, a constant layout does
/// not compile, and a builder at run time returns an error. Every layout keeps the laws of
/// [`Format`](framelock::Format) (theorem 13g).
///
/// # Examples
/// `'A' 'B' length payload crc8`, with up to 16 bytes of payload:
/// ```
/// use framelock::{BufferedReceiver, Format, Classification};
/// use framelock_formats::layout::*;
///
/// const SHORT: Layout = Layout::builder()
///     .sync(Patterns::one(b"AB"))
///     .length(Length::Field(LengthField::byte(2).plus(4)))
///     .longest(20)
///     .checksum(Checksum::at_the_end(1).algorithm(Algorithm::Crc(Crc::new(8, 0x07))))
///     .build_const();
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
///
/// A layout with a CRC of more than 32 bits does not compile:
/// ```compile_fail,E0080
/// use framelock_formats::layout::*;
///
/// const SHORT: Layout = Layout::builder()
///     .sync(Patterns::one(b"AB"))
///     .longest(20)
///     .checksum(Checksum::at_the_end(4).algorithm(Algorithm::Crc(Crc::new(33, 0x07))))
///     .build_const();
/// # let _ = SHORT;
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Layout<'a> {
    pub(crate) sync: Patterns<'a>,
    pub(crate) length: Length,
    pub(crate) shortest: usize,
    pub(crate) longest: usize,
    pub(crate) fixed: &'a [FixedBits],
    pub(crate) messages: Option<Messages<'a>>,
    pub(crate) checksum: Option<Checksum<'a>>,
    pub(crate) terminator: Patterns<'a>,
    pub(crate) content: &'a [(u8, u8)],
    pub(crate) other_terminators: &'a [&'a [u8]],
    pub(crate) trailer: Option<Trailer>,
}

impl<'a> Layout<'a> {
    /// Returns a builder of a layout that has no parts yet.
    #[inline]
    pub const fn builder() -> LayoutBuilder<'a> {
        LayoutBuilder::new()
    }

    /// Returns a builder that starts with the parts of this layout.
    #[inline]
    pub const fn to_builder(self) -> LayoutBuilder<'a> {
        LayoutBuilder::from_layout(&self)
    }

    /// Returns the bytes that a frame begins with.
    #[inline]
    #[must_use]
    pub const fn sync(&self) -> Patterns<'a> {
        self.sync
    }

    /// Returns the part that determines the length of a frame.
    #[inline]
    #[must_use]
    pub const fn length(&self) -> Length {
        self.length
    }

    /// Returns the number of bytes in the shortest frame.
    #[inline]
    #[must_use]
    pub const fn shortest(&self) -> usize {
        self.shortest
    }

    /// Returns the number of bytes in the longest frame, including its trailer.
    #[inline]
    #[must_use]
    pub const fn longest(&self) -> usize {
        self.longest
    }

    /// Returns the number of bytes in the longest frame that has no trailer.
    #[must_use]
    pub const fn longest_without_trailer(&self) -> usize {
        check::without_trailer(self)
    }

    /// Returns the fixed bits: the bits outside the sync and the terminator that are the same in every frame.
    #[inline]
    #[must_use]
    pub const fn fixed(&self) -> &'a [FixedBits] {
        self.fixed
    }

    /// Returns the known messages, or `None` if the layout does not restrict the messages.
    #[inline]
    #[must_use]
    pub const fn messages(&self) -> Option<Messages<'a>> {
        self.messages
    }

    /// Returns the checksum.
    #[inline]
    #[must_use]
    pub const fn checksum(&self) -> Option<Checksum<'a>> {
        self.checksum
    }

    /// Returns the bytes that a frame ends with.
    #[inline]
    #[must_use]
    pub const fn terminator(&self) -> Patterns<'a> {
        self.terminator
    }

    /// Returns the bytes that are allowed between the sync and the terminator, as inclusive ranges. If there are no
    /// ranges, any byte is allowed.
    #[inline]
    #[must_use]
    pub const fn content(&self) -> &'a [(u8, u8)] {
        self.content
    }

    /// Returns the other terminators that a frame may end with. They may have different lengths.
    #[inline]
    #[must_use]
    pub const fn other_terminators(&self) -> &'a [&'a [u8]] {
        self.other_terminators
    }

    /// Returns the trailer: the bytes that follow some frames.
    #[inline]
    #[must_use]
    pub const fn trailer(&self) -> Option<Trailer> {
        self.trailer
    }

    /// Returns the length from which negative offsets in this frame count back. This is the frame's length, unless the
    /// frame ends with one of the [`other_terminators`](Self::other_terminators). Then it is the length that the frame
    /// would have if it ended with the [`terminator`](Self::terminator) instead.
    #[inline(always)]
    #[must_use]
    pub fn counted_length(&self, frame: &[u8]) -> usize {
        let others = self.other_terminators.iter().copied();
        // Take the longest terminator that fits, because a shorter terminator may be the end of a longer terminator.
        let ends = self.terminator.each().chain(others);
        let ends = ends.filter(|end| {
            let mut both = end.iter().rev().zip(frame.iter().rev());
            end.len() <= frame.len() && both.all(|(wanted, byte)| wanted == byte)
        });
        let ends = ends.map(<[u8]>::len);
        let end = match self.other_terminators {
            [] => None,
            _ => ends.max(),
        };
        match end {
            Some(end) => frame
                .len()
                .wrapping_sub(end)
                .wrapping_add(self.terminator.length),
            None => frame.len(),
        }
    }

    /// Returns the number of bytes in the header, at least one. The header determines the length of the frame, unless a
    /// delimiter ends the frame.
    #[inline(always)]
    #[must_use]
    pub const fn header(&self) -> usize {
        let mut header = larger(self.sync.length, 1);
        if let Length::Field(field) = &self.length {
            header = larger(header, field.number.end());
        }
        if let Some(messages) = &self.messages {
            header = larger(header, messages.number.end());
        }
        if let Some(trailer) = &self.trailer {
            header = larger(header, trailer.at.saturating_add(1));
        }
        header
    }
}

/// Returns the index of the byte at an offset in a frame of `length` bytes; `None` if a negative offset refers to a
/// position before the first byte.
#[inline]
#[must_use]
pub const fn index(place: i16, length: usize) -> Option<usize> {
    let distance = place.unsigned_abs() as usize;
    if place < 0 {
        length.checked_sub(distance)
    } else {
        Some(distance)
    }
}

#[inline(always)]
const fn larger(a: usize, b: usize) -> usize {
    if a < b { b } else { a }
}
