//! The receiver of frames of any length. It keeps bytes in a buffer as long as the bytes may still become part of a
//! frame.
//!
//! ```text
//!            from                  to     ask_at
//!   ┌─────────┬─────────────────────┬───────┬─────────────┐
//!   │ decided │       pending       │       │    free     │  buffer: N bytes, at least LONGEST
//!   └─────────┴─────────────────────┴───────┴─────────────┘
//! ```
//!
//! The receiver stores bytes at `to`. While `to` is less than `ask_at`, the receiver does nothing else, because the
//! format has asked for more bytes. When `to` reaches `ask_at`, the receiver asks the format about the pending bytes.
//! Then one of three things happens:
//!
//! * The pending bytes begin with a frame. The receiver delivers the frame, and moves `from` past the frame.
//! * No frame begins with the first pending byte. The receiver drops this byte, and moves `from` by one.
//! * The format needs more bytes to decide. The receiver sets `ask_at` to the value that `to` will have when these
//!   bytes have come.
//!
//! If new bytes do not fit at `to`, the pending bytes first move to the front of the buffer.

use core::cell::Cell;
use core::fmt::Debug;

use crate::parser::parser_by_own_functions;
use crate::{Classification, DiscardReason, Format, Found, Frame, LineEvent, Parser};

mod feed;
mod line_event;
#[cfg(kani)]
mod verification;

/// The receiver of frames of any length up to [`Format::LONGEST`].
///
/// If your frames have a fixed length of up to 16 bytes, use [`Receiver`](crate::Receiver): it is smaller and faster,
/// and delivers each frame with the frame's last byte. `BufferedReceiver` consists of the format, a buffer `B`, and
/// three indices of the type `usize`. `B` is an array (see [`new`](Self::new)), a borrowed slice, or a `Vec` (see
/// [`with_buffer`](Self::with_buffer)).
///
/// **Make the buffer twice as long as [`Format::LONGEST`].** It must have at least `LONGEST` bytes. When the buffer is
/// full, the pending bytes move to its front. *False starts* are bytes that look like the start of a frame but are not
/// one. If the buffer has only `LONGEST` bytes and the stream consists of false starts, the pending bytes move whenever
/// a byte comes. If the buffer has twice `LONGEST` bytes, the receiver moves on average less than one byte per
/// received byte.
///
/// Each frame is delivered as a [`Frame`]. The frame is decoded only when the program asks for the message.
///
/// # The rule
///
/// The receiver goes through the stream from left to right. If a frame begins at the current byte, the receiver
/// delivers the frame and continues after it. If no frame begins there, the receiver drops one byte. If the format
/// cannot decide yet, the receiver waits for more bytes. So the receiver delivers every frame that arrives whole. The
/// only exception is a frame that shares bytes with an earlier delivered frame.
///
/// # What to expect
///
/// * **Latency.** After a false start a frame of `n` bytes may be delivered late: up to `LONGEST - n` bytes after the
///   frame's last byte, or with the next line event. In a stream without errors each frame is delivered with its last
///   byte, unless the format needs later bytes to recognise the frame. Choose the failsafe's times long enough for this
///   delay.
/// * **Cost.** Each call of [`push`](Self::push) asks for at most one classification, of at most `LONGEST` bytes,
///   whatever the stream. While the format waits for more bytes, `push` only stores the byte. The repository's
///   `docs/rivals.md` has the cost per byte, for clean streams and for the most expensive known streams.
/// * **Limits of every receiver.** If a false frame passes the format's check, the receiver delivers the false frame,
///   and loses each true frame that shares bytes with the false one. If the first bytes of a frame are lost, and bytes
///   of its payload look like a frame, the receiver delivers these bytes as a frame.
///
/// # Examples
/// ```
/// use framelock::{BufferedReceiver, DiscardReason, Format, LineEvent, Classification};
///
#[doc = include_str!("buffered/text.txt")]
///
/// // `feed` delivers every complete frame. After `push`, call `poll` until it returns `None`.
/// let mut receiver = BufferedReceiver::<_, [u8; 48]>::new(Text);
/// let mut received = Vec::new();
/// receiver.feed(b"#\x03one#\x03two", |found| {
///     received.extend(found.decoded().map(<[u8]>::to_vec));
/// });
/// assert_eq!(received, [b"one", b"two"]);
///
/// // A false start claims that 16 bytes follow. The frame after it waits until a line event delivers it.
/// receiver.feed(b"#\x10#\x03six", |_| unreachable!());
/// assert_eq!(receiver.pending(), 7);
/// receiver.line_event(LineEvent::Idle, |found| {
///     received.extend(found.decoded().map(<[u8]>::to_vec));
/// });
/// assert_eq!(received, [b"one", b"two", b"six"]);
/// ```
/// A buffer that is too short for the longest frame does not compile:
/// ```compile_fail,E0080
/// # use framelock::{BufferedReceiver, DiscardReason, Format, Classification};
/// # include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/buffered/text.txt"));
/// const _: BufferedReceiver<Text, [u8; 23]> = BufferedReceiver::new(Text);
/// ```
#[derive(Clone, Debug)]
pub struct BufferedReceiver<F, B> {
    format: F,
    buffer: B,
    /// The pending bytes are `buffer[from..to]`.
    from: usize,
    to: usize,
    /// Until `to` reaches this index, the format cannot classify the first pending byte.
    ask_at: usize,
}

