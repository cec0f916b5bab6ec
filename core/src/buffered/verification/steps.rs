//! 13a: each step of the receiver either is the reference's next step, or prepares the reference's next step.

use super::{Any, Asked, any_receiver, are_places, byte, fits, for_longest};
use crate::any_format::{any_up_to, part};
use crate::buffered::Decision;
use crate::{Classification, DiscardReason, Found};

/// `decide` delivers the frame at the first pending place, or drops the place with the reference's reason, or waits for
/// more bytes.
fn first_place_is_decided<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawful(&asked), L);
    let (from, pending) = (receiver.from, receiver.pending());
    kani::assume(receiver.ask_at <= receiver.to);
    let mut discarded = None;
    let mut accounted = 0;
    let decision = receiver.decide(|one| {
        assert!(accounted == 0);
        accounted = one.bytes();
        if let Found::Discarded { why, .. } = one {
            discarded = Some(why);
        }
    });
    let row = receiver.format.row.unwrap();
    let asked = receiver.format.asked.now.get();
    assert!(!receiver.has_rule_begun());
    if pending == 0 {
        assert!(asked.is_none() && discarded.is_none() && matches!(decision, Decision::Waiting));
        assert!(fits(&receiver, 0, 0, 1));
        return;
    }
    assert!(asked == Some((from, pending)));
    match (decision, row.settled(pending)) {
        (Decision::Frame(length), Some(Classification::Frame(frame))) => {
            let delivered = receiver.frame(length);
            assert!(length == frame && accounted == length && delivered.bytes().len() == length);
            assert!(are_places(delivered.message(), from));
            assert!(fits(&receiver, from + length, pending - length, 1));
        }
        (Decision::Discarded, Some(Classification::Rejected(expected))) => {
            assert!(discarded == Some(expected) && accounted == 1);
            assert!(fits(&receiver, from + 1, pending - 1, 1));
        }
        (Decision::Waiting, None) => {
            assert!(accounted == 0 && pending < L && receiver.ask_at > receiver.to);
            assert!(fits(&receiver, from, pending, row.settled_at));
        }
        _ => panic!("the decision differs from the reference"),
    }
    kani::cover!(
        pending == L && row.settled == Classification::Frame(L),
        "the longest frame"
    );
    kani::cover!(
        L == 1 || receiver.ask_at > receiver.to,
        "the receiver waits"
    );
}
for_longest!(decide, first_place_is_decided);

/// `discard_what_starts_nothing` drops the pending places before the first one that starts a frame.
fn starts_are_found<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawless(&asked), L);
    let (from, to, ask_at) = (receiver.from, receiver.to, receiver.ask_at);
    let first = receiver.format.first_start(from, to, L);
    let mut dropped = 0;
    receiver.discard_what_starts_nothing(&mut |one| {
        assert!(
            dropped == 0
                && matches!(
                    one,
                    Found::Discarded {
                        why: DiscardReason::NoSync,
                        ..
                    }
                )
        );
        dropped = one.bytes();
        assert!(dropped > 0);
    });
    assert!(dropped == first - from);
    assert!(dropped > 0 || receiver.ask_at == ask_at);
    let settled_at = if dropped > 0 { 1 } else { L };
    assert!(fits(&receiver, first, to - first, settled_at));
    kani::cover!(dropped == L, "all of them");
    kani::cover!(dropped == 0 && to > from, "none");
}
for_longest!(starts, starts_are_found);

/// `store` appends the new bytes to the pending ones. The call does not change the number of pending bytes at which the
/// receiver asks the format again. `next` stores the bytes that the receiver waits for, or one byte if it waits for
/// none, and leaves the rest of the slice.
fn bytes_are_stored<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawless(&asked), L);
    let (from, to) = (receiver.from, receiver.to);
    let waits_for = receiver.ask_at.saturating_sub(from);
    let bytes = places::<L>(to);
    let is_next = kani::any();
    let count = if is_next {
        kani::assume(from == to || to < receiver.ask_at);
        let missing = receiver.ask_at.saturating_sub(to).max(1);
        let length = any_up_to(L);
        let mut rest = part(&bytes, 0, length);
        assert!(receiver.store_what_is_missing(&mut rest) == (length > 0));
        let count = length.min(missing);
        assert!(rest.len() == length - count && are_places(rest, to.wrapping_add(count)));
        count
    } else {
        let count = any_up_to(L - (to - from));
        receiver.store(part(&bytes, 0, count));
        count
    };
    assert!(fits(&receiver, from, to - from + count, L));
    assert!(receiver.ask_at.saturating_sub(receiver.from) == waits_for);
    kani::cover!(
        L == 1 || receiver.from < from && to > from,
        "the pending bytes move to the front"
    );
    kani::cover!(count == L && !is_next, "a whole frame");
    kani::cover!(L == 1 || count == L - 1 && is_next, "all that is missing");
}
for_longest!(store, bytes_are_stored);

