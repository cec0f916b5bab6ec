//! Theorem 13: the receiver of frames of any length, for every format at once.
//!
//! The receiver looks at bytes only through its format, so a harness may number the bytes by their
//! places in the stream, and let the format say anything that the laws of [`Format`] allow about each
//! place. That is every lawful format on every stream. [`Row`] is what it says about one place.
//!
//! **The reference**, `framed` of `framelock-proofs`, goes from place to place. It asks the format
//! about all that follows; where a frame begins it goes on behind it, where none begins it drops one
//! byte, and where that cannot be known yet it stops.
//!
//! **13a: equality.** However a stream is cut into slices, pushed or fed, the receiver's events are the
//! reference's, in the same order, and what is pending after `feed` is what the reference leaves.
//!
//! Proof by induction over the receiver's steps. The invariant ([`fits`]): what is pending are the places
//! from some `start` on, where the reference goes on, and with fewer bytes than `ask_at` waits for the
//! format says `Incomplete`. It holds after `new()`. Each step keeps it, and its events are the
//! reference's next ones ([`steps`]):
//!
//! * `decide` asks the format once, about the first pending place. A frame or a drop is what the
//!   reference finds there, for by law 2 more bytes do not change it. Else both wait.
//! * `discard_what_starts_nothing` drops places that start nothing, and by law 4 so does the reference.
//! * `store` adds the next places, also where what is pending moves to the front; `next` stores as many as decide.
//! * `take`, with nothing pending, does one of these in the slice, or stores the whole slice. Runs longer than its
//!   slices here are in `noise::verification`.
//! * `give_back` leaves nothing pending, and a slice that begins where the pending bytes did.
//!
//! `feed` and `next` are loops of them. They end where the format has said `Incomplete` of what is pending, or
//! would: there the reference stops as well; and `next` behind each frame. [`reference`] runs their loops
//! on a few bytes; that they do the same on more is this argument in words.
//!
//! **13b: no law is needed** for this: nothing panics, every call ends, fewer than `LONGEST` bytes are
//! pending after it, and each byte is in exactly one event or pending. Each step keeps the invariant but
//! for what it says of the format ([`lawless`]). Each round of each loop decides about at least one
//! byte, or ends the loop.
//!
//! **13c: `push`** asks the format at most once. Its events are the reference's next ones; without any, none
//! is due ([`pushes`]). What it leaves, `poll`, `feed` of an empty slice or a line event decides,
//! since their loops go on from any state that fits (`poll` is `next` of an empty slice).
//!
//! **13d: never deaf.** Each frame that the stream holds is committed, unless a committed frame that begins
//! before it shares bytes with it. This is shown of the reference ([`reference`]): it passes no place
//! without a frame there, or one that reaches over it; and if it stops before the place, the bytes behind
//! the frame, or a line event, make it go on.
//!
//! **13e: latency.** A frame of `n` bytes is decided about at most `LONGEST - n` bytes behind its last.
//! For if it is not when `b` bytes have come behind its last, all of these are pending: `n + b < LONGEST`
//! (13b). `feed` is one byte earlier, `LONGEST - 1 - n`, if the format knows the frame by its own bytes:
//! then the reference has stopped at an earlier place, whose byte is pending as well. Both are sharp
//! ([`reference`]).
//!
//! **13f: a line event** does what the reference does at the end of a stream: it commits the frames that
//! lie whole in what is pending, and drops the other bytes ([`line_events`] has a round of its loop,
//! [`reference`] runs the loop). Then nothing is pending, so no later frame has a byte from before it.
//!
//! **13g** is in the crate `framelock-formats`.

mod lawless;
mod line_events;
mod pushes;
mod reference;
mod steps;

use core::cell::Cell;

use super::BufferedReceiver;
use crate::any_format::{Row, any_up_to, any_verdict};
use crate::{Classification, DiscardReason, Format};

/// The byte that stands at a place.
fn byte(place: usize) -> u8 {
    place.to_le_bytes()[0]
}

/// Whether these are the bytes from a place on. It looks at one of them, which may be any: to be asserted,
/// not assumed.
fn are_places(bytes: &[u8], from: usize) -> bool {
    let at = usize::from(kani::any::<u8>());
    at >= bytes.len() || bytes[at] == byte(from.wrapping_add(at))
}

/// A place and a number of bytes, once a format was asked about them.
type Asked = Cell<Option<(usize, usize)>>;

/// Any format, as far as one step asks it: about one place, once.
#[derive(Clone, Copy)]
struct Any<'a, const L: usize> {
    /// What it says there. If nothing, anything: it need not keep the laws.
    row: Option<Row>,
    /// Which places start a frame.
    starts: u32,
    /// The question that it was asked: the first place, and the number of bytes.
    asked: &'a Asked,
}

