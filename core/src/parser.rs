//! The interface that all receivers share, so that other code works with each of them.

use core::fmt;

use crate::LineEvent;

/// A machine that takes the bytes of a line and finds frames in them.
///
/// [`Receiver`](crate::Receiver), [`BufferedReceiver`](crate::BufferedReceiver),
/// [`PacketReceiver`](crate::PacketReceiver) and the [lecture's machine](crate::lecture::Lecture) are parsers. Each
/// type also has the inherent functions `push`, `next`, `feed`, `line_event`, `pending` and `reset`. A program that
/// calls only these need not import the trait. [`Line`](crate::Line) and the readers accept any `Parser`.
///
/// # Functions for any machine
/// A function that accepts every machine with a certain type of message `M` has the bound
/// `for<'a> Parser<Message<'a> = M>`. It also needs the bound `'static`. Otherwise the compiler reports "`P` does not
/// live long enough", because a message may borrow from the machine for any lifetime.
/// ```
/// use framelock::motion::{Bin, Setpoint};
/// use framelock::{Parser, Receiver, lecture::Lecture};
///
/// fn last<P>(machine: &mut P, bytes: &[u8]) -> Option<Setpoint>
/// where
///     P: for<'a> Parser<Message<'a> = Setpoint> + 'static,
/// {
///     let mut last = None;
///     machine.feed(bytes, |found| last = found.message().or(last));
///     last
/// }
///
/// let frame = b"AB\0\x01\x02\x03\r";
/// assert_eq!(last(&mut Receiver::<Bin>::new(), frame), Some(Setpoint::from([1, 2, 3])));
/// assert_eq!(last(&mut Lecture::new(), frame), Some(Setpoint::from([1, 2, 3])));
/// ```
pub trait Parser {
    /// The decoded content of a frame. It may borrow from the machine.
    type Message<'a>
    where
        Self: 'a;

    /// Takes the next byte. Returns the message if this call delivers a frame.
    ///
    /// Calls `account` with each outcome that this call decides, in the order of the stream. An outcome is a run of
    /// discarded bytes, or a frame with its length. Callers that count bytes, such as [`Line`](crate::Line), use this
    /// function instead of [`push`](Self::push).
    fn push_with(&mut self, byte: u8, account: impl FnMut(Found<()>)) -> Option<Self::Message<'_>>;

    /// Takes a slice. Reports the outcome of each byte in the order of the stream, except the bytes that are pending
    /// at the end. The results do not depend on how a stream is cut into slices (theorems 6 and 13a).
    fn feed(&mut self, bytes: &[u8], found: impl FnMut(Found<Self::Message<'_>>));

    /// Takes a line event, after which an incomplete frame cannot be continued. Decides and reports the outcome of each
    /// pending byte. After the call no byte is pending, so no later frame contains a byte from before the event
    /// (theorems 8 and 13f). The only exception is a delimiter directly before a pause: see
    /// [`PacketReceiver::line_event`](crate::PacketReceiver::line_event).
    fn line_event(&mut self, event: LineEvent, found: impl FnMut(Found<Self::Message<'_>>));

    /// Does one step of [`line_event`](Self::line_event). Returns whether another step is needed. To do the same as one
    /// call of `line_event`, repeat the step until it returns false.
    ///
    /// The default calls `line_event`, and needs no further step.
    fn line_event_step(
        &mut self,
        event: LineEvent,
        found: impl FnMut(Found<Self::Message<'_>>),
    ) -> bool {
        self.line_event(event, found);
        false
    }

    /// Classifies the bytes that [`push`](Self::push) has left undecided, or some of them. Returns false if the next
    /// decision needs more bytes. To do the same as [`feed`](Self::feed) of an empty slice, repeat this step until it
    /// returns false.
    ///
    /// The default feeds an empty slice.
    fn poll_step(&mut self, found: impl FnMut(Found<Self::Message<'_>>)) -> bool {
        self.feed(&[], found);
        false
    }

    /// Returns the number of pending bytes. These are the bytes at the end of the stream that may still become part of
    /// a frame.
    fn pending(&self) -> usize;

    /// Forgets the pending bytes, as if the machine had never received anything.
    fn reset(&mut self);

    /// Takes the next byte. Returns the message if this call delivers a frame.
    #[inline]
    fn push(&mut self, byte: u8) -> Option<Self::Message<'_>> {
        self.push_with(byte, |_| ())
    }

    /// Takes bytes from the front of the slice until a frame is delivered, and leaves the rest in the slice. Returns
    /// the frame's message. If no frame is delivered, takes the whole slice and returns `None`.
    ///
    /// Call this function until it returns `None`. By then it has reported the frames and discarded bytes that
    /// [`feed`](Self::feed) would report, in the same order (theorems 6 and 13a). Callers that count bytes use this
    /// function instead of [`next`](Self::next).
    fn next_with(
        &mut self,
        bytes: &mut &[u8],
        account: impl FnMut(Found<()>),
    ) -> Option<Self::Message<'_>>;

    /// Takes bytes until a frame is delivered. Does the same as [`next_with`](Self::next_with), without the
    /// reports.
    #[inline]
    fn next(&mut self, bytes: &mut &[u8]) -> Option<Self::Message<'_>> {
        self.next_with(bytes, |_| ())
    }
}

/// The outcome of the next bytes of the stream. Each byte has exactly one outcome.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Found<Message> {
    /// A frame was delivered.
    #[non_exhaustive]
    Frame {
        /// Bytes in the frame.
        length: usize,
        /// The frame's message.
        message: Message,
    },
    /// Bytes that are part of no frame.
    #[non_exhaustive]
    Discarded {
        /// Number of bytes, at least one.
        count: usize,
        /// Why these bytes are part of no frame.
        why: DiscardReason,
    },
}

impl<Message> Found<Message> {
    /// Returns the outcome of a frame's bytes.
    #[inline]
    #[must_use]
    pub const fn frame(length: usize, message: Message) -> Self {
        Self::Frame { length, message }
    }

    /// Returns the outcome of bytes that are part of no frame.
    #[inline]
    #[must_use]
    pub const fn discarded(count: usize, why: DiscardReason) -> Self {
        Self::Discarded { count, why }
    }

    /// Returns the message if the outcome is a frame.
    #[inline]
    pub fn message(self) -> Option<Message> {
        match self {
            Self::Frame { message, .. } => Some(message),
            Self::Discarded { .. } => None,
        }
    }

    /// Returns the number of bytes that have this outcome.
    #[inline]
    pub const fn bytes(&self) -> usize {
        match *self {
            Self::Frame { length, .. } => length,
            Self::Discarded { count, .. } => count,
        }
    }

    /// Returns the same outcome with another message.
    #[inline]
    pub fn map<Other>(self, other: impl FnOnce(Message) -> Other) -> Found<Other> {
        match self {
            Self::Frame { length, message } => Found::Frame {
                length,
                message: other(message),
            },
            Self::Discarded { count, why } => Found::Discarded { count, why },
        }
    }
}

/// The reason why bytes are part of no frame: the first error in the frame that would begin with these bytes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum DiscardReason {
    /// The byte is not the first sync byte, so no frame begins here. It is noise, or part of a broken frame.
    NoSync,
    /// The first sync byte was right, but a later one was wrong.
    BrokenSync,
    /// The sync was right, but the header is invalid, for example in a fixed bit, or the frame is too short. A
    /// [`FixedFormat`](crate::FixedFormat) never gives this reason.
    BadHeader,
    /// The frame is too long: its header states more bytes than the format or the message allows, or too many bytes
    /// arrive before the pause or the packet's delimiter that would end it.
    TooLong,
    /// The header states a message that the format does not know.
    UnknownMessage,
    /// The terminator, or another fixed value after the header, was wrong or missing.
    WrongTerminator,
    /// No whole packet lies between two delimiters: an escape sequence is invalid, or the second delimiter came before
    /// the packet's end. Only a [`PacketReceiver`](crate::PacketReceiver) gives this reason.
    BrokenStuffing,
    /// All fixed bytes were right, but the format's check (a checksum or a range) failed.
    ChecksumMismatch,
    /// The byte waited for the rest of a frame when a [`LineEvent`](crate::LineEvent) came, or it was pending after
    /// such a byte. `LineEvent` explains the rule.
    LineEvent,
}

impl fmt::Display for DiscardReason {
    /// Writes the reason in a word or two, as in `3 bytes discarded: broken sync`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::NoSync => "no sync",
            Self::BrokenSync => "broken sync",
            Self::BadHeader => "bad header",
            Self::TooLong => "too long",
            Self::UnknownMessage => "unknown message",
            Self::WrongTerminator => "wrong terminator or fixed value",
            Self::BrokenStuffing => "broken stuffing",
            Self::ChecksumMismatch => "checksum mismatch",
            Self::LineEvent => "line event",
        })
    }
}

