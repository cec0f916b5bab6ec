//! Line events, and where every byte goes.

use framelock::{Accounting, Bin, BinCrc8, Counters, Discard, Parser, Receiver, Rescan, Setpoint};

use super::no_panic::{any_counters, any_line_event};
use super::{any_lecture, any_receiver};

/// L1: after a line event the machine is as at reset.
fn event_resets<P: Parser<Message = Setpoint> + PartialEq>(parser: P, reset: P) {
    let mut line = Accounting::resumed(parser, any_counters());
    let held = line.pending();
    line.line_event(any_line_event());
    assert!(*line.parser() == reset);
    kani::cover!(
        held == P::FRAME_LENGTH - 1,
        "a frame but for its last byte is dropped"
    );
}

/// L1: a line event leaves the machine as at reset, whatever it held. Streams after it are
/// therefore received as if nothing had come before; by theorem 3 no frame that holds a byte from
/// before the event is committed.
///
/// Theorem: 8
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn line_events_drop_what_is_held() {
    event_resets(any_lecture(), framelock::Lecture::new());
    event_resets(any_receiver::<Bin, Rescan>(), Receiver::new());
    event_resets(any_receiver::<BinCrc8, Rescan>(), Receiver::new());
}

/// L1, by its consequence: none of the next bytes is committed before as many have come as a
/// frame has.
///
/// Theorem: 8
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn no_frame_spans_a_line_event() {
    let mut line = Accounting::resumed(any_receiver::<Bin, Rescan>(), any_counters());
    line.line_event(any_line_event());
    let mut i = 0;
    while i < 6 {
        assert!(line.push(kani::any()).is_none());
        i += 1;
    }
    kani::cover!(
        line.push(kani::any()).is_some(),
        "the seventh byte completes a frame"
    );
}

/// By how much each counter of bytes went up, modulo 2^64: those of frames as bytes, and those
/// discarded. At most a frame and a byte each.
fn placed<P: Parser>(before: &Counters, after: &Counters) -> usize {
    let up = |before: u64, after: u64, most: usize| {
        let up = after.wrapping_sub(before);
        assert!(up <= most as u64);
        usize::from(up.to_le_bytes()[0])
    };
    let (from, to) = (&before.discarded, &after.discarded);
    let most = P::FRAME_LENGTH;
    up(before.frames, after.frames, 1) * most
        + up(from.no_sync, to.no_sync, most)
        + up(from.broken_sync, to.broken_sync, most)
        + up(from.check, to.check, most)
        + up(from.terminator, to.terminator, most)
        + up(from.line_event, to.line_event, most)
}

/// Each step keeps the balance, whatever the counters, which may be about to wrap: what was held
/// before and the new byte are what was placed and what is held now. Summed over any number of
/// steps from a balance of 0, that is the identity modulo 2^64.
fn keeps_the_balance<P: Parser<Message = Setpoint>>(parser: P) {
    let mut line = Accounting::resumed(parser, any_counters());
    let (before, held) = (*line.counters(), line.pending());
    let committed = line.push(kani::any()).is_some();
    let after = *line.counters();
    assert!(after.bytes == before.bytes.wrapping_add(1));
    assert!(after.frames == before.frames.wrapping_add(u64::from(committed)));
    assert!(held + 1 == placed::<P>(&before, &after) + line.pending());
    kani::cover!(committed, "a commit");
    kani::cover!(!committed && line.pending() == 0, "bytes are discarded");
}

/// So does a line event: what was held is placed.
fn event_keeps_the_balance<P: Parser<Message = Setpoint>>(parser: P) {
    let mut line = Accounting::resumed(parser, any_counters());
    let (before, held) = (*line.counters(), line.pending());
    line.line_event(any_line_event());
    assert!(line.counters().bytes == before.bytes && line.pending() == 0);
    assert!(held == placed::<P>(&before, line.counters()));
    kani::cover!(held > 0, "bytes are discarded");
}

/// A fresh account is balanced: what is pending is all that has come.
fn is_balanced<P: Parser<Message = Setpoint>>(parser: P) {
    let line = Accounting::new(parser);
    let zero = Counters::default();
    assert!(line.counters().bytes == line.pending() as u64);
    assert!(placed::<P>(&zero, line.counters()) == 0);
}

/// L2 for the lecture's machine.
///
/// Theorem: 9
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn lecture_accounts_for_every_byte() {
    is_balanced(any_lecture());
    keeps_the_balance(any_lecture());
}

/// L2 for the receiver of BIN.
///
/// Theorem: 9
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn receiver_of_bin_accounts_for_every_byte() {
    is_balanced(any_receiver::<Bin, Rescan>());
    keeps_the_balance(any_receiver::<Bin, Rescan>());
}

/// L2 for the receiver of BIN-CRC8.
///
/// Theorem: 9
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn receiver_of_bin_crc8_accounts_for_every_byte() {
    keeps_the_balance(any_receiver::<BinCrc8, Rescan>());
}

/// L2 for the receiver under Discard.
///
/// Theorem: 9
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn discarding_receiver_accounts_for_every_byte() {
    keeps_the_balance(any_receiver::<Bin, Discard>());
}

/// L1, L2: line events keep the balance, whichever the parser.
///
/// Theorem: 9
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn line_events_are_accounted_for() {
    event_keeps_the_balance(any_lecture());
    event_keeps_the_balance(any_receiver::<Bin, Rescan>());
    event_keeps_the_balance(any_receiver::<BinCrc8, Rescan>());
    event_keeps_the_balance(any_receiver::<BinCrc8, Discard>());
}
