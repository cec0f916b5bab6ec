//! The receiver: any format of fixed length, never deaf.
//!
//! Policy [`Rescan`], which differs from the lecture's table in two rows: nothing that may be the
//! start of a frame is thrown away.
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
//!               CR: the message is in force; or none of the five can begin a frame
//! ```
//!
//! The machine of the drawing is what [`pending`](Parser::pending) shows. What runs is simpler:
//! see [`crate::window`].

use core::marker::PhantomData;

use crate::window::{Window, Word};
use crate::{Bin, Format, Frame, Mismatch, Parser, Policy, Rescan, Sink, State, slice};

mod for_proofs;

/// The receiver of the format `F`. Eight bytes for formats of up to eight bytes, else sixteen.
///
/// # Examples
/// The lecture's second example: the line has lost two bytes of the first frame. The lecture's
/// machine loses both frames, the receiver only the broken one.
/// ```
/// use framelock::{Bin, Lecture, Parser, Receiver, Setpoint};
/// let received = [0x41, 0x42, 0x00, 0x4A, 0x0D, 0x41, 0x42, 0x00, 0x82, 0xC4, 0x4A, 0x0D];
/// let mut lecture = Lecture::new();
/// assert!(received.iter().all(|&byte| lecture.push(byte).is_none()));
///
/// let mut receiver = Receiver::<Bin>::new();
/// let mut in_force = None;
/// for byte in received {
///     in_force = receiver.push(byte).or(in_force);
/// }
/// assert_eq!(in_force, Some(Setpoint { pitch: 0x82, roll: 0xC4, yaw: 0x4A }));
/// ```
pub struct Receiver<F: Format, P: Policy = Rescan> {
    window: Window<F::Word>,
    compile_time: PhantomData<(F, P)>,
}

const _: () = assert!(size_of::<Receiver<Bin>>() <= 8);

impl<F: Format, P: Policy> Receiver<F, P> {
    /// At reset: nothing received yet.
    #[must_use]
    pub const fn new() -> Self {
        const {
            assert!(
                F::SHAPE.length() as usize == F::Frame::LENGTH,
                "SHAPE and Frame differ"
            );
            assert!(F::CHECK_KNOWN_AT >= 1, "the check needs a byte");
            assert!(
                F::CHECK_KNOWN_AT <= F::SHAPE.length(),
                "the check needs more than a frame"
            );
        }
        Self::of(Window::EMPTY)
    }

    /// The receiver that has taken the lowest `count` bytes of `history`, newest lowest, since its
    /// last commit; at most one fewer than a frame's are kept. Every reachable state is made by
    /// some such call, and no other.
    #[must_use]
    pub fn holding(history: F::Word, count: u8) -> Self {
        let mut receiver = Self::of(Window::holding(&F::SHAPE, history, count));
        if !P::RESCANS && receiver.pending() < usize::from(receiver.window.count()) {
            receiver.reset();
        }
        receiver
    }

    /// The bytes held, to look at.
    #[must_use]
    pub const fn window(&self) -> Window<F::Word> {
        self.window
    }

    const fn of(window: Window<F::Word>) -> Self {
        Self {
            window,
            compile_time: PhantomData,
        }
    }

    /// The bytes that may yet become a frame: how many at the end of those held.
    fn viable(self) -> u8 {
        (1..F::SHAPE.length())
            .rev()
            .filter(|&known| self.window.holds(known))
            .find(|&known| first_mismatch::<F>(self.window.word(), known).is_none())
            .unwrap_or(0)
    }

    /// Pushes the bytes from `from` to before `to`.
    #[inline(never)]
    fn feed_bytes<S: Sink<F::Message>>(
        &mut self,
        bytes: &[u8],
        from: usize,
        to: usize,
        sink: &mut S,
    ) {
        let part = bytes.get(from..to).unwrap_or_default();
        for (index, &byte) in (from..).zip(part) {
            self.push_into(index, byte, sink);
        }
    }

    /// Takes a slice too short to be searched by blocks: frames whole, and the rest in parts.
    #[inline]
    fn feed_short<S: Sink<F::Message>>(&mut self, bytes: &[u8], sink: &mut S) {
        let mut at = 0;
        loop {
            if self.window == Window::EMPTY {
                at = Self::take_frames(bytes, at, sink);
            }
            let Some(rest @ [_, ..]) = bytes.get(at..) else {
                return;
            };
            at += self.take_some(rest, at, sink);
        }
    }

