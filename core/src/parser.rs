//! What every receiver offers, so that everything around it is written once.

use core::fmt;

use crate::LineEvent;

/// A machine that takes the bytes of a line and finds frames in them.
///
/// [`Receiver`](crate::Receiver), [`BufferedReceiver`](crate::BufferedReceiver) and the
/// [lecture's machine](crate::lecture::Lecture) implement it. Each has the same functions of its own,
/// so that a program that uses one of them need not import the trait. [`Line`](crate::Line) and the
/// readers are written against it.
///
/// # Functions for any machine
/// A bound on the message of every lifetime needs `'static` behind it. Without it the compiler says
/// "`P` does not live long enough", because a message may borrow from the machine for any time.
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
    /// What a frame means. It may borrow from the machine.
    type Message<'a>
    where
        Self: 'a;

    /// Takes the next byte. Returns the message of the next frame, if one is complete.
    ///
    /// It calls `account` with the outcome of each byte that it decides about, in the order of the stream: discarded
    /// runs, and the length of a frame. This is [`push`](Self::push) for those who count, such as
    /// [`Line`](crate::Line).
    fn push_with(&mut self, byte: u8, account: impl FnMut(Found<()>)) -> Option<Self::Message<'_>>;

    /// Takes a slice, and says what becomes of each byte but those pending at the end, in the order of
    /// the stream. A stream may be cut into slices anywhere (theorems 6 and 13a).
    fn feed(&mut self, bytes: &[u8], found: impl FnMut(Found<Self::Message<'_>>));

    /// No more bytes will come for what is pending: says what becomes of it. Then nothing is pending, so no
    /// later frame has a byte from before (theorems 8 and 13f).
    fn line_event(&mut self, event: LineEvent, found: impl FnMut(Found<Self::Message<'_>>));

    /// How many of the last bytes are pending: a frame may yet include them.
    fn pending(&self) -> usize;

    /// Forgets what is pending, as if nothing had ever been received.
    fn reset(&mut self);

    /// Takes the next byte. Returns the message of the next frame, if one is complete.
    #[inline]
    fn push(&mut self, byte: u8) -> Option<Self::Message<'_>> {
        self.push_with(byte, |_| ())
    }

    /// Takes bytes from the front of the slice up to the end of the next frame, and leaves the rest in it.
    /// Returns the frame's message. `None`: no other frame ends in the slice, and all of it is taken.
    ///
    /// Called until it returns `None`, it accounts for the same frames and discarded bytes as [`feed`](Self::feed),
    /// in the same order (theorems 6 and 13a). This is [`next`](Self::next) for those who count.
    fn next_with(
        &mut self,
        bytes: &mut &[u8],
        account: impl FnMut(Found<()>),
    ) -> Option<Self::Message<'_>>;

    /// Takes bytes up to the end of the next frame: [`next_with`](Self::next_with) without the account.
    #[inline]
    fn next(&mut self, bytes: &mut &[u8]) -> Option<Self::Message<'_>> {
        self.next_with(bytes, |_| ())
    }
}

/// What becomes of the next bytes of the stream: each byte is in exactly one of these.
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
        /// Why they are part of no frame.
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

    /// The message, if it is a frame.
    #[inline]
    pub fn message(self) -> Option<Message> {
        match self {
            Self::Frame { message, .. } => Some(message),
            Self::Discarded { .. } => None,
        }
    }

    /// How many bytes it is about.
    #[inline]
    pub const fn bytes(&self) -> usize {
        match *self {
            Self::Frame { length, .. } => length,
            Self::Discarded { count, .. } => count,
        }
    }

    /// The same with another message.
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

/// Why bytes are part of no frame: the first place at which the frame that would begin with them goes wrong.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum DiscardReason {
    /// Not the first sync byte: nothing begins here. Payload of a broken frame, or noise.
    NoSync,
    /// The first sync byte was right, a later one was not.
    BrokenSync,
    /// The sync was right, but no frame has such a header: a fixed bit is wrong, or the length is too short.
    /// Formats of fixed length have none.
    BadHeader,
    /// The header tells a length above that of the longest frame.
    TooLong,
    /// The header tells a message that the format does not know.
    UnknownMessage,
    /// A fixed byte behind the payload, the terminator, was another.
    WrongTerminator,
    /// All fixed bytes were right, the format's check (a checksum, a range) failed.
    ChecksumMismatch,
    /// Pending when a [`LineEvent`](crate::LineEvent) came.
    LineEvent,
}

impl fmt::Display for DiscardReason {
    /// In a word or two, as in `3 bytes discarded: broken sync`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::NoSync => "no sync",
            Self::BrokenSync => "broken sync",
            Self::BadHeader => "bad header",
            Self::TooLong => "too long",
            Self::UnknownMessage => "unknown message",
            Self::WrongTerminator => "wrong terminator",
            Self::ChecksumMismatch => "checksum mismatch",
            Self::LineEvent => "line event",
        })
    }
}

/// [`Parser`] by the functions of the same names that the type has of its own.
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

/// The functions `next` and `next_with` of a machine that finishes each byte in the step that takes it.
macro_rules! next_by_pushing {
    ($message:ty) => {
        /// Takes bytes from the front of the slice up to the end of the next frame, and leaves the rest in it.
        /// Returns the frame's message. `None`: no other frame ends in the slice, and all of it is taken.
        ///
        /// Called until it returns `None`, it reports the same frames as [`feed`](Self::feed), in the same
        /// order (theorem 6). For long slices `feed` is faster.
        #[inline]
        pub fn next(&mut self, bytes: &mut &[u8]) -> Option<$message> {
            self.next_with(bytes, |_| ())
        }

        /// [`next`](Self::next), with an account of each byte whose outcome it decides.
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
