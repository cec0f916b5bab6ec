//! Theorem 13: the receiver of frames of any length, for every format.
//!
//! The receiver examines bytes only through its format. So a harness can replace each byte with its *place*, which is
//! the byte's index in the stream. The format may then give, about each place, any answer that the laws of [`Format`]
//! allow. This covers every lawful format on every stream. A [`Row`] holds the format's answers about one place.
//!
//! **The reference**, `framed` of `framelock-proofs`, goes from place to place, and asks the format about the bytes
//! from the place on. If a frame begins at the place, the reference continues after the frame. If no frame begins
//! there, the reference drops one byte. If the format cannot decide yet, the reference stops.
//!
//! An *event* is a frame that is delivered, or a run of bytes that are dropped. Adjacent runs with the same reason
//! count as one run.
//!
//! **13a: equality.** However a stream is cut into slices, and whether the slices are pushed or fed, the receiver has
//! the same events as the reference, in the same order. After `feed` the pending bytes are those about which the
//! reference has not decided.
//!
//! Proof by induction over the receiver's steps. The invariant is [`fits`]: the pending bytes are the places from
//! `start` on, and `start` is the place at which the reference continues. Until the buffer is filled up to `ask_at`,
//! the format answers `Incomplete`. The invariant holds after `new()`. Each step keeps the invariant, and the events of
//! the step are the next events of the reference ([`steps`]):
//!
//! * `decide` asks the format once, about the first pending place. If the answer is a frame or a rejection, the
//!   reference gets the same answer, because more bytes do not change an answer of these two kinds (law 2). Otherwise
//!   both wait.
//! * `discard_what_starts_nothing` drops places that start no frame. By law 4 the reference drops them, too.
//! * `store` adds the next places, also when the pending bytes move to the front. `next` stores as many bytes as the
//!   format needs to decide.
//! * `take` runs while nothing is pending. It performs one of the steps above on bytes of the slice, or stores the
//!   whole slice. The module `noise::verification` covers runs of dropped bytes that are longer than the slices in
//!   these harnesses.
//! * `give_back` has two possible results. Either it returns a slice that begins with the pending bytes, and then
//!   nothing is pending any more. Or it changes nothing.
//!
//! `feed` and `next` are loops of these steps. The loops end where the format answers `Incomplete` about the pending
//! bytes, and there the reference stops, too. `next` also ends after each frame. [`reference`] runs these loops on a
//! few bytes. For more bytes there is only the argument here, which is not machine-checked.
//!
//! **13b: any format, even one that breaks the laws.** Nothing panics. Every call ends. After each call fewer than
//! `LONGEST` bytes are pending. Each byte is either in exactly one event or pending. Each step keeps the part of the
//! invariant that does not concern the format's answers ([`lawless`]). Each iteration of each loop delivers, drops or
//! stores at least one byte, or ends the loop.
//!
//! **13c: `push`** calls `classify_after` at most once. The events of `push` are the reference's next events. If `push`
//! has no event, neither has the reference ([`pushes`]). `push` may leave bytes undecided. `poll`, `feed` of an empty
//! slice, or a line event then classifies these bytes. Each of the three runs a loop that continues from any state that
//! fits (`poll` is `next` of an empty slice). The loops of `feed` and of a line event run the public steps `poll_step`
//! and `line_event_step`. Each step calls `classify_after` and `classify_before` at most once each ([`line_events`]).
//!
//! **13d: completeness.** Each frame in the stream is delivered, unless a delivered frame begins earlier and shares
//! bytes with it. This is proved for the reference ([`reference`]). The reference goes past the frame's first place
//! only by delivering this frame, or an earlier frame that contains the place. If the reference stops before the place,
//! it continues when more bytes follow the frame, or at a line event.
//!
//! **13e: latency.** Let `n` be the length of a frame. The decision about it comes within `LONGEST - n` bytes after its
//! last byte. Suppose that the frame is still undecided when `b` bytes have come after its last byte. Then the `n`
//! bytes of the frame and these `b` bytes are all pending, so by 13b `n + b < LONGEST`. If the format needs only the
//! frame's own bytes to recognise the frame, the bound of `feed` is lower by one: `LONGEST - 1 - n`. While such a frame
//! is undecided, the reference has stopped at an earlier place. The byte at this earlier place is pending, too. Streams
//! exist that reach both bounds ([`reference`]).
//!
//! **13f: a line event** does the same as the reference at the end of a stream. If the format answers `Incomplete`,
//! both ask it [`Format::classify_before`], whose answer is a frame or a rejection. From then on, if
//! [`Format::classify`] rejects a byte, both drop the byte as `LineEvent`. Each frame that lies whole in the pending
//! bytes is delivered, unless a delivered frame begins earlier and shares bytes with it. The other bytes are dropped.
//! [`line_events`] proves one step of the loop, and [`reference`] runs the loop. After a line event nothing is pending,
//! so no later frame contains a byte from before the event.
//!
//! Until the format first answers `Incomplete`, the steps of a line event decide as `feed` does, with the same reasons.
//! So the counters do not depend on whether the bytes before the event were pushed or fed. Only a step of a line event
//! sets `ask_at` to 1: [`steps`] and [`pushes`] show that the other functions do not. The last step of a line event
//! resets the receiver. So `ask_at` is not 1 at the first step of the next event.
//!
//! **13g** is in the crate `framelock-formats`.

