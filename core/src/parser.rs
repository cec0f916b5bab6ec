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
    /// The message in force changes here or nowhere: every byte but a frame's last returns `None`.
    fn push(&mut self, byte: u8) -> Option<Self::Message>;

    /// How many of the bytes taken last are held because a frame may yet include them:
    /// 0 to `FRAME_LENGTH - 1`.
    fn pending(&self) -> usize;

    /// Forgets the frame under way, as if nothing had ever been received.
    fn reset(&mut self);

    /// Takes a slice: the same frames at the same places, and the same state afterwards,
    /// as [`push`](Self::push) of each byte in turn, wherever a stream is cut into slices.
    ///
    /// Each frame is reported to `sink` with the index, in `bytes`, of its last byte. A closure
    /// `|index, message|` is a sink; one that also wants what was dropped implements [`Sink`].
    ///
    /// Frames that follow each other are compared several at a time, and what lies between frames
    /// is searched a block at a time; at worst each byte costs a bounded number of steps.
    fn feed(&mut self, bytes: &[u8], sink: &mut impl Sink<Self::Message>);
}

/// Takes what [`Parser::feed`] finds.
///
/// # Examples
/// ```
/// use framelock::{Lecture, Parser};
/// let mut frames = Vec::new();
/// Lecture::new().feed(b"..AB\0abc\rAB", &mut |index, setpoint| frames.push((index, setpoint)));
/// assert_eq!(frames, [(8, framelock::Setpoint::from(*b"abc"))]);
/// ```
pub trait Sink<Message> {
    /// Whether [`dropped`](Self::dropped) does anything. Where it does not, the parser need not
    /// look for reasons.
    const WANTS_DROPPED: bool = true;

    /// A frame was completed by the byte at `index` of the slice.
    fn frame(&mut self, index: usize, message: Message);

    /// `count` further bytes can no longer be part of a frame; `why` is the place at which the
    /// frame that would begin with them went wrong.
    ///
    /// Bytes in front of a frame are reported before it, but may be summed up by reason, in
    /// another order than they came in.
    fn dropped(&mut self, count: usize, why: Mismatch);
}

impl<Message, F: FnMut(usize, Message)> Sink<Message> for F {
    const WANTS_DROPPED: bool = false;

    fn frame(&mut self, index: usize, message: Message) {
        self(index, message);
    }

    fn dropped(&mut self, _count: usize, _why: Mismatch) {}
}

/// Why bytes were no frame: the first place at which the frame that would begin with them fails.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Mismatch {
    /// Not the first sync byte: nothing begins here. Payload of a broken frame, or noise.
    NoSync,
    /// The first sync byte was right, a later one was not.
    BrokenSync,
    /// The sync was right, the format's check (a checksum, a range) failed.
    Check,
    /// A fixed byte behind the payload, the terminator, was another.
    Terminator,
}
