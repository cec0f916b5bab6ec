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
use crate::{Bin, Format, Frame, Mismatch, Parser, Sink, State, slice};

/// What becomes of the bytes behind the one at which a frame went wrong.
pub trait Policy: sealed::Sealed {
    /// Whether they are searched again for the start of a frame.
    const RESCANS: bool;
}

/// They are searched again: no frame that the line delivers whole is ever lost, but to an earlier
/// one that it overlaps.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Rescan {}

/// All are thrown away, as the lecture's machine does: for comparison. It can go deaf.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Discard {}

impl Policy for Rescan {
    const RESCANS: bool = true;
}

impl Policy for Discard {
    const RESCANS: bool = false;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Rescan {}
    impl Sealed for super::Discard {}
}

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
        let count = self.window.count();
        (1..F::SHAPE.length())
            .rev()
            .filter(|&known| known <= count)
            .find(|&known| first_mismatch::<F>(self.window.history(), known).is_none())
            .unwrap_or(0)
    }

    /// Pushes, and tells `sink` of the frame, or of what the byte made the receiver drop.
    fn push_into<S: Sink<F::Message>>(&mut self, index: usize, byte: u8, sink: &mut S) {
        let before = *self;
        if let Some(message) = self.push(byte) {
            sink.frame(index, message);
        } else if S::WANTS_DROPPED {
            // Every start between the oldest that was viable and the oldest that still is. Under
            // Discard all that is held goes with the oldest.
            let seen = before.window.with(byte);
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

    /// One step of [`Window::push`], whatever the byte; under [`Discard`] one comparison more.
    #[inline]
    fn push(&mut self, byte: u8) -> Option<F::Message> {
        let before = self.window;
        let (after, complete) = before.push(&F::SHAPE, byte, |frame| {
            F::check(F::Frame::from_word(frame))
        });
        self.window = after;
        if complete {
            return Some(F::decode(F::Frame::from_word(before.with(byte))));
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
        // Byte by byte until every frame that began before the slice is committed or dropped, and
        // through a short slice to its end.
        let head = if bytes.len() < slice::SHORTEST {
            bytes.len()
        } else {
            Self::FRAME_LENGTH - 1
        };
        for (index, &byte) in bytes.iter().enumerate().take(head) {
            self.push_into(index, byte, sink);
        }
        if head == bytes.len() {
            return;
        }
        // From there on every frame lies in the slice, and need not go through the window.
        let behind = slice::scan::<F, P, _>(bytes, head - self.pending(), sink);
        // What follows fills the window, unless it begins with an empty one: so it ends in the state
        // that byte by byte leads to.
        self.reset();
        for (index, &byte) in bytes.iter().enumerate().skip(behind) {
            self.push_into(index, byte, sink);
        }
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