/// Returns the bytes of the places from `from` on.
fn places<const COUNT: usize>(from: usize) -> [u8; COUNT] {
    let mut bytes = [0; COUNT];
    let mut at = 0;
    while at < COUNT {
        bytes[at] = byte(from.wrapping_add(at));
        at += 1;
    }
    bytes
}

/// `take`, while nothing is pending, does one of four things: it drops the places before the first one that starts a
/// frame, delivers the frame at the first place, drops the first place, or stores the whole slice and waits for more
/// bytes.
fn slice_is_taken<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawful(&asked), 0);
    let bytes = places::<N>(0);
    let length = any_up_to(N);
    kani::assume(length > 0);
    let first = receiver.format.first_start(0, length, N);
    let row = receiver.format.row.unwrap();
    let mut events = 0;
    let mut decided = 0;
    let rest = receiver.take(part(&bytes, 0, length), &mut |found| {
        events += 1;
        decided = match found {
            Found::Frame { length, message } => {
                assert!(first == 0 && row.settled == Classification::Frame(length));
                assert!(message.bytes().len() == length && are_places(message.bytes(), 0));
                length
            }
            Found::Discarded { count, why } => {
                assert!(if first > 0 {
                    count == first && why == DiscardReason::NoSync
                } else {
                    count == 1 && row.settled == Classification::Rejected(why)
                });
                count
            }
        };
    });
    let known = length.min(L);
    let is_settled = first > 0 || row.settled(known).is_some();
    if let Some(rest) = rest {
        assert!(is_settled && events == 1 && decided > 0);
        assert!(rest.len() == length - decided && are_places(rest, decided));
        assert!(receiver.pending() == 0);
    } else {
        assert!(!is_settled && events == 0);
        assert!(receiver.ask_at > receiver.to && !receiver.has_rule_begun());
        assert!(fits(&receiver, 0, length, row.settled_at));
    }
    let asked = receiver.format.asked.now.get();
    assert!(asked == (first == 0).then_some((0, known)));
    kani::cover!(L == 1 || receiver.pending() > 0, "the receiver waits");
    kani::cover!(decided == L && first == 0, "the longest frame");
}
for_longest!(take, slice_is_taken);

/// `give_back` returns all pending bytes to the slice, or none.
fn slice_begins_where_the_pending_did<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawless(&asked), L);
    let (from, to, ask_at) = (receiver.from, receiver.to, receiver.ask_at);
    // The receiver has taken the first `taken` bytes of the slice. These bytes are still pending, or have been decided.
    // The rest of the slice follows them.
    let taken = any_up_to(L);
    let length = any_up_to(N);
    kani::assume(taken <= length);
    let bytes = places::<N>(to.wrapping_sub(taken));
    let bytes = part(&bytes, 0, length);
    let rest = receiver.give_back(bytes, part(bytes, taken, length));
    if to - from <= taken {
        assert!(receiver.pending() == 0 && fits(&receiver, 0, 0, 1));
        assert!(rest.len() == length - taken + (to - from));
        assert!(are_places(rest, from));
    } else {
        assert!(receiver.ask_at == ask_at);
        assert!(fits(&receiver, from, to - from, L));
        assert!(rest.len() == length - taken && are_places(rest, to));
    }
    kani::cover!(to > from && to - from <= taken, "all that is pending");
    kani::cover!(to - from > taken, "nothing");
}
for_longest!(give_back, slice_begins_where_the_pending_did);
