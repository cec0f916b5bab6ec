//! The receiver of frames of any length, which keeps what may become one in a buffer.
//!
//! ```text
//!            from                  to     ask_at
//!   ┌─────────┬─────────────────────┬───────┬─────────────┐
//!   │ settled │       pending       │       │    free     │  buffer: N bytes, at least LONGEST
//!   └─────────┴─────────────────────┴───────┴─────────────┘
//! ```
//!
//! A byte is stored at `to`. Until `to` has come to `ask_at` nothing can be said, and that is all. Then
//! the format is asked about the pending bytes, and one of three things happens:
//!
//! * they begin with a frame: it is committed, and `from` moves behind it;
//! * no frame begins here: one byte is dropped, `from` moves by one;
//! * it says how many bytes it takes to know more: `ask_at`.
//!
//! What is pending moves to the front when the buffer is full.

use core::cell::Cell;
use core::fmt::Debug;

use crate::noise::run_without_start;
use crate::parser::parser_by_own_functions;
use crate::{Classification, DiscardReason, Format, Found, Frame, LineEvent, Parser};

#[cfg(kani)]
mod verification;

/// The receiver of frames of any length up to [`Format::LONGEST`], and never deaf.
///
/// For frames of fixed length of up to 16 bytes there is [`Receiver`](crate::Receiver): it is smaller,
/// faster, and delivers each frame with its last byte. This one takes a buffer `B` and three words. `B` is an
/// array (see [`new`](Self::new)), or a borrowed slice or a `Vec` (see [`with_buffer`](Self::with_buffer)).
///
/// **Make the buffer twice as long as [`Format::LONGEST`].** It must have `LONGEST` bytes at least. When the buffer
/// is full, the pending bytes move to its front. With `LONGEST` bytes a stream of false starts makes them move
/// with each byte; with twice as many a move costs less than one step per byte.
///
/// A completed frame is delivered as a [`Frame`], which is decoded on request.
///
/// # The rule
///
/// From left to right: where a frame begins, it is committed, and the next byte is the one behind it; where none
/// begins, one byte is dropped; where that cannot be known yet, the receiver waits (theorem 13a). So a frame that
/// arrives whole is committed, unless a committed frame that begins before it shares bytes with it (13d).
///
/// # What to expect
///
/// * **Latency.** Behind a false beginning a frame is committed late: at most
///   `LONGEST - its length` bytes behind its last byte, or with the line event (13e). In a stream
///   without errors it is committed with its last byte. Set a failsafe's times accordingly.
/// * **Cost.** [`push`](Self::push) asks the format at most once about at most `LONGEST` bytes, whatever
///   comes (13c). Most bytes are stored and that is all. `framelock-formats` has a table of what a byte
///   costs, in clean streams and in the worst.
/// * **What no receiver can know.** A false frame whose check is right is committed, and with it bytes
///   of a true one. Where the head of a frame is lost, a frame inside its payload is committed.
///
/// # Examples
/// ```
/// use framelock::{BufferedReceiver, DiscardReason, Format, LineEvent, Classification};
///
/// /// `#`, the length of the text, 22 at most, and the text.
/// #[derive(Clone, Copy)]
/// struct Text;
///
/// impl Format for Text {
///     const LONGEST: usize = 24;
///     type Message<'a> = &'a [u8];
///
///     fn classify(&self, bytes: &[u8]) -> Classification {
///         match *bytes {
///             [b'#'] => Classification::Incomplete { at_least: 2 },
///             [b'#', length, ..] if length > 22 => Classification::Rejected(DiscardReason::TooLong),
///             [b'#', length, ..] => match 2 + usize::from(length) {
///                 whole if bytes.len() < whole => Classification::Incomplete { at_least: whole },
///                 whole => Classification::Frame(whole),
///             },
///             _ => Classification::Rejected(DiscardReason::NoSync),
///         }
///     }
///
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { &frame[2..] }
/// }
///
/// let mut receiver = BufferedReceiver::<_, [u8; 48]>::new(Text);
/// let mut received = Vec::new();
/// for byte in *b"#\x03one" {
///     received.extend(receiver.push(byte).map(|frame| frame.message().to_vec()));
/// }
/// assert_eq!(received, [b"one"]);
///
/// // A false start claims that 16 bytes follow. The frame after it waits until a line event delivers it.
/// receiver.feed(b"#\x10#\x03two", |_| unreachable!());
/// assert_eq!(receiver.pending(), 7);
/// receiver.line_event(LineEvent::Idle, |found| {
///     received.extend(found.message().map(|frame| frame.message().to_vec()));
/// });
/// assert_eq!(received, [b"one", b"two"]);
/// ```
/// A buffer that does not hold the longest frame does not compile:
/// ```compile_fail,E0080
/// # use framelock::{BufferedReceiver, Format, Classification};
/// # #[derive(Clone, Copy)]
/// # struct Text;
/// # impl Format for Text {
/// #     const LONGEST: usize = 24;
/// #     type Message<'a> = &'a [u8];
/// #     fn classify(&self, bytes: &[u8]) -> Classification { Classification::Frame(bytes.len()) }
/// #     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { frame }
/// # }
/// const _: BufferedReceiver<Text, [u8; 23]> = BufferedReceiver::new(Text);
/// ```
#[derive(Clone, Debug)]
pub struct BufferedReceiver<F, B> {
    format: F,
    buffer: B,
    /// Pending: `buffer[from..to]`.
    from: usize,
    to: usize,
    /// Nothing can be said of the pending bytes before `to` comes here.
    ask_at: usize,
}

