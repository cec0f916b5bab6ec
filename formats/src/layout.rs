//! The layout of a protocol's frames: in Rust usually a constant, and for the command line a TOML file.

pub(crate) mod check;
mod checksum;
mod parts;

use core::ops::Deref;

use check::least;
pub use check::{Contradiction, Part};
pub use checksum::{Algorithm, Checksum, Crc, Encoding, Table};
pub use parts::{
    ByteOrder, FixedBits, KnownMessage, Length, LengthField, Messages, Number, Patterns, Trailer,
};

/// The layout of a protocol's frames: all that is needed to find, check and write frames, as plain data.
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
/// Give the parts that the frames have, and take the others from [`Layout::NONE`]. [`checked`](Self::checked) checks a
/// constant: if its parts contradict each other, the program does not compile. [`check`](Self::check) checks a layout
/// at run time. Only a [`CheckedLayout`] can receive and write frames.
///
/// # Examples
/// `'A' 'B' length payload crc8`, with up to 16 bytes of payload:
/// ```
/// use framelock::{BufferedReceiver, Format, Classification};
/// use framelock_formats::layout::*;
///
/// const SHORT: CheckedLayout = Layout {
///     sync: Patterns::one(b"AB"),
///     length: Length::Field(LengthField { plus: 4, ..LengthField::byte(2) }),
///     longest: 20,
///     checksum: Some(Checksum {
///         algorithm: Algorithm::Crc(Crc::new(8, 0x07)),
///         ..Checksum::at_the_end(1)
///     }),
///     ..Layout::NONE
/// }
/// .checked();
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
/// const SHORT: CheckedLayout = Layout {
///     sync: Patterns::one(b"AB"),
///     longest: 20,
///     checksum: Some(Checksum {
///         algorithm: Algorithm::Crc(Crc::new(33, 0x07)),
///         ..Checksum::at_the_end(4)
///     }),
///     ..Layout::NONE
/// }
/// .checked();
/// # let _ = SHORT;
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Layout<'a> {
    /// The bytes that a frame begins with.
    pub sync: Patterns<'a>,
    /// The part that determines the length of a frame.
    pub length: Length,
    /// The number of bytes in the shortest frame. If it is 0, a frame may be as short as its parts allow.
    pub shortest: usize,
    /// The number of bytes in the longest frame, including its trailer. This number determines the size of the buffer,
    /// and how long a false start can delay the next frame.
    pub longest: usize,
    /// The fixed bits: the bits outside the sync and the terminator that are the same in every frame.
    pub fixed: &'a [FixedBits],
    /// The known messages. Frames of other messages are rejected. `None` does not restrict the messages.
    pub messages: Option<Messages<'a>>,
    /// The checksum.
    pub checksum: Option<Checksum<'a>>,
    /// The bytes that a frame ends with.
    pub terminator: Patterns<'a>,
    /// The number of bytes after the terminator that belong to the frame, such as a checksum. Only frames that end with a
    /// delimiter can have them. Offsets from the end count these bytes, so -1 is the last of them.
    pub behind: usize,
    /// The bytes that are allowed between the sync and the terminator, as inclusive ranges. If there are no ranges, any
    /// byte is allowed. Use ranges only for frames that end with a delimiter. A byte outside the ranges must begin a
    /// terminator. Otherwise the frame is rejected immediately. The check is fastest if the widest range comes first.
    ///
    /// # Examples
    /// Lines of printable characters except `#`:
    /// ```
    /// use framelock::{Classification, DiscardReason};
    /// use framelock_formats::layout::{CheckedLayout, Layout, Length, Patterns};
    ///
    /// const LINE: CheckedLayout = Layout {
    ///     sync: Patterns::one(b"#"),
    ///     length: Length::Delimiter,
    ///     longest: 80,
    ///     content: &[(b' ', b'"'), (b'$', b'~')],
    ///     terminator: Patterns::one(b"\r\n"),
    ///     other_terminators: [Patterns::one(b"\n"), Patterns::NONE],
    ///     ..Layout::NONE
    /// }
    /// .checked();
    /// assert_eq!(LINE.classify(b"#abc\n"), Classification::Frame(5));
    /// assert_eq!(LINE.classify(b"#ab#"), Classification::Rejected(DiscardReason::WrongTerminator));
    /// ```
    pub content: &'a [(u8, u8)],
    /// Terminators of other lengths, for frames with a `content`. Offsets from the end and `shortest` are counted as if
    /// each frame ended with the `terminator`. [`seal`](CheckedLayout::seal) writes the `terminator`, never one of the
    /// other terminators.
    pub other_terminators: [Patterns<'a>; 2],
    /// The trailer: the bytes that follow some frames.
    pub trailer: Option<Trailer>,
}

/// A layout whose parts agree. It finds, checks and writes frames.
///
/// [`Layout::checked`] and [`Layout::check`] return it. Every checked layout keeps the laws of
/// [`Format`](framelock::Format). Its parts are those of the [`Layout`] that it dereferences to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CheckedLayout<'a>(pub(crate) Layout<'a>);

impl<'a> Deref for CheckedLayout<'a> {
    type Target = Layout<'a>;

    #[inline(always)]
    fn deref(&self) -> &Layout<'a> {
        &self.0
    }
}

impl<'a> CheckedLayout<'a> {
    /// Returns the parts. In a constant, use this function to change some of them:
    /// ```
    /// use framelock_formats::layout::{CheckedLayout, Layout};
    /// use framelock_formats::ubx;
    ///
    /// const SHORT_UBX: CheckedLayout = Layout { longest: 100, ..ubx::LAYOUT.layout() }.checked();
    /// ```
    #[inline]
    #[must_use]
    pub const fn layout(&self) -> Layout<'a> {
        self.0
    }
}