    /// Takes frames from `at` on, as long as they follow each other; returns the place behind the
    /// last. Nothing may be held.
    #[inline(never)]
    fn take_frames<S: Sink<F::Message>>(bytes: &[u8], mut at: usize, sink: &mut S) -> usize {
        while let Some(message) = bytes.get(at..).and_then(Self::whole_frame) {
            at += F::Frame::LENGTH;
            sink.frame(at - 1, message);
        }
        at
    }

    /// The message of the frame that begins the slice, if one does and a word fits there.
    #[inline]
    fn whole_frame(rest: &[u8]) -> Option<F::Message> {
        // A word may be longer than a frame.
        let unused = 8 * (F::Word::BYTES - u32::from(F::SHAPE.length()));
        let word = F::Word::load(rest)?;
        let differing = (word ^ F::SHAPE.pattern() << unused) & F::SHAPE.mask() << unused;
        if differing != F::Word::ZERO {
            return None;
        }
        let frame = F::Frame::from_word(word >> unused);
        F::check(frame).then(|| F::decode(frame))
    }

    /// Takes a part of a frame, or one byte, of `rest`: what is left of the slice from `at` on, and
    /// not empty. Returns how many bytes it has taken; byte by byte these would do the same.
    #[inline]
    fn take_some<S: Sink<F::Message>>(&mut self, rest: &[u8], at: usize, sink: &mut S) -> usize {
        // The ends of a slice are likely to be parts of frames; between them a word fits.
        let is_end = rest.len() < F::Word::BYTES as usize && self.window == Window::EMPTY;
        if at == 0 || is_end {
            let taken = self.take_part(rest, at, sink);
            if taken > 0 {
                return taken;
            }
        }
        for &byte in rest.iter().take(1) {
            self.push_into(at, byte, sink);
        }
        1
    }

    /// Takes what makes up a frame together with the bytes held, or as much of it as there is;
    /// returns how many bytes these are, or 0 if they do not agree with a frame.
    #[inline(never)]
    fn take_part<S: Sink<F::Message>>(&mut self, rest: &[u8], at: usize, sink: &mut S) -> usize {
        let missing = usize::from(F::SHAPE.length() - self.window.count());
        let part = rest.get(..missing).unwrap_or(rest);
        let mut window = self.window;
        for &byte in part {
            window = window.extended(byte);
        }
        if part.len() < missing {
            if first_mismatch::<F>(window.word(), window.count()).is_some() {
                return 0;
            }
            self.window = window;
            return part.len();
        }
        let frame = F::Frame::from_word(window.word());
        let differing = (window.word() ^ F::SHAPE.pattern()) & F::SHAPE.mask();
        if differing != F::Word::ZERO || !F::check(frame) {
            return 0;
        }
        self.reset();
        sink.frame(at + missing - 1, F::decode(frame));
        missing
    }

    /// Pushes, and tells `sink` of the frame, or of what the byte made the receiver drop.
    fn push_into<S: Sink<F::Message>>(&mut self, index: usize, byte: u8, sink: &mut S) {
        let before = *self;
        if let Some(message) = self.push(byte) {
            sink.frame(index, message);
        } else if S::WANTS_DROPPED {
            // Every start between the oldest that was viable and the oldest that still is. Under
            // Discard all that is held goes with the oldest.
            let seen = before.window.extended(byte).word();
            let (oldest, kept) = (before.viable() + 1, self.viable());
            let dropped = if P::RESCANS { 1 } else { oldest };
            for known in (1..=F::SHAPE.length()).rev() {
                let is_dropped = known > kept && (known == oldest || P::RESCANS && known < oldest);
                if let Some((_, why)) = first_mismatch::<F>(seen, known).filter(|_| is_dropped) {
                    sink.dropped(usize::from(dropped), why);
                }
            }
        }
    }
}

impl<F: Format, P: Policy> Clone for Receiver<F, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<F: Format, P: Policy> Copy for Receiver<F, P> {}

