//! 13c: `push` as a whole, from any state.

use core::cell::Cell;

use super::{Any, Asked, any_receiver, are_places, byte, fits, for_longest};
use crate::any_format::any_up_to;
use crate::{BufferedReceiver, Classification, DiscardReason, Format, Found};

/// `push` classifies at most once ([`Any`] asserts this). Until `ask_at` is reached, `push` only stores the byte.
/// Otherwise it first drops the pending bytes before the first byte that starts a frame. Then it delivers the frame
/// that begins with this byte, or drops this byte, or waits. If `push` decides nothing, neither does the reference.
fn one_question_at_most<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawful(&asked), L - 1);
    let (from, end) = (receiver.from, receiver.to + 1);
    let is_due = receiver.ask_at <= end;
    let first = receiver.format.first_start(from, end, L);
    let run = first - from;
    let row = receiver.format.row.unwrap();

    let mut drops = [None; 2];
    let mut frame = None;
    let found = receiver.push_with(byte(end - 1), |one| match one {
        Found::Discarded { count, why } => {
            let next = usize::from(drops[0].is_some());
            assert!(drops[next].is_none() && frame.is_none());
            drops[next] = Some((count, why));
        }
        Found::Frame { length, .. } => {
            assert!(frame.is_none());
            frame = Some(length);
        }
    });
    let found = found.map(|frame| {
        assert!(are_places(frame.message(), first));
        frame.bytes().len()
    });
    assert!(found == frame);

    let settled = row.settled(end - first);
    let mut expected = [None; 2];
    let mut start = from;
    let mut settled_at = receiver.format.settled_at(from);
    if is_due {
        if run > 0 {
            expected[0] = Some((run, DiscardReason::NoSync));
        }
        start = first;
        settled_at = row.settled_at;
    } else {
        // `push` decides nothing here, and neither does the reference.
        assert!(run == 0 && settled.is_none());
    }
    let mut committed = None;
    if is_due && first < end {
        assert!(receiver.format.asked.now.get() == Some((first, end - first)));
        match settled {
            Some(Classification::Rejected(why)) => {
                expected[usize::from(run > 0)] = Some((1, why));
                start += 1;
                settled_at = 1;
            }
            Some(Classification::Frame(length)) => {
                committed = Some(length);
                start += length;
                settled_at = 1;
            }
            _ => {}
        }
    } else {
        assert!(receiver.format.asked.now.get().is_none());
    }
    assert!(drops == expected && frame == committed);
    assert!(end - start < L && fits(&receiver, start, end - start, settled_at));
    assert!(!receiver.has_rule_begun());
    kani::cover!(
        start == end - 1 && frame == Some(L - 1),
        "undecided bytes are left"
    );
    kani::cover!(frame == Some(L), "the longest frame");
}
for_longest!(push, one_question_at_most: of_3 3 5 6 of_5 5 5 6);

/// A format that searches for a delimiter and does not find it. It counts the bytes that it examines.
#[derive(Clone, Copy)]
struct Searching<'a>(&'a Cell<usize>);

impl Format for Searching<'_> {
    const LONGEST: usize = 8;
    type Message<'a> = ();

    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.0.set(self.0.get() + bytes.len() - seen);
        Classification::Incomplete {
            at_least: bytes.len() + 1,
        }
    }

    fn starts(&self, _: u8) -> bool {
        true
    }

    fn decode(&self, _: &[u8]) {}
}

/// While a frame is incomplete, a format that searches for a delimiter examines each byte once, because the receiver
/// tells the format how many bytes it has already examined.
#[kani::proof]
#[kani::unwind(8)]
fn each_byte_is_searched_once() {
    let examined = Cell::new(0);
    let mut receiver = BufferedReceiver::<_, [u8; 8]>::new(Searching(&examined));
    let count = any_up_to(7);
    let mut pushed = 0;
    while pushed < count {
        assert!(receiver.push(kani::any()).is_none());
        pushed += 1;
        assert!(examined.get() == pushed);
    }
    kani::cover!(count == 7, "seven bytes");
}