impl<'a> Layout<'a> {
    /// A layout without parts. Add at least [`longest`](Self::longest), and a part that tells frames from noise.
    pub const NONE: Self = Self {
        sync: Patterns::NONE,
        length: Length::Fixed,
        shortest: 0,
        longest: 0,
        fixed: &[],
        messages: None,
        checksum: None,
        terminator: Patterns::NONE,
        behind: 0,
        content: &[],
        other_terminators: [Patterns::NONE; 2],
        trailer: None,
    };

    /// Checks that the parts agree. The checked layout has a [`shortest`](Self::shortest) that is not 0.
    ///
    /// # Errors
    /// Returns the first contradiction between the parts.
    ///
    /// # Examples
    /// ```
    /// use framelock_formats::layout::{Layout, Length, LengthField, Part, Patterns};
    ///
    /// let layout = |longest| Layout {
    ///     sync: Patterns::one(b"$"),
    ///     length: Length::Field(LengthField::byte(1)),
    ///     shortest: 40,
    ///     longest,
    ///     ..Layout::NONE
    /// };
    /// assert!(layout(60).check().is_ok());
    ///
    /// let contradiction = layout(20).check().expect_err("40 is more than 20");
    /// assert_eq!(contradiction.part, Part::Longest);
    /// assert!(contradiction.message.starts_with("longest: it is less than shortest"));
    /// ```
    pub const fn check(mut self) -> Result<CheckedLayout<'a>, Contradiction> {
        if self.shortest == 0 {
            self.shortest = match self.length {
                Length::Fixed => self.longest,
                _ => larger(least(&self), 1),
            };
        }
        match check::check(&self) {
            Ok(()) => Ok(CheckedLayout(self)),
            Err(contradiction) => Err(contradiction),
        }
    }

    /// Checks a constant: if the parts contradict each other, the program does not compile.
    ///
    /// # Panics
    /// Panics if the parts contradict each other. At run time, use [`check`](Self::check), which returns an error
    /// instead.
    #[must_use]
    pub const fn checked(self) -> CheckedLayout<'a> {
        match self.check() {
            Ok(layout) => layout,
            #[expect(clippy::panic, reason = "in a constant this is a compile error")]
            Err(contradiction) => panic!("{}", contradiction.message),
        }
    }

    /// Returns the number of bytes that a receiver must be able to hold: the number of bytes in the longest frame. If
    /// silence ends the frames, it is one more, because one more byte shows that a frame is too long.
    #[inline]
    #[must_use]
    pub const fn most_bytes(&self) -> usize {
        match self.length {
            Length::Silence => self.longest.saturating_add(1),
            _ => self.longest,
        }
    }

    /// Returns the number of bytes in the longest frame that has no trailer.
    #[must_use]
    pub const fn longest_without_trailer(&self) -> usize {
        check::without_trailer(self)
    }

    /// Returns an iterator over all terminators. The patterns of [`terminator`](Self::terminator) come first.
    #[inline(always)]
    pub fn terminators(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let [other, another] = &self.other_terminators;
        let others = other.each().chain(another.each());
        self.terminator.each().chain(others)
    }

    /// Returns the index of the [`terminator`](Self::terminator) in a frame of `length` bytes that ends with it.
    #[must_use]
    pub const fn terminator_at(&self, length: usize) -> usize {
        let end = self.terminator.length.saturating_add(self.behind);
        length.saturating_sub(end)
    }

    #[inline(always)]
    const fn has_other_terminators(&self) -> bool {
        let [other, another] = &self.other_terminators;
        other.length | another.length != 0
    }

    /// Returns true if a frame may contain this byte between its sync and its terminator.
    #[must_use]
    pub fn is_content(&self, byte: u8) -> bool {
        self.content.is_empty() || is_within(self.content, byte)
    }

    /// Returns the length from which negative offsets in this frame count back. This is the frame's length, unless the
    /// frame ends with one of the [`other_terminators`](Self::other_terminators). Then it is the length that the frame
    /// would have if it ended with the [`terminator`](Self::terminator) instead.
    #[inline(always)]
    #[must_use]
    pub fn counted_length(&self, frame: &[u8]) -> usize {
        if self.has_other_terminators() {
            self.length_with_own_terminator(frame)
        } else {
            frame.len()
        }
    }

    // Few layouts need this function, and only once for each frame.
    #[cold]
    fn length_with_own_terminator(&self, frame: &[u8]) -> usize {
        // Take the longest terminator that fits, because a shorter terminator may be the end of a longer terminator.
        let ends = self.terminators().filter(|end| {
            let mut both = end.iter().rev().zip(frame.iter().rev());
            end.len() <= frame.len() && both.all(|(wanted, byte)| wanted == byte)
        });
        match ends.map(<[u8]>::len).max() {
            Some(end) => frame
                .len()
                .wrapping_sub(end)
                .wrapping_add(self.terminator.length),
            None => frame.len(),
        }
    }

    /// Returns the number of bytes in the header, at least one. The header determines the length of the frame, unless a
    /// delimiter or silence ends the frame.
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

/// Returns true if the byte is in one of the ranges.
#[inline(always)]
pub(crate) fn is_within(ranges: &[(u8, u8)], byte: u8) -> bool {
    let mut ranges = ranges.iter();
    ranges.any(|&(first, last)| first <= byte && byte <= last)
}

#[inline(always)]
const fn larger(a: usize, b: usize) -> usize {
    if a < b { b } else { a }
}
