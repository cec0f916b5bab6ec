//! 13f: one iteration of a line event's loop, from any state.

use super::{Any, Asked, any_receiver, are_places, fits, for_longest};
use crate::any_format::any_event;
use crate::{Classification, DiscardReason, Found};

/// The iteration looks for the first pending place that starts a frame, and drops all places that precede it. Then it
/// does the same as the reference at the end of a stream. If the format answers `Incomplete`, the reference asks
/// `classify_before` instead of waiting.
fn first_place_is_ended<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawful(&asked), L - 1);
    let (from, end) = (receiver.from, receiver.to);
    kani::assume(from < end);
    let first = receiver.format.first_start(from, end, L);
    let row = receiver.format.row.unwrap();

    let mut next = from;
    let mut frame = None;
    let mut dropped = None;
    receiver.end_first(any_event(), &mut |found| {
        assert!(frame.is_none() && dropped.is_none());
        match found {
            Found::Frame { length, message } => {
                assert!(next == first && message.bytes().len() == length);
                assert!(are_places(message.bytes(), first));
                frame = Some(length);
                next += length;
            }
            Found::Discarded { count, why } if next < first => {
                assert!(next + count == first && why == DiscardReason::NoSync);
                next = first;
            }
            Found::Discarded { count, why } => {
                assert!(count == 1);
                dropped = Some(why);
                next += 1;
            }
        }
    });

    let before = asked.before.get();
    if first == end {
        assert!(next == end && frame.is_none() && dropped.is_none());
        assert!(before.is_none());
    } else {
        let settled = row.settled(end - first);
        assert!(settled.is_some() != before.is_some());
        match settled.or(before) {
            Some(Classification::Frame(length)) => assert!(frame == Some(length)),
            Some(Classification::Rejected(why)) => assert!(dropped == Some(why)),
            _ => unreachable!("both answers are final"),
        }
    }
    let start = if next == end { 0 } else { next };
    assert!(fits(&receiver, start, end - next, 1));
    kani::cover!(frame == Some(L - 1), "a whole frame");
    kani::cover!(
        frame == Some(L - 1) && before.is_some(),
        "a whole frame that the format recognises only at the event"
    );
    kani::cover!(
        dropped == Some(DiscardReason::LineEvent) && next < end,
        "bytes are left"
    );
}
for_longest!(end_first, first_place_is_ended: of_3 3 5 6 of_8 8 8 9);

/// Whatever the format answers, the iteration puts at least one byte into an event.
fn a_byte_is_ended<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawless(&asked), L - 1);
    let (from, end) = (receiver.from, receiver.to);
    kani::assume(from < end);
    let mut placed = 0;
    receiver.end_first(any_event(), &mut |found| match found {
        Found::Frame { length, message } => {
            assert!(message.bytes().len() == length);
            placed += length;
        }
        Found::Discarded { count, .. } => placed += count,
    });
    assert!(placed > 0 && placed <= end - from);
    assert!(fits(&receiver, from + placed, end - from - placed, L));
    kani::cover!(placed == L - 1, "all");
    kani::cover!(placed < end - from, "some");
}
for_longest!(lawless_end_first, a_byte_is_ended: of_3 3 5 6 of_8 8 8 9);
