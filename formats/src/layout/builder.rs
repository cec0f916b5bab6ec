//! The builder of layouts.

use super::check::{check, least};
use super::{
    Checksum, Contradiction, FixedBits, Layout, Length, Messages, Patterns, Trailer, larger,
};

/// A builder of a [`Layout`]. Each setter replaces one part. [`build`](Self::build) checks that the parts agree.
///
/// # Examples
/// ```
/// use framelock_formats::layout::{Layout, Length, LengthField, Part, Patterns};
///
/// let builder = Layout::builder()
///     .sync(Patterns::one(b"$"))
///     .length(Length::Field(LengthField::byte(1)))
///     .shortest(40);
/// assert!(builder.longest(60).build().is_ok());
///
/// let contradiction = builder.longest(20).build().expect_err("40 is more than 20");
/// assert_eq!(contradiction.part(), Part::Longest);
/// assert!(contradiction.to_string().starts_with("longest: it is less than shortest"));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[must_use]
pub struct LayoutBuilder<'a>(Layout<'a>);

impl Default for LayoutBuilder<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a> LayoutBuilder<'a> {
    /// Returns a builder of a layout that has no parts yet.
    #[inline]
    pub const fn new() -> Self {
        Self(Layout {
            sync: Patterns::NONE,
            length: Length::Fixed,
            shortest: 0,
            longest: 0,
            fixed: &[],
            messages: None,
            checksum: None,
            terminator: Patterns::NONE,
            content: &[],
            other_terminators: &[],
            trailer: None,
        })
    }

    #[inline]
    pub(super) const fn from_layout(layout: &Layout<'a>) -> Self {
        Self(*layout)
    }

    /// Sets the bytes that a frame begins with.
    #[inline]
    pub const fn sync(mut self, sync: Patterns<'a>) -> Self {
        self.0.sync = sync;
        self
    }

    /// Sets the part that determines the length of a frame. Without this part, each frame has
    /// [`longest`](Self::longest) bytes.
    #[inline]
    pub const fn length(mut self, length: Length) -> Self {
        self.0.length = length;
        self
    }

    /// Sets the number of bytes in the shortest frame. If the number is not set, or is 0, a frame may be as short as
    /// its parts allow.
    #[inline]
    pub const fn shortest(mut self, bytes: usize) -> Self {
        self.0.shortest = bytes;
        self
    }

    /// Sets the number of bytes in the longest frame, including its trailer. This number determines the size of the
    /// buffer, and how long a false start can delay the next frame.
    #[inline]
    pub const fn longest(mut self, bytes: usize) -> Self {
        self.0.longest = bytes;
        self
    }

    /// Sets the fixed bits: the bits outside the sync and the terminator that are the same in every frame.
    #[inline]
    pub const fn fixed(mut self, fixed: &'a [FixedBits]) -> Self {
        self.0.fixed = fixed;
        self
    }

    /// Sets the known messages. Frames of other messages are rejected.
    #[inline]
    pub const fn messages(mut self, messages: Messages<'a>) -> Self {
        self.0.messages = Some(messages);
        self
    }

    /// Sets the checksum.
    #[inline]
    pub const fn checksum(mut self, checksum: Checksum<'a>) -> Self {
        self.0.checksum = Some(checksum);
        self
    }

    /// Sets the bytes that a frame ends with.
    #[inline]
    pub const fn terminator(mut self, terminator: Patterns<'a>) -> Self {
        self.0.terminator = terminator;
        self
    }

    /// Sets the bytes that are allowed between the sync and the terminator, as inclusive ranges. Use this only for
    /// frames that end with a delimiter. A byte outside the ranges must begin a terminator. Otherwise the frame is
    /// rejected immediately. The check is fastest if the widest range comes first.
    ///
    /// # Examples
    /// Lines of printable characters except `#`:
    /// ```
    /// use framelock::{Classification, DiscardReason};
    /// use framelock_formats::layout::{Layout, Length, Patterns};
    ///
    /// const LINE: Layout = Layout::builder()
    ///     .sync(Patterns::one(b"#"))
    ///     .length(Length::Delimiter)
    ///     .longest(80)
    ///     .content(&[(b' ', b'"'), (b'$', b'~')])
    ///     .terminator(Patterns::one(b"\r\n"))
    ///     .other_terminators(&[b"\n"])
    ///     .build_const();
    /// assert_eq!(LINE.classify(b"#abc\n"), Classification::Frame(5));
    /// assert_eq!(LINE.classify(b"#ab#"), Classification::Rejected(DiscardReason::WrongTerminator));
    /// ```
    #[inline]
    pub const fn content(mut self, ranges: &'a [(u8, u8)]) -> Self {
        self.0.content = ranges;
        self
    }

    /// Sets further terminators, of any lengths, for frames with a [`content`](Self::content). Offsets from the end and
    /// [`shortest`](Self::shortest) are counted as if each frame ended with the [`terminator`](Self::terminator).
    /// [`seal`](Layout::seal) writes the `terminator`, never one of the other terminators.
    #[inline]
    pub const fn other_terminators(mut self, terminators: &'a [&'a [u8]]) -> Self {
        self.0.other_terminators = terminators;
        self
    }

    /// Sets the trailer: the bytes that follow some frames.
    #[inline]
    pub const fn trailer(mut self, trailer: Trailer) -> Self {
        self.0.trailer = Some(trailer);
        self
    }

    /// Returns the number of bytes in the header, at least one. The header determines the length of the frame, unless a
    /// delimiter ends the frame.
    #[inline]
    #[must_use]
    pub const fn header(&self) -> usize {
        self.0.header()
    }

    /// Checks that the parts agree and returns the layout.
    ///
    /// # Errors
    /// Returns the first contradiction between the parts.
    pub const fn build(self) -> Result<Layout<'a>, Contradiction> {
        let mut layout = self.0;
        if layout.shortest == 0 {
            layout.shortest = match layout.length {
                Length::Fixed => layout.longest,
                _ => larger(least(&layout), 1),
            };
        }
        match check(&layout) {
            Ok(()) => Ok(layout),
            Err(contradiction) => Err(contradiction),
        }
    }

    /// Returns the layout, for use in a constant. If the parts contradict each other, the constant does not compile.
    ///
    /// # Panics
    /// Panics if the parts contradict each other. At run time, use [`build`](Self::build), which returns an error
    /// instead.
    #[must_use]
    #[expect(
        clippy::panic,
        reason = "the compiler reports the panic as an error in the constant"
    )]
    pub const fn build_const(self) -> Layout<'a> {
        match self.build() {
            Ok(layout) => layout,
            Err(contradiction) => panic!("{}", contradiction.message()),
        }
    }
}