/// Implements [`Parser`] by calling the type's inherent functions of the same names.
macro_rules! parser_by_own_functions {
    ($message:ty) => {
        fn push_with(&mut self, byte: u8, account: impl FnMut(Found<()>)) -> Option<$message> {
            self.push_with(byte, account)
        }
        fn feed(&mut self, bytes: &[u8], found: impl FnMut(Found<$message>)) {
            self.feed(bytes, found);
        }
        fn line_event(&mut self, event: LineEvent, found: impl FnMut(Found<$message>)) {
            self.line_event(event, found);
        }
        fn pending(&self) -> usize {
            self.pending()
        }
        fn reset(&mut self) {
            self.reset();
        }
        fn push(&mut self, byte: u8) -> Option<$message> {
            self.push(byte)
        }
        fn next_with(
            &mut self,
            bytes: &mut &[u8],
            account: impl FnMut(Found<()>),
        ) -> Option<$message> {
            self.next_with(bytes, account)
        }
        fn next(&mut self, bytes: &mut &[u8]) -> Option<$message> {
            self.next(bytes)
        }
    };
}
pub(crate) use parser_by_own_functions;

/// Defines `next` and `next_with` for a machine whose `push` leaves no decision to later calls.
macro_rules! next_by_pushing {
    ($message:ty) => {
        /// Takes bytes from the front of the slice until a frame is delivered, and leaves the rest in the slice.
        /// Returns the frame's message. If no frame is delivered, takes the whole slice and returns `None`.
        ///
        /// Call this function until it returns `None`. By then it has returned the frames that [`feed`](Self::feed)
        /// would report, in the same order. For long slices, the `feed` of a `Receiver` is faster than this function.
        #[inline]
        pub fn next(&mut self, bytes: &mut &[u8]) -> Option<$message> {
            self.next_with(bytes, |_| ())
        }

        /// Does the same as [`next`](Self::next), and reports each byte whose outcome is decided.
        #[inline]
        fn next_with(
            &mut self,
            bytes: &mut &[u8],
            mut account: impl FnMut(Found<()>),
        ) -> Option<$message> {
            while let [byte, rest @ ..] = *bytes {
                *bytes = rest;
                let frame = self.push_with(*byte, &mut account);
                if frame.is_some() {
                    return frame;
                }
            }
            None
        }
    };
}
pub(crate) use next_by_pushing;
