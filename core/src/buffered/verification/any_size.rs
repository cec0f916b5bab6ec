//! Theorems 1 and 13b for large sizes: frames, buffers and slices of any length up to 4096 bytes, and a format that
//! gives arbitrary answers. No function panics, and each keeps the invariant of [`fits`].
//!
//! The harnesses start from any state, and run the public functions as a whole. They ignore executions in which a
//! function asks the format more questions than the harness allows: at most one call of `classify_after`, and at most
//! two calls of `starts`. Further questions come from later iterations of the same loop. Like the first iteration, the
//! later ones start from a state that satisfies the invariant. [`feed`] ends at the first question, and [`feed_on`] and
//! [`take`] run the steps of the two loops of `feed`.
//!
//! Only the number of bytes matters, because the format does not look at the bytes. So the buffer of these receivers
//! has a length, but forgets the bytes that are written into it. The harnesses in [`steps`](super::steps) show, for
//! smaller buffers, that bytes are copied to the right places. [`pending_bytes_move`] shows this for moving 32 bytes.

use core::cell::Cell;

use super::{BufferedReceiver, are_places, byte};
use crate::any_format::{any_mismatch, any_up_to, part};
use crate::{Classification, Format, Found, LineEvent};

/// The largest size.
const MOST: usize = 4096;

static BYTES: [u8; MOST] = [0; MOST];

/// Returns any number up to [`MOST`].
fn any_number() -> usize {
    let number = usize::from(kani::any::<u16>());
    kani::assume(number <= MOST);
    number
}

/// Returns a slice of any length up to [`MOST`].
fn any_slice() -> &'static [u8] {
    part(&BYTES, 0, any_number())
}

/// A buffer of any length up to [`MOST`] that forgets what is written into it.
struct AnyBuffer(&'static [u8]);

impl AsRef<[u8]> for AnyBuffer {
    fn as_ref(&self) -> &[u8] {
        self.0
    }
}

impl AsMut<[u8]> for AnyBuffer {
    fn as_mut(&mut self) -> &mut [u8] {
        &mut []
    }
}

/// A format that gives arbitrary answers to a limited number of questions.
#[derive(Clone, Copy)]
struct Anything<'a> {
    longest: usize,
    /// The number of calls of `starts` that are still allowed. `None` means that each byte starts a frame.
    starts: Option<&'a Cell<u8>>,
    /// The number of calls of `classify_after` that are still allowed.
    questions: &'a Cell<u8>,
}

/// Lowers the counter by one. Ignores executions in which it is 0 already.
fn count_down(counter: &Cell<u8>) {
    kani::assume(counter.get() > 0);
    counter.set(counter.get() - 1);
}

fn any_answer() -> Classification {
    let number = any_number();
    // 0 becomes the largest `usize`, which stands for all numbers that are far too large.
    let number = if number == 0 { usize::MAX } else { number };
    match kani::any::<u8>() {
        0 => Classification::Frame(number),
        1 => Classification::Incomplete { at_least: number },
        _ => Classification::Rejected(any_mismatch()),
    }
}