/// The decision about the first pending byte.
enum Decision {
    /// A frame of this length. Its last byte is just before `from`.
    Frame(usize),
    /// No frame begins with the byte, so the byte is discarded.
    Discarded,
    /// No decision: nothing is pending, or the format needs more bytes.
    Waiting,
}

impl<F: Format, const N: usize> BufferedReceiver<F, [u8; N]> {
    /// Creates a receiver that has an array as its buffer and has received nothing yet.
    ///
    /// An array shorter than [`Format::LONGEST`] does not compile.
    #[must_use]
    pub const fn new(format: F) -> Self {
        const {
            assert!(
                F::LONGEST >= 1 && F::LONGEST <= N,
                "the buffer must hold the longest frame: \
                 make N of BufferedReceiver<F, [u8; N]> at least F::LONGEST, or LONGEST smaller"
            );
        }
        Self::empty(format, [0; N])
    }
}

impl<F, B> BufferedReceiver<F, B> {
    const fn empty(format: F, buffer: B) -> Self {
        Self {
            format,
            buffer,
            from: 0,
            to: 0,
            ask_at: 0,
        }
    }
}

impl<F: Format, B: AsRef<[u8]> + AsMut<[u8]>> BufferedReceiver<F, B> {
    /// Creates a receiver that keeps pending bytes in `buffer`: a borrowed slice, or a `Vec`.
    ///
    /// Returns `None` if the buffer is shorter than the format's [`longest`](Format::longest) frame, or if `longest` is
    /// 0. If you can, make the buffer twice as long as this frame.
    #[must_use]
    pub fn with_buffer(format: F, buffer: B) -> Option<Self> {
        let longest = format.longest();
        (1 <= longest && longest <= buffer.as_ref().len()).then(|| Self::empty(format, buffer))
    }

