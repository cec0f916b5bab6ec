//! 13a and 13f: one step of `poll` and one step of a line event, from any state.

use super::{Any, Asked, any_receiver, are_places, fits, for_longest};
use crate::any_format::any_line_event;
use crate::{Classification, DiscardReason, Found};

/// A step drops all places before the first pending place that starts a frame. Then it does the reference's next step,
/// and classifies at most once ([`Any`] asserts this). If the format answers `Incomplete`, a step of `poll` waits,
/// as the reference does. A step of a line event does what the reference does at the end of a stream, and asks
/// `classify_before`. From then on, each place that `classify` rejects is dropped with the reason `LineEvent`.
fn first_place_is_decided<const L: usize, const N: usize>(is_event: bool, most: usize) {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawful(&asked), most);
    let (from, end) = (receiver.from, receiver.to);
    let first = receiver.format.first_start(from, end, L);
    let row = receiver.format.row.unwrap();
    let had_begun = receiver.has_rule_begun();
    let reason = |why| {
        if is_event && had_begun {
            DiscardReason::LineEvent
        } else {
            why
        }
    };

    let mut next = from;
    let mut frame = None;
    let mut dropped = None;
    let mut take = |found: Found<crate::Frame<'_, Any<'_, L>>>| {
        assert!(frame.is_none() && dropped.is_none());
        match found {
            Found::Frame { length, message } => {
                assert!(next == first && message.bytes().len() == length);
                assert!(are_places(message.bytes(), first));
                frame = Some(length);
                next += length;
            }
            Found::Discarded { count, why } if next < first => {
                assert!(next + count == first && why == reason(DiscardReason::NoSync));
                next = first;
            }
            Found::Discarded { count, why } => {
                assert!(count == 1);
                dropped = Some(why);
                next += 1;
            }
        }
    };
    let goes_on = if is_event {
        receiver.line_event_step(any_line_event(), &mut take)
    } else {
        receiver.poll_step(&mut take)
    };

    let before = asked.before.get();
    let mut settled_at = 1;
    if first == end {
        assert!(next == end && frame.is_none() && dropped.is_none());
        assert!(before.is_none() && !goes_on);
    } else {
        let settled = row.settled(end - first);
        assert!(before.is_some() == (is_event && settled.is_none()));
        match settled.or(before) {
            Some(Classification::Frame(length)) => {
                assert!(frame == Some(length) && dropped.is_none());
            }
            Some(Classification::Rejected(why)) => {
                let why = if settled.is_some() { reason(why) } else { why };
                assert!(dropped == Some(why) && frame.is_none());
            }
            _ => {
                assert!(next == first && frame.is_none() && dropped.is_none());
                settled_at = row.settled_at;
            }
        }
        // A step says whether `poll` or the line event has more to do.
        assert!(
            goes_on
                == if is_event {
                    next < end
                } else {
                    settled.is_some()
                }
        );
    }
    let start = if next == end { 0 } else { next };
    assert!(fits(&receiver, start, end - next, settled_at));
    let is_ending = is_event && (had_begun || before.is_some());
    assert!(next == end || receiver.has_rule_begun() == is_ending);
    kani::cover!(frame == Some(most), "a whole frame");
    kani::cover!(
        frame == Some(L - 1) && before.is_some() == is_event,
        "a whole frame; at an event, one that the format recognises only then"
    );
    kani::cover!(
        dropped.is_some() && next < end && (first > from || most == 2),
        "places are dropped, in two runs if three are pending, and others are left"
    );
    kani::cover!(
        had_begun && dropped.is_some() && before.is_none() && next < end,
        "a rejected place is dropped after one that waited"
    );
}

/// `feed` calls `poll_step` with up to `LONGEST` pending bytes.
fn first_place_is_polled<const L: usize, const N: usize>() {
    first_place_is_decided::<L, N>(false, L);
}
for_longest!(poll_step, first_place_is_polled: of_3 3 5 6 of_8 8 8 9);

fn first_place_is_ended<const L: usize, const N: usize>() {
    first_place_is_decided::<L, N>(true, L - 1);
}
for_longest!(line_event_step, first_place_is_ended: of_3 3 5 6 of_8 8 8 9);

/// Whatever the format answers, a step of a line event puts at least one pending byte into an event, and says whether
/// bytes are still pending.
fn a_byte_is_ended<const L: usize, const N: usize>() {
    let asked = Asked::default();
    let mut receiver = any_receiver::<L, N>(Any::lawless(&asked), L - 1);
    let (from, end) = (receiver.from, receiver.to);
    let mut placed = 0;
    let goes_on = receiver.line_event_step(any_line_event(), |found| match found {
        Found::Frame { length, message } => {
            assert!(message.bytes().len() == length);
            placed += length;
        }
        Found::Discarded { count, .. } => placed += count,
    });
    assert!(placed > 0 || from == end);
    assert!(placed <= end - from && goes_on == (placed < end - from));
    assert!(fits(&receiver, from + placed, end - from - placed, L));
    assert!(!receiver.has_rule_begun() || goes_on);
    kani::cover!(placed == L - 1, "all");
    kani::cover!(placed < end - from, "some");
}
for_longest!(lawless_line_event_step, a_byte_is_ended: of_3 3 5 6 of_8 8 8 9);