impl Format for Anything<'_> {
    const LONGEST: usize = MOST;
    type Message<'a> = &'a [u8];

    fn longest(&self) -> usize {
        self.longest
    }

    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        assert!(!bytes.is_empty() && bytes.len() <= self.longest);
        assert!(seen < bytes.len());
        count_down(self.questions);
        any_answer()
    }

    fn classify_before(&self, bytes: &[u8], _: LineEvent) -> Classification {
        assert!(!bytes.is_empty() && bytes.len() <= self.longest);
        any_answer()
    }

    fn starts(&self, _: u8) -> bool {
        self.starts.is_none_or(|starts| {
            count_down(starts);
            kani::any()
        })
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

type AnyReceiver<'a> = BufferedReceiver<Anything<'a>, AnyBuffer>;

/// Returns a receiver in any state in which fewer bytes are pending than the longest frame has.
fn any_receiver<'a>(starts: Option<&'a Cell<u8>>, questions: &'a Cell<u8>) -> AnyReceiver<'a> {
    let (buffer, longest) = (any_slice(), any_number());
    kani::assume(1 <= longest && longest <= buffer.len());
    let format = Anything {
        longest,
        starts,
        questions,
    };
    let (buffer, from, to) = (AnyBuffer(buffer), any_number(), any_number());
    let ask_at = any_number() + any_number();
    let receiver = BufferedReceiver {
        format,
        buffer,
        from,
        to,
        ask_at,
    };
    kani::assume(fits(&receiver));
    receiver
}

/// Returns whether the invariant holds: fewer bytes are pending than the longest frame has, and the receiver waits for
/// no more bytes than this frame has.
fn fits(receiver: &AnyReceiver<'_>) -> bool {
    let (from, to, longest) = (receiver.from, receiver.to, receiver.format.longest);
    from <= to
        && to <= receiver.buffer.0.len()
        && to - from < longest
        && receiver.ask_at <= from + if from == to { 1 } else { longest }
}

/// Adds the number of an outcome's bytes, which is never 0.
fn add<T>(total: &mut usize, found: &Found<T>) {
    assert!(found.bytes() > 0);
    *total += found.bytes();
}

#[kani::proof]
#[kani::unwind(4)]
fn push() {
    let (starts, questions) = (Cell::new(2), Cell::new(1));
    let mut receiver = any_receiver(Some(&starts), &questions);
    let (is_moved, before) = (receiver.to == receiver.buffer.0.len(), receiver.pending());
    let mut placed = 0;
    let frame = receiver.push_with(kani::any(), |one| add(&mut placed, &one));
    let frame = frame.map_or(0, |frame| frame.bytes().len());
    assert!(frame <= placed);
    // If the pending bytes move, this buffer has no place for them. Then they are no longer pending.
    assert!(is_moved || fits(&receiver) && placed + receiver.pending() == before + 1);
    kani::cover!(frame == MOST - 1, "a long frame");
    kani::cover!(is_moved, "the pending bytes move");
}

/// A line event calls `line_event_step`, which calls `poll_step`. So this harness covers the steps, too.
#[kani::proof]
#[kani::unwind(4)]
fn line_event() {
    let (starts, questions) = (Cell::new(1), Cell::new(1));
    let mut receiver = any_receiver(Some(&starts), &questions);
    let (before, mut placed) = (receiver.pending(), 0);
    receiver.line_event(LineEvent::Idle, |found| add(&mut placed, &found));
    assert!(placed == before && receiver.pending() == 0 && fits(&receiver));
    kani::cover!(placed == MOST - 1, "the most that is pending");
}

/// Here each byte starts a frame. [`push`] and [`line_event`] cover bytes that start none.
#[kani::proof]
#[kani::unwind(4)]
fn next() {
    let questions = Cell::new(1);
    let mut receiver = any_receiver(None, &questions);
    let mut rest = any_slice();
    let is_moved = rest.len() > receiver.buffer.0.len() - receiver.to;
    let frame = receiver.next_with(&mut rest, |_| ());
    let has_frame = frame.is_some();
    assert!(has_frame || rest.is_empty());
    assert!(is_moved || fits(&receiver));
    kani::cover!(has_frame && rest.len() > MOST / 2, "a frame");
    kani::cover!(!has_frame && receiver.pending() == MOST - 1, "bytes wait");
}

/// `take` delivers or drops the first bytes of a slice, or stores the whole slice. Here each byte starts a frame.
/// `noise::verification` covers bytes that start none.
#[kani::proof]
#[kani::unwind(4)]
fn take() {
    let questions = Cell::new(1);
    let mut receiver = any_receiver(None, &questions);
    let bytes = any_slice();
    kani::assume(receiver.pending() == 0 && !bytes.is_empty());
    let is_moved = bytes.len() > receiver.buffer.0.len() - receiver.to;
    let mut placed = 0;
    let rest = receiver.take(bytes, &mut |found| add(&mut placed, &found));
    let left = rest.map_or(0, <[u8]>::len);
    assert!(is_moved || placed + receiver.pending() + left == bytes.len());
    assert!(is_moved || fits(&receiver));
    kani::cover!(placed == MOST, "the longest frame");
}

/// `feed` as a whole, up to the first question. After this question, `feed` performs the steps of [`feed_on`] and
/// [`take`].
#[kani::proof]
#[kani::unwind(3)]
fn feed() {
    let questions = Cell::new(0);
    let mut receiver = any_receiver(None, &questions);
    let bytes = any_slice();
    let is_moved = bytes.len() > receiver.buffer.0.len() - receiver.to;
    let before = receiver.pending() + bytes.len();
    receiver.feed(bytes, |_| {
        unreachable!("nothing is found before the first question")
    });
    assert!(is_moved || fits(&receiver) && receiver.pending() == before);
    kani::cover!(receiver.pending() == MOST - 1, "bytes wait");
}

/// The steps of `feed` while bytes are pending. For short slices, [`steps`](super::steps) proves `give_back` after any
/// number of bytes have been taken.
#[kani::proof]
#[kani::unwind(3)]
fn feed_on() {
    let questions = Cell::new(1);
    let mut receiver = any_receiver(None, &questions);
    kani::assume(receiver.pending() > 0);
    let bytes = any_slice();
    let mut rest = bytes;
    let is_moved = rest.len() > receiver.buffer.0.len() - receiver.to;
    let (before, mut placed) = (receiver.pending() + rest.len(), 0);
    let is_enough = receiver.store_up_to_longest(&mut rest);
    receiver.poll_step(|found| add(&mut placed, &found));
    assert!(is_moved || fits(&receiver) && placed + receiver.pending() + rest.len() == before);
    if is_enough {
        let left = receiver.pending() + rest.len();
        rest = receiver.give_back(bytes, rest);
        assert!(is_moved || fits(&receiver) && receiver.pending() + rest.len() == left);
    }
    kani::cover!(placed == MOST, "the longest frame");
    kani::cover!(rest.len() == MOST - 1, "the slice has the pending bytes");
}

/// The pending bytes move to the front of a buffer of 32 bytes, in their order.
#[kani::proof]
#[kani::unwind(33)]
fn pending_bytes_move() {
    const SIZE: usize = 32;
    let questions = Cell::new(0);
    let format = Anything {
        longest: SIZE,
        starts: None,
        questions: &questions,
    };
    let (from, to, waits_for) = (any_up_to(SIZE), any_up_to(SIZE), any_up_to(SIZE));
    kani::assume(from <= to);
    let buffer: [u8; SIZE] = core::array::from_fn(byte);
    let ask_at = from + waits_for;
    let mut receiver = BufferedReceiver {
        format,
        buffer,
        from,
        to,
        ask_at,
    };
    receiver.move_to_front();
    assert!((receiver.from, receiver.to, receiver.ask_at) == (0, to - from, waits_for));
    assert!(are_places(part(&receiver.buffer, 0, to - from), from));
    kani::cover!(from == 1 && to == SIZE, "many bytes");
}
