//! 13b, for a format whose answers may break every law.
//!
//! The invariant is [`fits`], where `settled_at` is `LONGEST`: at most `LONGEST` bytes decide the classification at a
//! place. [`steps`](super::steps) proves, without using any law, that `store`, `discard_what_starts_nothing` and
//! `give_back` keep this invariant.

use super::{Any, Asked, any_receiver, are_places, byte, fits, for_longest};
use crate::any_format::{any_up_to, any_verdict, part};
use crate::buffered::Decision;
use crate::{BufferedReceiver, Classification, DiscardReason, Format, Found, Line};

/// A format whose longest frame has this many bytes.
#[derive(Clone, Copy)]
struct Longest(usize);

impl Format for Longest {
    const LONGEST: usize = usize::MAX;
    type Message<'a> = ();

    fn longest(&self) -> usize {
        self.0
    }

    fn classify(&self, _: &[u8]) -> Classification {
        Classification::Frame(self.0)
    }

    fn decode(&self, _: &[u8]) {}
}

/// `with_buffer` creates a receiver if and only if the longest frame has at least one byte and fits into `memory`.
#[kani::proof]
fn memory_holds_the_longest_frame() {
    let longest = kani::any();
    let mut memory = [0; 3];
    let memory = memory.get_mut(..any_up_to(3)).unwrap();
    let is_held = (1..=memory.len()).contains(&longest);
    assert!(BufferedReceiver::with_buffer(Longest(longest), memory).is_some() == is_held);
    kani::cover!(is_held, "the memory holds the longest frame");
}

/// A format that gives the same answer about any bytes.
#[derive(Clone, Copy)]
struct Says(Classification);

impl Format for Says {
    const LONGEST: usize = 1;
    type Message<'a> = ();

    fn classify(&self, _: &[u8]) -> Classification {
        self.0
    }

    fn decode(&self, _: &[u8]) {}
}

/// The default `starts` accepts exactly the bytes that the format does not reject with `NoSync`.
#[kani::proof]
fn what_is_not_rejected_starts() {
    let classification = any_verdict();
    let starts = Says(classification).starts(kani::any());
    assert!(starts == (classification != Classification::Rejected(DiscardReason::NoSync)));
    kani::cover!(!starts, "a byte that starts no frame");
    kani::cover!(starts, "a byte that starts a frame");
}

/// `poll` finds a frame among the bytes that `push` has left undecided. The harness calls `poll` on the receiver and on
/// a [`Line`].
#[kani::proof]
#[kani::unwind(3)]
fn what_is_left_is_found() {
    let classification = any_verdict();
    let mut receiver = BufferedReceiver::<_, [u8; 1]>::new(Says(classification));
    receiver.store(&[0]);
    let is_frame = classification == Classification::Frame(1);
    assert!(receiver.clone().poll().is_some() == is_frame);
    assert!(Line::new(receiver).poll().is_some() == is_frame);
    kani::cover!(is_frame, "a frame");
}

/// If bytes are pending, `decide` delivers or drops at least one of them, or demands at least one more byte. With
/// `LONGEST` bytes pending it always delivers or drops.
fn something_is_decided<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawless(&asked), L);
    let (from, pending) = (receiver.from, receiver.pending());
    kani::assume(receiver.ask_at <= receiver.to);
    let mut discarded = 0;
    let decision = receiver.decide(|one| {
        if let Found::Discarded { count, .. } = one {
            discarded += count;
        }
    });
    let decided = match decision {
        Decision::Frame(length) => {
            assert!(receiver.frame(length).bytes().len() == length && length > 0);
            length
        }
        Decision::Discarded => discarded,
        Decision::Waiting => 0,
    };
    assert!(decided <= pending && discarded <= 1);
    assert!(discarded == 0 || matches!(decision, Decision::Discarded));
    assert!(!receiver.has_rule_begun());
    let left = pending - decided;
    let start = if left == 0 { 0 } else { from + decided };
    assert!(fits(&receiver, start, left, L));
    if decided == 0 {
        assert!(pending < L && (pending == 0 || receiver.ask_at > receiver.to));
    }
    kani::cover!(decided == L, "the longest frame");
    kani::cover!(L == 1 || decided == 0 && pending > 0, "the receiver waits");
}
for_longest!(decide, something_is_decided);

/// `push` loses no byte. Afterwards the new byte, and each byte that was pending, is delivered, discarded or pending.
fn pushed_byte_is_placed<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawless(&asked), L - 1);
    let (from, end) = (receiver.from, receiver.to + 1);
    let mut placed = 0;
    let found = receiver.push_with(byte(end - 1), |one| placed += one.bytes());
    let frame = found.map(|frame| frame.bytes().len());
    assert!(frame != Some(0));
    assert!(placed >= frame.unwrap_or(0));
    assert!(placed <= end - from);
    let left = end - from - placed;
    assert!(left < L && fits(&receiver, from + placed, left, L));
    kani::cover!(frame == Some(L), "the longest frame");
    kani::cover!(L == 1 || left == L - 1, "most is left");
}
for_longest!(push, pushed_byte_is_placed: of_1 1 2 3 of_3 3 5 6 of_5 5 5 6);

/// `take` delivers or discards the first bytes of the slice in one event, or leaves the whole slice pending.
fn slice_is_placed<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawless(&asked), 0);
    let mut bytes = [0; N];
    let mut place = 0;
    while place < N {
        bytes[place] = byte(place);
        place += 1;
    }
    let length = any_up_to(N);
    kani::assume(length > 0);
    let mut placed = 0;
    let rest = receiver.take(part(&bytes, 0, length), &mut |found| {
        assert!(placed == 0);
        placed = match found {
            Found::Frame { length, message } => {
                assert!(message.bytes().len() == length);
                length
            }
            Found::Discarded { count, .. } => count,
        };
    });
    if let Some(rest) = rest {
        assert!(placed > 0 && rest.len() == length - placed && are_places(rest, placed));
        assert!(receiver.pending() == 0);
    } else {
        assert!(placed == 0 && length < L && fits(&receiver, 0, length, L));
    }
    kani::cover!(placed == L, "the longest frame");
    kani::cover!(L == 1 || placed == 0, "the receiver waits");
}
for_longest!(take, slice_is_placed);