    /// Takes the next byte of the stream. Returns the next frame, if one is complete.
    ///
    /// **A call asks for at most one classification. So it may leave bytes undecided, even a whole frame.** After a
    /// false start, later calls classify these bytes in turn. Each call delivers at most one frame. If no byte follows
    /// soon, call [`poll`](Self::poll) until it returns `None`, or report the idle line as a
    /// [`line_event`](Self::line_event). Both also exist as steps of bounded cost: see [`poll_step`](Self::poll_step)
    /// and [`line_event_step`](Self::line_event_step).
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Frame<'_, F>> {
        self.push_with(byte, |_| ())
    }

    /// Does the same as [`push`](Self::push), and reports each byte whose outcome is decided.
    #[inline]
    fn push_with(&mut self, byte: u8, account: impl FnMut(Found<()>)) -> Option<Frame<'_, F>> {
        let end = self.to.wrapping_add(1);
        if end < self.ask_at {
            if let Some(place) = self.buffer.as_mut().get_mut(self.to) {
                (*place, self.to) = (byte, end);
                return None;
            }
        }
        self.push_and_decide(byte, account)
    }

    /// Takes a byte after which a decision may be possible.
    // This is a separate function, so that registers need not be saved for a byte that is only stored.
    #[inline(never)]
    fn push_and_decide(
        &mut self,
        byte: u8,
        mut account: impl FnMut(Found<()>),
    ) -> Option<Frame<'_, F>> {
        if self.pending() == 0 {
            self.reset();
            if !self.format.starts(byte) {
                account(Found::discarded(1, DiscardReason::NoSync));
                return None;
            }
        }
        self.store(&[byte]);
        match self.decide_next(&mut account) {
            Decision::Frame(length) => Some(self.frame(length)),
            Decision::Discarded | Decision::Waiting => None,
        }
    }

    /// Returns the next frame among the bytes that [`push`](Self::push) has left undecided.
    ///
    /// Asks for at most one classification for each pending byte. To spread this work over several calls, use
    /// [`poll_step`](Self::poll_step).
    pub fn poll(&mut self) -> Option<Frame<'_, F>> {
        self.next(&mut [].as_slice())
    }

    /// Does one step of [`poll`](Self::poll): classifies the first of the bytes that [`push`](Self::push) has left
    /// undecided. Reports the dropped bytes, or the frame, or dropped bytes and the frame after them. Returns false if
    /// the receiver needs more bytes for the next decision.
    ///
    /// Call this function until it returns false. By then it has reported what [`feed`](Self::feed) of an empty slice
    /// would report. The program may call other functions between two steps.
    ///
    /// **A step examines fewer than [`LONGEST`](Format::LONGEST) bytes.** It calls [`Format::classify_after`] at most
    /// once, so it costs at most as much as a call of `push`. A call of `poll` may examine about `LONGEST`² / 2 bytes.
    /// An interrupt handler that has no time for so many bytes can do one step at each interrupt.
    ///
    /// # Examples
    /// ```
    /// use framelock::{BufferedReceiver, DiscardReason, Format, Classification};
    ///
    /// /// A frame: `#`, the length of the text (at most 5), the text, and a line feed.
    /// #[derive(Clone, Copy)]
    /// struct Ended;
    ///
    /// impl Format for Ended {
    ///     const LONGEST: usize = 8;
    ///     type Message<'a> = &'a [u8];
    ///
    ///     fn classify(&self, bytes: &[u8]) -> Classification {
    ///         match *bytes {
    ///             [b'#'] => Classification::Incomplete { at_least: 2 },
    ///             [b'#', length, ..] if length > 5 => Classification::Rejected(DiscardReason::TooLong),
    ///             [b'#', length, ..] => match bytes.get(2 + usize::from(length)) {
    ///                 Some(b'\n') => Classification::Frame(3 + usize::from(length)),
    ///                 Some(_) => Classification::Rejected(DiscardReason::WrongTerminator),
    ///                 None => Classification::Incomplete { at_least: 3 + usize::from(length) },
    ///             },
    ///             _ => Classification::Rejected(DiscardReason::NoSync),
    ///         }
    ///     }
    ///
    ///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { &frame[2..frame.len() - 1] }
    /// }
    ///
    /// let mut receiver = BufferedReceiver::<_, [u8; 16]>::new(Ended);
    /// // The last byte shows that `#\x05` is a false start. `push` only drops the `#`.
    /// assert!(b"#\x05#\x01a\n#\0".iter().all(|&byte| receiver.push(byte).is_none()));
    /// assert_eq!(receiver.pending(), 7);
    ///
    /// let mut received = Vec::new();
    /// assert!(receiver.poll_step(|found| received.extend(found.message().map(|frame| frame.message().to_vec()))));
    /// assert_eq!((received, receiver.pending()), (vec![b"a".to_vec()], 2));
    /// assert!(!receiver.poll_step(|_| unreachable!()));
    /// ```
    pub fn poll_step(&mut self, mut found: impl FnMut(Found<Frame<'_, F>>)) -> bool {
        // Skip a frame here. The `match` below reports it together with its bytes.
        let discarded = |one| match one {
            Found::Frame { .. } => {}
            Found::Discarded { count, why } => found(Found::discarded(count, why)),
        };
        match self.decide_next(discarded) {
            Decision::Frame(length) => found(Found::frame(length, self.frame(length))),
            Decision::Discarded => {}
            Decision::Waiting => return false,
        }
        true
    }

    /// Takes bytes from the front of the slice until it can deliver the next frame, and leaves the rest in the slice.
    /// Returns the frame. If it can deliver none, takes the whole slice and returns `None`. Frames among the
    /// bytes that [`push`](Self::push) has left undecided come first.
    ///
    /// A program may stop, return or await between frames. Call this function until it returns `None`. By then it has
    /// delivered the frames that [`feed`](Self::feed) would deliver, in the same order. The function copies every byte,
    /// even if a frame lies whole in the slice. For long slices `feed` is faster than this function.
    ///
    /// # Examples
    /// `Text` is the format of the [first example](BufferedReceiver).
    /// ```
    /// # use framelock::{BufferedReceiver, DiscardReason, Format, Classification};
    /// # include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/buffered/text.txt"));
    /// # fn main() {
    /// let mut receiver = BufferedReceiver::<_, [u8; 48]>::new(Text);
    /// let mut bytes: &[u8] = b"#\x03one, #\x03two#\x05";
    /// assert_eq!(receiver.next(&mut bytes).unwrap().message(), b"one");
    /// assert_eq!(bytes, b", #\x03two#\x05");
    /// assert_eq!(receiver.next(&mut bytes).unwrap().message(), b"two");
    /// assert!(receiver.next(&mut bytes).is_none());
    /// assert_eq!((bytes.len(), receiver.pending()), (0, 2));
    /// # }
    /// ```
    pub fn next(&mut self, bytes: &mut &[u8]) -> Option<Frame<'_, F>> {
        self.next_with(bytes, |_| ())
    }

    /// Does the same as [`next`](Self::next), and reports each byte whose outcome is decided.
    fn next_with(
        &mut self,
        bytes: &mut &[u8],
        mut account: impl FnMut(Found<()>),
    ) -> Option<Frame<'_, F>> {
        loop {
            match self.decide_next(&mut account) {
                Decision::Frame(length) => return Some(self.frame(length)),
                Decision::Discarded => {}
                Decision::Waiting if self.store_what_is_missing(bytes) => {}
                Decision::Waiting => return None,
            }
        }
    }

    /// Moves bytes from the front of the slice into the buffer: as many as the format still needs for a decision, but
    /// at least one. Returns false if the slice was empty.
    fn store_what_is_missing(&mut self, bytes: &mut &[u8]) -> bool {
        let missing = self.ask_at.saturating_sub(self.to).max(1);
        let (now, later) = bytes.split_at_checked(missing).unwrap_or((*bytes, &[]));
        self.store(now);
        *bytes = later;
        !now.is_empty()
    }

    /// Returns the number of pending bytes, always less than `LONGEST`. Pending bytes are those at the end of the
    /// stream that may still become part of a frame.
    #[must_use]
    pub const fn pending(&self) -> usize {
        self.to.saturating_sub(self.from)
    }

    /// Forgets the pending bytes, as if the receiver had never received anything.
    pub const fn reset(&mut self) {
        (self.from, self.to, self.ask_at) = (0, 0, 0);
    }

    /// Returns the format.
    #[must_use]
    pub const fn format(&self) -> &F {
        &self.format
    }

    /// Does nothing until `to` reaches `ask_at`. Then discards the pending bytes before the first byte that can start a
    /// frame, and asks the format once about the rest.
    #[inline]
    fn decide_next(&mut self, mut account: impl FnMut(Found<()>)) -> Decision {
        if self.to < self.ask_at {
            return Decision::Waiting;
        }
        // If `ask_at` is greater than `from + 1`, the format has found the pending bytes incomplete. So the first of
        // them can start a frame.
        if self.ask_at <= self.from.wrapping_add(1) {
            self.discard_what_starts_nothing(&mut account);
        }
        self.decide(account)
    }

    #[inline]
    fn discard_what_starts_nothing(&mut self, account: &mut impl FnMut(Found<()>)) {
        let pending = self.buffer.as_ref().get(self.from..self.to);
        let starts_none = |byte: &&u8| !self.format.starts(**byte);
        let pending = pending.unwrap_or_default().iter();
        let run = pending.take_while(starts_none).count();
        if run > 0 {
            account(Found::discarded(run, DiscardReason::NoSync));
            self.from = self.from.wrapping_add(run);
            self.ask_at = 0;
        }
    }

    /// Asks the format once about the pending bytes.
    #[inline]
    fn decide(&mut self, mut account: impl FnMut(Found<()>)) -> Decision {
        let pending = self.buffer.as_ref().get(self.from..self.to);
        let pending = pending.unwrap_or_default();
        if pending.is_empty() {
            self.reset();
            return Decision::Waiting;
        }
        // If `seen` is not 0, the format has asked for `seen + 1` bytes. So by law 3, the first `seen` bytes are
        // incomplete.
        let seen = self.ask_at.saturating_sub(self.from.wrapping_add(1));
        self.ask_at = 0;
        match classify(&self.format, pending, seen) {
            Classification::Frame(length) => {
                self.from = self.from.wrapping_add(length);
                account(Found::frame(length, ()));
                Decision::Frame(length)
            }
            Classification::Rejected(why) => {
                self.from = self.from.wrapping_add(1);
                account(Found::discarded(1, why));
                Decision::Discarded
            }
            Classification::Incomplete { at_least } => {
                self.ask_at = self.from.wrapping_add(at_least);
                Decision::Waiting
            }
        }
    }

    /// Returns the frame of this length whose last byte is just before `from`.
    #[inline]
    fn frame(&self, length: usize) -> Frame<'_, F> {
        let start = self.from.wrapping_sub(length);
        let bytes = self.buffer.as_ref().get(start..self.from);
        Frame::new(self.format.clone(), bytes.unwrap_or_default())
    }

    /// Stores bytes. The pending and the new bytes together must not exceed `LONGEST`.
    #[inline]
    fn store(&mut self, bytes: &[u8]) {
        let room = self.buffer.as_ref().len();
        if bytes.len() > room.saturating_sub(self.to) {
            self.move_to_front();
        }
        let free = self.buffer.as_mut().get_mut(self.to..).unwrap_or_default();
        for (place, &byte) in free.iter_mut().zip(bytes) {
            *place = byte;
        }
        self.to = room.min(self.to.wrapping_add(bytes.len()));
    }

    /// Moves the pending bytes to the front of the buffer.
    // Copies byte by byte, because `copy_within` would add 1.5 KB of `memmove` to the firmware.
    #[cold]
    fn move_to_front(&mut self) {
        let places = Cell::from_mut(self.buffer.as_mut()).as_slice_of_cells();
        let pending = places.get(self.from..self.to).unwrap_or_default();
        for (place, byte) in places.iter().zip(pending) {
            place.set(byte.get());
        }
        let to = pending.len();
        self.ask_at = self.ask_at.saturating_sub(self.from);
        (self.from, self.to) = (0, to);
    }
}

