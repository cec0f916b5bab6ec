//! What every parser offers, so that everything around it is written once.

/// A machine that takes bytes one at a time and gives a message in the step that completes a frame.
///
/// [`Lecture`](crate::Lecture) and [`Receiver`](crate::Receiver) implement it;
/// [`Accounting`](crate::Accounting) and the readers are written against it.
pub trait Parser {
    /// What a frame means: [`Setpoint`](crate::Setpoint) for the formats of this crate.
    type Message;

    /// Bytes in a frame.
    const FRAME_LENGTH: usize;

    /// Takes the next byte of the stream; gives the message if this byte completes a frame.
    ///
    /// The current message changes here or nowhere: every byte but a frame's last returns `None`.
    fn push(&mut self, byte: u8) -> Option<Self::Message>;

    /// [`push`](Self::push), which also tells of the bytes that are dropped.
    fn push_with(&mut self, byte: u8, dropped: impl FnMut(usize, Mismatch)) -> Option<Self::Message>;

    /// Takes a slice, and says what becomes of each byte but those pending at the end: the same, and
    /// in the same order, as byte by byte. A stream may be cut into slices anywhere (theorem 6).
    fn feed_events(&mut self, bytes: &[u8], event: impl FnMut(Event<Self::Message>));

    /// How many of the last bytes are pending: a frame may yet include them. 0 to
    /// `FRAME_LENGTH - 1`.
    fn pending(&self) -> usize;

    /// Forgets what is pending, as if nothing had ever been received.
    fn reset(&mut self);

    /// Takes a slice: calls `frame` with each message, and the index in `bytes` of the byte that
    /// completed it. A stream may be cut into slices anywhere: the frames are the same.
    ///
    /// # Examples
    /// ```
    /// use framelock::{Lecture, Parser};
    /// let mut frames = Vec::new();
    /// Lecture::new().feed(b"..AB\0abc\rAB", |index, setpoint| frames.push((index, setpoint)));
    /// assert_eq!(frames, [(8, framelock::Setpoint::from(*b"abc"))]);
    /// ```
    #[inline]
    fn feed(&mut self, bytes: &[u8], mut frame: impl FnMut(usize, Self::Message)) {
        self.feed_events(bytes, |event| {
            if let Event::Frame { index, message } = event {
                frame(index, message);
            }
        });
    }
}

/// What becomes of bytes that a parser takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Event<Message> {
    /// A frame was committed.
    Frame {
        /// The index in the slice of its last byte.
        index: usize,
        /// What it means.
        message: Message,
    },
    /// Bytes can no longer be part of a frame.
    Dropped {
        /// How many, at least one.
        count: usize,
        /// Why.
        why: Mismatch,
    },
}

/// Why bytes are part of no frame: the first place at which the frame that would begin with them
/// goes wrong. Ordered by how far on in the frame that is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Mismatch {
    /// Not the first sync byte: nothing begins here. Payload of a broken frame, or noise.
    NoSync,
    /// The first sync byte was right, a later one was not.
    BrokenSync,
    /// The sync was right, but no frame has such a header: its length or kind is none that the format
    /// has. Formats of fixed length have none.
    Header,
    /// A fixed byte behind the payload, the terminator, was another.
    Terminator,
    /// All fixed bytes were right, the format's check (a checksum, a range) failed.
    Check,
    /// Pending when a [`LineEvent`](crate::LineEvent) came.
    LineEvent,
}