impl<F: Format, P: Policy> PartialEq for Receiver<F, P> {
    fn eq(&self, other: &Self) -> bool {
        self.window == other.window
    }
}

impl<F: Format, P: Policy> Eq for Receiver<F, P> {}

impl<F: Format, P: Policy> core::fmt::Debug for Receiver<F, P> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Receiver").field(&self.window).finish()
    }
}

impl<F: Format, P: Policy> Default for Receiver<F, P> {
    fn default() -> Self {
        Self::new()
    }
}

/// Where a frame that begins with the lowest `known` (1 to the frame's length) bytes of `bytes`
/// fails, if it does: the place, counted from 0, and what that means.
#[inline]
pub(crate) fn first_mismatch<F: Format>(bytes: F::Word, known: u8) -> Option<(u8, Mismatch)> {
    let shape = F::SHAPE;
    let unknown = 8 * u32::from(shape.length() - known);
    // As if the frame were whole: its last byte lowest.
    let aligned = bytes << unknown;
    let differing = ((aligned ^ shape.pattern()) & shape.mask()) >> unknown;
    // From the frame's first byte to the first that differs; past the last known if none does.
    let unused = 8 * (F::Word::BYTES - u32::from(known));
    let place = (differing << unused).leading_zero_bytes();
    let checked_first = F::CHECK_KNOWN_AT <= known && F::CHECK_KNOWN_AT <= place;
    if checked_first && !F::check(F::Frame::from_word(aligned)) {
        return Some((F::CHECK_KNOWN_AT - 1, Mismatch::Check));
    }
    if differing == F::Word::ZERO {
        return None;
    }
    let why = match place {
        0 => Mismatch::NoSync,
        _ if place < shape.sync_length() => Mismatch::BrokenSync,
        _ => Mismatch::Terminator,
    };
    Some((place, why))
}

impl<F: Format, P: Policy> Parser for Receiver<F, P> {
    type Message = F::Message;
    const FRAME_LENGTH: usize = F::Frame::LENGTH;

    /// One step of [`Window::push`], whatever the byte; under [`Discard`](crate::Discard) one
    /// comparison more.
    #[inline]
    fn push(&mut self, byte: u8) -> Option<F::Message> {
        let before = self.window;
        let (after, complete) = before.push(&F::SHAPE, byte, |frame| {
            F::check(F::Frame::from_word(frame))
        });
        self.window = after;
        if complete {
            return Some(F::decode(F::Frame::from_word(before.extended(byte).word())));
        }
        if !P::RESCANS && first_mismatch::<F>(before.with(byte), before.count() + 1).is_some() {
            self.reset();
        }
        None
    }

    /// At most one comparison per byte held.
    fn pending(&self) -> usize {
        usize::from(self.viable())
    }

    fn reset(&mut self) {
        self.window = Window::EMPTY;
    }

    fn feed(&mut self, bytes: &[u8], sink: &mut impl Sink<F::Message>) {
        if let &[byte] = bytes {
            self.push_into(0, byte, sink);
            return;
        }
        if bytes.len() < slice::SHORTEST {
            self.feed_short(bytes, sink);
            return;
        }
        // Byte by byte until every frame that began before the slice is committed or dropped.
        let head = Self::FRAME_LENGTH - 1;
        self.feed_bytes(bytes, 0, head, sink);
        // From there on every frame lies in the slice, and need not go through the window.
        let behind = slice::scan::<F, P, _>(bytes, head - self.pending(), sink);
        // What follows fills the window, unless it begins with an empty one: so it ends in the state
        // that byte by byte leads to.
        self.reset();
        self.feed_bytes(bytes, behind, bytes.len(), sink);
    }
}

impl Receiver<Bin> {
    /// The state as the lecture names it.
    #[must_use]
    pub fn state(&self) -> State {
        *State::ALL.get(self.pending()).unwrap_or(&State::Terminator)
    }

    /// What of pitch, roll and yaw the frame under way has brought so far.
    #[must_use]
    pub fn temp(&self) -> [Option<u8>; 3] {
        let pending = self.viable();
        [3, 4, 5].map(|place: u8| {
            let behind = pending.checked_sub(place + 1)?;
            Some((self.window.history() >> (8 * u32::from(behind))).lowest())
        })
    }
}