mod any_size;
mod lawless;
mod line_events;
mod pushes;
mod reference;
mod steps;

use core::cell::Cell;

use super::BufferedReceiver;
use crate::any_format::{Row, any_before, any_up_to, any_verdict, part};
use crate::{Classification, DiscardReason, Format, LineEvent};

impl<F, const N: usize> BufferedReceiver<F, [u8; N]> {
    /// Creates a receiver in this state: `buffer[from..to]` is pending, and nothing is decided before `to` reaches
    /// `ask_at`. The proofs about the receivers in C use this function.
    pub fn in_state(format: F, buffer: [u8; N], [from, to, ask_at]: [usize; 3]) -> Self {
        Self {
            format,
            buffer,
            from,
            to,
            ask_at,
        }
    }

    /// Returns the receiver's state: `buffer`, and `from`, `to` and `ask_at`.
    pub fn state(&self) -> ([u8; N], [usize; 3])
    where
        F: Copy,
    {
        (self.buffer, [self.from, self.to, self.ask_at])
    }
}

/// Returns the byte that stands for a place: the lowest byte of the place, which is an index.
fn byte(place: usize) -> u8 {
    place.to_le_bytes()[0]
}

/// Returns whether these bytes stand for consecutive places, the first of which is `from`. Examines only one byte, at
/// an arbitrary index. So use the result in assertions, not in assumptions.
fn are_places(bytes: &[u8], from: usize) -> bool {
    let at = usize::from(kani::any::<u8>());
    at >= bytes.len() || bytes[at] == byte(from.wrapping_add(at))
}

/// The questions that the format was asked during one step.
#[derive(Default)]
struct Asked {
    /// The place and the number of bytes about which the format was asked, if it was asked.
    now: Cell<Option<(usize, usize)>>,
    /// The answer of [`Format::classify_before`], if the format was asked this question.
    before: Cell<Option<Classification>>,
}

/// Any format during one step of the receiver. In a step, the receiver calls [`Format::classify_after`] and
/// [`Format::classify_before`] at most once each, about the same bytes.
#[derive(Clone, Copy)]
struct Any<'a, const L: usize> {
    /// The answers about the place. `None` stands for arbitrary answers, which may break the laws.
    row: Option<Row>,
    /// The places that start a frame, as bits.
    starts: u32,
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

    /// Returns the number of bytes that decide the classification at a place.
    fn settled_at(&self, place: usize) -> usize {
        match self.row {
            None => L,
            // By law 4, one byte decides.
            Some(_) if !self.starts_at(place) => 1,
            Some(row) => row.settled_at,
        }
    }

    /// Returns the first place in `from..end` that starts a frame, or `end`.
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
        assert!(self.asked.now.get().is_none());
        assert!(!bytes.is_empty() && bytes.len() <= L);
        let place = usize::from(bytes[0]);
        assert!(are_places(bytes, place));
        self.asked.now.set(Some((place, bytes.len())));
        let Some(row) = self.row else {
            return any_verdict();
        };
        kani::assume(
            self.starts_at(place)
                || row.settled_at == 1
                    && row.settled == Classification::Rejected(DiscardReason::NoSync),
        );
        // `classify_after` demands that the first `seen` bytes are incomplete.
        assert!(seen < row.settled_at);
        row.classify(bytes.len())
    }

    fn classify_before(&self, bytes: &[u8], _: LineEvent) -> Classification {
        assert!(self.asked.before.get().is_none());
        assert!(!bytes.is_empty() && bytes.len() <= L);
        let place = usize::from(bytes[0]);
        assert!(are_places(bytes, place));
        let before = match self.row {
            None => any_verdict(),
            Some(row) => {
                // Law 6 concerns only incomplete bytes.
                assert!(self.starts_at(place) && row.settled(bytes.len()).is_none());
                any_before(bytes.len())
            }
        };
        self.asked.before.set(Some(before));
        before
    }

    fn starts(&self, byte: u8) -> bool {
        self.starts_at(usize::from(byte))
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

/// Returns a receiver in any state that [fits]. At most `most` bytes are pending. A pending byte at index `i` of the
/// buffer stands for the place `i`.
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

/// Returns whether the invariant holds: the pending bytes are the `pending` places from `start` on. Until the buffer is
/// filled up to `ask_at`, the classification at `start` is undecided. Use this function in assertions, not in
/// assumptions.
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
        && are_places(part(&receiver.buffer, from, to), start)
}

fn waits_for_what_is_not_settled<const L: usize, const N: usize>(
    receiver: &BufferedReceiver<Any<'_, L>, [u8; N]>,
    settled_at: usize,
) -> bool {
    // If nothing is pending, the format has not yet been asked about the next byte.
    let settled_at = if receiver.from == receiver.to {
        1
    } else {
        settled_at
    };
    receiver.ask_at <= receiver.from + settled_at
}

/// Defines one harness for each listed value of `LONGEST`, each with its own buffer size.
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
            of_1 1 2 3 of_3 3 5 6 of_8 8 8 9);
    };
}
use for_longest;
