//! The receiver of any format of fixed length.

use core::marker::PhantomData;

use crate::fixed_format::sealed::Words;
use crate::parser::{next_by_pushing, parser_by_own_functions};
use crate::window::Window;
use crate::{DiscardReason, FixedFormat, Found, FrameBytes, LineEvent, Parser};

/// The receiver of the format `F`: 8 bytes of state for frames of up to 8 bytes, 16 for longer ones.
///
/// Two receivers are equal if the same bytes are pending in both. Equal receivers treat all later bytes alike.
///
/// # Examples
/// The lecture's second example: the line has lost two bytes of the first frame. The lecture's machine loses both
/// frames. The receiver loses only the broken frame.
/// ```
/// use framelock::Receiver;
/// use framelock::lecture::Lecture;
/// use framelock::motion::{Bin, Setpoint};
/// let received = [0x41, 0x42, 0x00, 0x4A, 0x0D, 0x41, 0x42, 0x00, 0x82, 0xC4, 0x4A, 0x0D];
/// let mut lecture = Lecture::new();
/// assert!(received.iter().all(|&byte| lecture.push(byte).is_none()));
///
/// let mut receiver = Receiver::<Bin>::new();
/// let mut setpoint = None;
/// for byte in received {
///     setpoint = receiver.push(byte).or(setpoint);
/// }
/// assert_eq!(setpoint, Some(Setpoint { pitch: 0x82, roll: 0xC4, yaw: 0x4A }));
/// ```
pub struct Receiver<F: FixedFormat> {
    window: Window<F::Frame>,
    format: PhantomData<F>,
}

impl<F: FixedFormat> Receiver<F> {
    /// Creates a receiver that has received nothing yet.
    ///
    /// A format with neither fixed bytes nor a check does not compile: see [`FixedFormat`].
    #[must_use]
    pub const fn new() -> Self {
        const {
            assert!(
                F::SHAPE.has_fixed_bytes() || F::CHECK.is_some(),
                "this format has neither fixed bytes nor a check, so any bytes would be a frame: \
                 give SHAPE a fixed byte (`Some(b'A')`), or give the format a CHECK"
            );
        }
        Self {
            window: Window::EMPTY,
            format: PhantomData,
        }
    }

    /// Takes the next byte of the stream. Returns the message if this byte completes a frame.
    ///
    /// Returns a message exactly when the byte completes a frame that shares no byte with an earlier delivered frame,
    /// and has no byte from before a line event (theorems 3, 4 and 8). The cost of each call is bounded: a masked
    /// comparison, a shift, the format's check if the fixed bytes are right, and `decode` for a frame.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<F::Message> {
        let frame = self.window.push(&F::SHAPE, byte, Self::check);
        frame.map(Self::decode)
    }

    /// Does the same as [`push`](Self::push), and reports each byte whose outcome is decided.
    ///
    /// Usually makes one comparison with the shape. When a frame turns out to be broken, makes up to one more
    /// comparison per pending byte.
    #[inline]
    fn push_with(&mut self, byte: u8, mut account: impl FnMut(Found<()>)) -> Option<F::Message> {
        let discarded = |why| account(Found::discarded(1, why));
        let frame = self
            .window
            .push_with(&F::SHAPE, byte, Self::check, discarded)?;
        account(Found::frame(F::Frame::LENGTH, ()));
        Some(Self::decode(frame))
    }

    /// Takes a slice. Reports the outcome of each byte, except the bytes that are pending at the end. For long slices
    /// `feed` is several times as fast as `push`. The results do not depend on how a stream is cut into slices (theorem
    /// 6).
    ///
    /// # Examples
    /// ```
    /// use framelock::{Receiver, motion::Bin};
    /// let mut pitches = Vec::new();
    /// Receiver::<Bin>::new().feed(b"AB\0\x10\x20\x30\r, AB\0\x11\x21\x31\rAB", |found| {
    ///     pitches.extend(found.message().map(|setpoint| setpoint.pitch));
    /// });
    /// assert_eq!(pitches, [0x10, 0x11]);
    /// ```
    #[inline]
    pub fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Found<F::Message>)) {
        self.window.feed(&F::SHAPE, bytes, Self::check, move |one| {
            found(one.map(Self::decode));
        });
    }

    next_by_pushing!(F::Message);

    /// Takes a line event, after which an incomplete frame cannot be continued. Discards the pending bytes, so no later
    /// frame contains a byte from before the event.
    pub fn line_event(&mut self, _: LineEvent, mut found: impl FnMut(Found<F::Message>)) {
        let (count, why) = (self.pending(), DiscardReason::LineEvent);
        if count > 0 {
            found(Found::Discarded { count, why });
        }
        self.reset();
    }

    /// Returns the number of pending bytes, always less than a frame's length. Pending bytes are those at the end of
    /// the stream that may still become part of a frame.
    ///
    /// Makes fewer comparisons than a frame has bytes.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.window.pending(&F::SHAPE)
    }

    /// Forgets the pending bytes, as if the receiver had never received anything.
    pub const fn reset(&mut self) {
        *self = Self::new();
    }

    #[inline]
    fn check(frame: <F::Frame as Words>::Word) -> bool {
        F::CHECK.is_none_or(|check| check(F::Frame::from_word(frame)))
    }

    #[inline]
    fn decode(frame: <F::Frame as Words>::Word) -> F::Message {
        F::decode(F::Frame::from_word(frame))
    }
}

impl<F: FixedFormat> Parser for Receiver<F> {
    type Message<'a>
        = F::Message
    where
        Self: 'a;

    parser_by_own_functions!(F::Message);
}

// These traits are implemented by hand, because derives would require that the format type `F` implements them, too.
impl<F: FixedFormat> Clone for Receiver<F> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<F: FixedFormat> Copy for Receiver<F> {}

#[cfg(kani)]
impl<F: FixedFormat> Receiver<F> {
    /// Returns the receiver that holds the last `count` bytes of a history, with or without a note (see the module
    /// `window`). `count` is less than the length of a frame. Streams lead to these states and to no others: see the
    /// proofs about [`Window`].
    pub fn holding(history: &[u8], count: usize, has_note: bool) -> Self {
        let window = Window::holding(history, count, has_note, &F::SHAPE);
        let format = PhantomData;
        Self { window, format }
    }
}

impl<F: FixedFormat> PartialEq for Receiver<F> {
    fn eq(&self, other: &Self) -> bool {
        self.window.agrees_with(other.window, &F::SHAPE)
    }
}

impl<F: FixedFormat> Eq for Receiver<F> {}

impl<F: FixedFormat> core::fmt::Debug for Receiver<F> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Receiver").field(&self.window).finish()
    }
}

impl<F: FixedFormat> Default for Receiver<F> {
    fn default() -> Self {
        Self::new()
    }
}
