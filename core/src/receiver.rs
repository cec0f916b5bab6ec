//! The receiver: any format of fixed length, never deaf.
//!
//! It differs from the lecture's table in two rows: nothing that may be the start of a frame is
//! thrown away.
//!
//! ```text
//!         other     'A' again: this may be the start
//!         ┌──┐        ┌──┐
//!         │  ▼        │  ▼
//!         │ ┌───┐ 'A' ┌───┐ 'B' ┌───┐ any ┌───┐ any ┌───┐ any ┌───┐ any ┌────┐
//!  ─────► └─┤ A ├────►│ B ├────►│ 1 ├────►│ 2 ├────►│ 3 ├────►│ 4 ├────►│ CR │
//!           └───┘     └─┬─┘     └───┘     └───┘     └───┘     └───┘     └─┬──┘
//!             ▲   other │         ▲         ▲         ▲         ▲         │
//!             ├─────────┘         │         │         │         │         │ other
//!             │                   └─────────┴─────────┴─────────┴─────────┤
//!             │        the leftmost "AB", or else a final 'A' (to B),     │
//!             │        in the five bytes behind the failed one's "AB"     │
//!             │                                                           │
//!             └───────────────────────────────────────────────────────────┘
//!               CR: the setpoint is committed; or none of the five can begin a frame
//! ```
//!
//! [`pending`](Receiver::pending) says in which of these states it is: 0 is A, 6 is CR. The code
//! does not walk this diagram. It compares a shift register of the last bytes with the frame's
//! fixed bytes, which is simpler and does the same: see `window.rs`.

use core::marker::PhantomData;

use crate::window::Window;
use crate::{Event, Format, Frame, Mismatch, Parser};

/// The receiver of the format `F`: 8 bytes of state for frames of up to 8 bytes, 16 for longer ones.
///
/// Two receivers are equal if the same bytes are pending in both: then they do the same with every
/// byte that follows.
///
/// # Examples
/// The lecture's second example: the line has lost two bytes of the first frame. The lecture's
/// machine loses both frames, the receiver only the broken one.
/// ```
/// use framelock::{Bin, Lecture, Receiver, Setpoint};
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
pub struct Receiver<F: Format> {
    window: Window<F::Frame>,
    format: PhantomData<F>,
}

impl<F: Format> Receiver<F> {
    /// A receiver that has received nothing yet.
    ///
    /// A format with neither fixed bytes nor a check does not compile: see [`Format`].
    #[must_use]
    pub const fn new() -> Self {
        const {
            assert!(
                F::SHAPE.has_fixed_bytes() || F::CHECK.is_some(),
                "with neither fixed bytes nor a check any bytes are a frame: \
                 give SHAPE a fixed byte (`Some(b'A')`), or give the format a CHECK"
            );
        }
        Self {
            window: Window::EMPTY,
            format: PhantomData,
        }
    }

    /// Takes the next byte of the stream; gives the message if this byte completes a frame.
    ///
    /// It returns a message exactly when the last bytes are a frame that shares no byte with an
    /// earlier committed frame, and it returns that frame's (theorems 3 and 4). The cost is bounded:
    /// a masked comparison and a shift, and the format's check if the fixed bytes agree.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<F::Message> {
        let frame = self.window.push(&F::SHAPE, byte, Self::check);
        frame.map(Self::decode)
    }

    /// Takes a slice: see [`Parser::feed`], which is several times as fast as `push` for long ones.
    ///
    /// Without a closure, frame by frame:
    /// ```
    /// let mut receiver = framelock::Receiver::<framelock::Bin>::new();
    /// let bytes = b"AB\0\x10\x20\x30\rAB\0\x11\x21\x31\r";
    /// let mut setpoints = bytes.iter().filter_map(|&byte| receiver.push(byte));
    /// assert_eq!(setpoints.next().map(|setpoint| setpoint.pitch), Some(0x10));
    /// assert_eq!(setpoints.next().map(|setpoint| setpoint.pitch), Some(0x11));
    /// ```
    #[inline]
    pub fn feed(&mut self, bytes: &[u8], frame: impl FnMut(usize, F::Message)) {
        Parser::feed(self, bytes, frame);
    }

    /// How many of the last bytes are pending: a frame may yet include them. 0 to one fewer than a
    /// frame has.
    ///
    /// At most one comparison per byte held.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.window.pending(&F::SHAPE)
    }

    /// Forgets what is pending, as if nothing had ever been received.
    pub const fn reset(&mut self) {
        *self = Self::new();
    }

    #[inline]
    fn check(frame: <F::Frame as Frame>::Word) -> bool {
        F::CHECK.is_none_or(|check| check(F::Frame::from_word(frame)))
    }

    #[inline]
    fn decode(frame: <F::Frame as Frame>::Word) -> F::Message {
        F::decode(F::Frame::from_word(frame))
    }
}

impl<F: Format> Parser for Receiver<F> {
    type Message = F::Message;
    const FRAME_LENGTH: usize = F::Frame::LENGTH;

    #[inline]
    fn push(&mut self, byte: u8) -> Option<F::Message> {
        self.push(byte)
    }

    #[inline]
    fn push_with(
        &mut self,
        byte: u8,
        mut dropped: impl FnMut(usize, Mismatch),
    ) -> Option<F::Message> {
        let frame = self
            .window
            .push_dropping(&F::SHAPE, byte, Self::check, |why| dropped(1, why));
        frame.map(Self::decode)
    }

    #[inline]
    fn feed_events(&mut self, bytes: &[u8], mut event: impl FnMut(Event<F::Message>)) {
        self.window.feed(&F::SHAPE, bytes, Self::check, |of_frame| {
            event(match of_frame {
                Event::Frame { index, message } => Event::Frame {
                    index,
                    message: Self::decode(message),
                },
                Event::Dropped { count, why } => Event::Dropped { count, why },
            });
        });
    }

    fn pending(&self) -> usize {
        self.pending()
    }

    fn reset(&mut self) {
        self.reset();
    }
}

// Not derived: the format itself need not be any of these.
impl<F: Format> Clone for Receiver<F> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<F: Format> Copy for Receiver<F> {}

impl<F: Format> PartialEq for Receiver<F> {
    fn eq(&self, other: &Self) -> bool {
        self.window.agrees_with(other.window, &F::SHAPE)
    }
}

impl<F: Format> Eq for Receiver<F> {}

impl<F: Format> core::fmt::Debug for Receiver<F> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Receiver").field(&self.window).finish()
    }
}

impl<F: Format> Default for Receiver<F> {
    fn default() -> Self {
        Self::new()
    }
}