impl<'a, const L: usize> Any<'a, L> {
    fn lawful(asked: &'a Asked) -> Self {
        Self {
            row: Some(Row::any(L)),
            ..Self::lawless(asked)
        }
    }

    fn lawless(asked: &'a Asked) -> Self {
        Self {
            row: None,
            starts: kani::any(),
            asked,
        }
    }

    fn starts_at(&self, place: usize) -> bool {
        self.starts >> (place % 32) & 1 == 1
    }

    /// How many bytes it takes until it is settled what begins at a place.
    fn settled_at(&self, place: usize) -> usize {
        match self.row {
            None => L,
            // Law 4.
            Some(_) if !self.starts_at(place) => 1,
            Some(row) => row.settled_at,
        }
    }

    /// The first place that starts a frame, from one on and before another, or that.
    fn first_start(&self, from: usize, end: usize, most: usize) -> usize {
        let mut first = end;
        let mut back = most;
        while back > 0 {
            back -= 1;
            if from + back < end && self.starts_at(from + back) {
                first = from + back;
            }
        }
        first
    }
}

impl<const L: usize> Format for Any<'_, L> {
    const LONGEST: usize = L;
    type Message<'a> = &'a [u8];

    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        assert!(self.asked.get().is_none());
        assert!(!bytes.is_empty() && bytes.len() <= L);
        let place = usize::from(bytes[0]);
        assert!(are_places(bytes, place));
        self.asked.set(Some((place, bytes.len())));
        let Some(row) = self.row else {
            return any_verdict();
        };
        kani::assume(
            self.starts_at(place)
                || row.settled_at == 1
                    && row.settled == Classification::Rejected(DiscardReason::NoSync),
        );
        // Law 5: what was seen was incomplete.
        assert!(seen < row.settled_at);
        row.classify(bytes.len())
    }

    fn starts(&self, byte: u8) -> bool {
        self.starts_at(usize::from(byte))
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

/// A receiver in any state that [fits], with up to `most` bytes pending: the places from `from` on.
fn any_receiver<const L: usize, const N: usize>(
    format: Any<'_, L>,
    most: usize,
) -> BufferedReceiver<Any<'_, L>, [u8; N]> {
    let (from, to, ask_at) = (any_up_to(N), any_up_to(N), any_up_to(N + L));
    kani::assume(from <= to && to - from <= most);
    let mut buffer = [u8::MAX; N];
    let mut place = 0;
    while place < N {
        if from <= place && place < to {
            buffer[place] = byte(place);
        }
        place += 1;
    }
    let settled_at = format.settled_at(from);
    let receiver = BufferedReceiver {
        format,
        buffer,
        from,
        to,
        ask_at,
    };
    kani::assume(waits_for_what_is_not_settled(&receiver, settled_at));
    receiver
}

/// The invariant: so many bytes are pending, the places from `start` on, and what begins there is not
/// settled with fewer bytes than `ask_at` waits for. To be asserted.
fn fits<const L: usize, const N: usize>(
    receiver: &BufferedReceiver<Any<'_, L>, [u8; N]>,
    start: usize,
    pending: usize,
    settled_at: usize,
) -> bool {
    let (from, to) = (receiver.from, receiver.to);
    from <= to
        && to <= N
        && to - from == pending
        && pending <= L
        && waits_for_what_is_not_settled(receiver, settled_at)
        && are_places(&receiver.buffer[from..to], start)
}

fn waits_for_what_is_not_settled<const L: usize, const N: usize>(
    receiver: &BufferedReceiver<Any<'_, L>, [u8; N]>,
    settled_at: usize,
) -> bool {
    // Of a place that has not come yet nothing is known.
    let settled_at = if receiver.from == receiver.to {
        1
    } else {
        settled_at
    };
    receiver.ask_at <= receiver.from + settled_at
}

/// A harness for each longest frame, with a buffer of its size and a larger one.
macro_rules! for_longest {
    ($module:ident, $proof:ident: $($name:ident $longest:literal $size:literal $bound:literal)*) => {
        mod $module {
            $(
                #[kani::proof]
                #[kani::unwind($bound)]
                fn $name() {
                    super::$proof::<$longest, $size>();
                }
            )*
        }
    };
    ($module:ident, $proof:ident) => {
        crate::buffered::verification::for_longest!($module, $proof:
            of_1 1 2 5 of_3 3 5 7 of_8 8 8 11);
    };
}
use for_longest;