impl<F: Format, B: AsRef<[u8]> + AsMut<[u8]>> Parser for BufferedReceiver<F, B> {
    type Message<'a>
        = Frame<'a, F>
    where
        Self: 'a;

    parser_by_own_functions!(Frame<'_, F>);

    fn poll_step(&mut self, found: impl FnMut(Found<Frame<'_, F>>)) -> bool {
        self.poll_step(found)
    }

    fn line_event_step(
        &mut self,
        event: LineEvent,
        found: impl FnMut(Found<Frame<'_, F>>),
    ) -> bool {
        self.line_event_step(event, found)
    }
}

/// Returns the format's classification of 1 to `LONGEST` bytes, corrected to keep law 1. So even a wrong format cannot
/// make the receiver hang, overrun its buffer, or wait for more than `LONGEST` bytes.
#[inline]
fn classify<F: Format>(format: &F, bytes: &[u8], seen: usize) -> Classification {
    let longest = format.longest();
    match format.classify_after(bytes, seen) {
        Classification::Frame(length) if length == 0 || length > bytes.len() => {
            Classification::Rejected(DiscardReason::ChecksumMismatch)
        }
        Classification::Incomplete { .. } if bytes.len() >= longest => {
            Classification::Rejected(DiscardReason::BadHeader)
        }
        Classification::Incomplete { at_least }
            if at_least <= bytes.len() || longest < at_least =>
        {
            Classification::Incomplete {
                at_least: bytes.len().wrapping_add(1),
            }
        }
        classification => classification,
    }
}
