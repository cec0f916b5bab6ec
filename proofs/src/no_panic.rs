//! Theorem 1: no public function of the core, from any state and with any arguments, panics, overflows, or accesses
//! memory out of bounds (F1, M1, R1, L1). The harnesses for the engine's parts and the failsafe are in `core`.

use framelock::motion::{Bin, BinCrc8, Setpoint, crc8};
use framelock::{Counters, Encode, FixedFormat, Line};

use crate::states::{OfSetpoints, any_lecture, any_line_event, any_receiver, any_setpoint};

/// Runs every operation of a parser, from its current state.
fn any_operations<P: OfSetpoints>(parser: P) {
    let mut reset = parser;
    reset.reset();
    assert!(reset.pending() == 0);
    let mut pushed = parser;
    let committed = pushed.push(kani::any()).is_some();
    assert!(pushed.pending() < P::LENGTH);
    assert!(!committed || pushed.pending() == 0);
    kani::cover!(pushed.pending() == P::LENGTH - 1, "one byte missing");
    kani::cover!(committed, "a commit");
}

#[kani::proof]
#[kani::unwind(9)]
fn lecture() {
    let machine = any_lecture();
    any_operations(machine);
}

#[kani::proof]
#[kani::unwind(9)]
fn receiver_of_bin() {
    any_operations(any_receiver::<Bin, 7>());
}

#[kani::proof]
#[kani::unwind(34)]
fn receiver_of_bin_crc8() {
    any_operations(any_receiver::<BinCrc8, 8>());
}

/// Runs every operation of a line, with any counters.
#[kani::proof]
#[kani::unwind(9)]
fn line() {
    let mut counters = Counters::default();
    [
        counters.bytes,
        counters.frames,
        counters.frame_bytes,
        counters.resynchronisations,
    ] = kani::any();
    let discarded = &mut counters.discarded;
    [
        discarded.no_sync,
        discarded.broken_sync,
        discarded.bad_header,
        discarded.too_long,
        discarded.unknown_message,
        discarded.checksum_mismatch,
        discarded.wrong_terminator,
        discarded.line_event,
    ] = kani::any();
    let events = &mut counters.events;
    [
        events.framing,
        events.parity,
        events.overrun,
        events.line_break,
        events.idle,
    ] = kani::any();
    let _ = counters.discarded.total();
    let _ = counters.events.total();
    let mut line = Line::resumed(any_lecture(), counters);
    line.push(kani::any());
    line.line_event(any_line_event(), |_| ());
    assert!(line.pending() == 0 && line.parser().pending() == 0);
    assert!(Line::new(any_lecture()).counters().bytes == 0);
    kani::cover!(line.counters().bytes == 0, "a counter wraps");
}

#[kani::proof]
#[kani::unwind(34)]
fn formats() {
    let setpoint = any_setpoint();
    assert!(Setpoint::from(<[u8; 3]>::from(setpoint)) == setpoint);
    assert!(Bin::decode(Bin::encode(setpoint)) == setpoint);
    assert!(BinCrc8::decode(BinCrc8::encode(setpoint)) == setpoint);
    let payload: [u8; 4] = kani::any();
    let checksum = crc8(payload);
    assert!(checksum == crate::reference::crc8(&payload));
    kani::cover!(checksum == 0, "a checksum of 0");
}