/// What was decided about the first pending byte.
enum Decision {
    /// A frame of so many bytes began there. It lies in front of `from`.
    Frame(usize),
    /// None begins there: it is discarded.
    Discarded,
    /// Nothing is pending, or more bytes are needed.
    Waiting,
}

impl<F: Format, const N: usize> BufferedReceiver<F, [u8; N]> {
    /// Creates a receiver with an array of its own, which has received nothing yet.
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
    /// Creates a receiver that keeps pending bytes in this memory: a borrowed slice, or a `Vec`.
    ///
    /// Returns `None` if the memory is shorter than the format's [`longest`](Format::longest) frame. Better
    /// make it twice as long.
    #[must_use]
    pub fn with_buffer(format: F, buffer: B) -> Option<Self> {
        let longest = format.longest();
        (1 <= longest && longest <= buffer.as_ref().len()).then(|| Self::empty(format, buffer))
    }

    /// Takes the next byte of the stream. Returns the next frame, if one is complete.
    ///
    /// **It asks the format once at most, so it may leave bytes that could be decided, a whole frame among them**:
    /// behind a false beginning each call catches up by one. The following calls go on; where no byte follows soon,
    /// call [`poll`](Self::poll) until it gives nothing, or report the idle line as a [`line_event`](Self::line_event).
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Frame<'_, F>> {
        self.push_with(byte, |_| ())
    }

    /// [`push`](Self::push), with an account of each byte whose outcome it decides.
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

    /// [`push_with`](Self::push_with) for a byte that may decide something.
    // A function of its own, so that a byte that is only stored saves no registers.
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

    /// Decides about bytes that [`push`](Self::push) has left pending. Returns the next frame among them.
    ///
    /// It asks the format once for each pending byte at most.
    pub fn poll(&mut self) -> Option<Frame<'_, F>> {
        self.next(&mut [].as_slice())
    }

    /// Takes bytes from the front of the slice up to the end of the next frame, and leaves the rest in it.
    /// Returns the frame. `None`: no other frame ends in the slice, and all of it is taken. Frames among the
    /// bytes that [`push`](Self::push) has left pending come first.
    ///
    /// A program may stop, return or await between frames. Called until it returns `None`, it delivers the same
    /// frames as [`feed`](Self::feed), in the same order (theorem 13a). It copies every byte, also of frames
    /// that lie whole in the slice: for long slices `feed` is faster.
    ///
    /// # Examples
    /// With `Text` as [above](BufferedReceiver):
    /// ```
    /// # use framelock::{BufferedReceiver, DiscardReason, Format, Classification};
    /// # #[derive(Clone, Copy)]
    /// # struct Text;
    /// # impl Format for Text {
    /// #     const LONGEST: usize = 24;
    /// #     type Message<'a> = &'a [u8];
    /// #     fn classify(&self, bytes: &[u8]) -> Classification {
    /// #         match *bytes {
    /// #             [b'#'] => Classification::Incomplete { at_least: 2 },
    /// #             [b'#', length, ..] if length > 22 => Classification::Rejected(DiscardReason::TooLong),
    /// #             [b'#', length, ..] => match 2 + usize::from(length) {
    /// #                 whole if bytes.len() < whole => Classification::Incomplete { at_least: whole },
    /// #                 whole => Classification::Frame(whole),
    /// #             },
    /// #             _ => Classification::Rejected(DiscardReason::NoSync),
    /// #         }
    /// #     }
    /// #     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { &frame[2..] }
    /// # }
    /// let mut receiver = BufferedReceiver::<_, [u8; 48]>::new(Text);
    /// let mut bytes: &[u8] = b"#\x03one, #\x03two#\x05";
    /// assert_eq!(receiver.next(&mut bytes).unwrap().message(), b"one");
    /// assert_eq!(bytes, b", #\x03two#\x05");
    /// assert_eq!(receiver.next(&mut bytes).unwrap().message(), b"two");
    /// assert!(receiver.next(&mut bytes).is_none());
    /// assert_eq!((bytes.len(), receiver.pending()), (0, 2));
    /// ```
    pub fn next(&mut self, bytes: &mut &[u8]) -> Option<Frame<'_, F>> {
        self.next_with(bytes, |_| ())
    }

    /// [`next`](Self::next), with an account of each byte whose outcome it decides.
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

    /// Stores as many bytes from the front of a slice as may decide about the first pending byte. Returns
    /// whether the slice had any.
    fn store_what_is_missing(&mut self, bytes: &mut &[u8]) -> bool {
        let missing = self.ask_at.saturating_sub(self.to).max(1);
        let (now, later) = bytes.split_at_checked(missing).unwrap_or((*bytes, &[]));
        self.store(now);
        *bytes = later;
        !now.is_empty()
    }

    /// Takes a slice, and says what becomes of all bytes that can be decided, in the order of the
    /// stream. Frames that lie whole in the slice are not copied.
    ///
    /// A stream may be cut into slices anywhere (theorem 13a). It asks the format at most twice for each
    /// byte dropped or frame, and once besides; feeding an empty slice catches up with what `push` has left.
    pub fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Found<Frame<'_, F>>)) {
        let mut rest = bytes;
        while self.pending() > 0 {
            // With as much of the slice as the longest frame may have, the first byte is decided.
            let missing = self.format.longest().saturating_sub(self.pending());
            let (now, later) = rest.split_at_checked(missing).unwrap_or((rest, &[]));
            self.store(now);
            while self.decide_first(&mut found) {}
            if now.len() < missing {
                return;
            }
            rest = self.give_back(bytes, later);
        }
        while !rest.is_empty() {
            let Some(behind) = self.take(rest, &mut found) else {
                return;
            };
            rest = behind;
        }
    }

    /// With all of a slice taken but `rest`: if all that is pending came from the slice, forgets it, and
    /// gives what is to be taken again.
    #[inline]
    fn give_back<'b>(&mut self, bytes: &'b [u8], rest: &'b [u8]) -> &'b [u8] {
        let taken = bytes.len().wrapping_sub(rest.len());
        let Some(back) = taken.checked_sub(self.pending()) else {
            return rest;
        };
        self.reset();
        bytes.get(back..).unwrap_or_default()
    }

    /// With nothing pending: decides about the first bytes of a slice, and gives what is behind them; stores
    /// them all if there are too few.
    #[inline]
    fn take<'b>(
        &mut self,
        bytes: &'b [u8],
        found: &mut impl FnMut(Found<Frame<'_, F>>),
    ) -> Option<&'b [u8]> {
        let run = run_without_start(bytes, |byte| self.format.starts(byte));
        if run > 0 {
            found(Found::discarded(run, DiscardReason::NoSync));
            return bytes.get(run..);
        }
        let classified = bytes.get(..self.format.longest()).unwrap_or(bytes);
        match classify(&self.format, classified, 0) {
            Classification::Frame(length) => {
                let (frame, behind) = bytes.split_at_checked(length)?;
                found(Found::frame(length, Frame::new(self.format, frame)));
                Some(behind)
            }
            Classification::Rejected(why) => {
                found(Found::discarded(1, why));
                bytes.get(1..)
            }
            Classification::Incomplete { at_least } => {
                self.store(bytes);
                self.ask_at = self.from.wrapping_add(at_least);
                None
            }
        }
    }

    /// No more bytes will come for what is pending: the line fell silent, or failed. Frames that lie
    /// whole in it are committed, the rest is dropped, and nothing is pending (theorem 13f).
    ///
    /// It asks the format once for each pending byte at most.
    pub fn line_event(&mut self, _: LineEvent, mut found: impl FnMut(Found<Frame<'_, F>>)) {
        while self.pending() > 0 {
            self.end_first(&mut found);
        }
        self.reset();
    }

    /// With bytes pending, and none to follow: decides about the first.
    fn end_first(&mut self, found: &mut impl FnMut(Found<Frame<'_, F>>)) {
        if !self.decide_first(found) && self.pending() > 0 {
            found(Found::discarded(1, DiscardReason::LineEvent));
            self.from = self.from.wrapping_add(1);
            // `ask_at` described the discarded byte; reset it.
            self.ask_at = 0;
        }
    }

    /// How many of the last bytes are pending: a frame may yet include them. Fewer than `LONGEST`.
    #[must_use]
    pub const fn pending(&self) -> usize {
        self.to.saturating_sub(self.from)
    }

    /// Forgets what is pending, as if nothing had ever been received.
    pub const fn reset(&mut self) {
        (self.from, self.to, self.ask_at) = (0, 0, 0);
    }

    /// The format, to look at.
    #[must_use]
    pub const fn format(&self) -> &F {
        &self.format
    }

    /// Decides about the first pending bytes, and says whether it could.
    fn decide_first(&mut self, found: &mut impl FnMut(Found<Frame<'_, F>>)) -> bool {
        // A frame is reported with its bytes, below.
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

    /// Discards the first pending bytes if they start nothing; then asks the format about those behind
    /// them, once, if anything can be said.
    #[inline]
    fn decide_next(&mut self, mut account: impl FnMut(Found<()>)) -> Decision {
        if self.to < self.ask_at {
            return Decision::Waiting;
        }
        // What was incomplete starts something.
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

    /// Asks the format about the pending bytes, once.
    #[inline]
    fn decide(&mut self, mut account: impl FnMut(Found<()>)) -> Decision {
        let pending = self.buffer.as_ref().get(self.from..self.to);
        let pending = pending.unwrap_or_default();
        if pending.is_empty() {
            self.reset();
            return Decision::Waiting;
        }
        // By law 3 fewer bytes than it takes to ask were incomplete.
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

    /// Returns the frame of this length that ends at `from`.
    #[inline]
    fn frame(&self, length: usize) -> Frame<'_, F> {
        let start = self.from.wrapping_sub(length);
        let bytes = self.buffer.as_ref().get(start..self.from);
        Frame::new(self.format, bytes.unwrap_or_default())
    }

    /// Stores bytes; with those pending they are `LONGEST` at most.
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

    /// Byte by byte: `copy_within` would bring 1.5 KB of `memmove` into firmware.
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
}

/// What the format says of 1 to `LONGEST` bytes, as far as it keeps law 1: so that no format, however
/// wrong, makes the receiver hang, run out of buffer, or go deaf.
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
            if at_least <= bytes.len() || at_least > longest =>
        {
            Classification::Incomplete {
                at_least: bytes.len().wrapping_add(1),
            }
        }
        classification => classification,
    }
}
