//! Theorem 1: no public function of the core, except those that write text, panics, overflows, or accesses memory out
//! of bounds, from any state and with any arguments (F1, M1, R1, L1). `../README.md` states the limits of the proof.
//! The module `reader` and the crate `core` have the other harnesses of this theorem.

use framelock::any_format::any_line_event;
use framelock::any_format::part;
use framelock::motion::{Bin, BinCrc8, Setpoint, crc8};
use framelock::{Counters, Encode, FixedFormat, Line};

use crate::any_parser::AnyParser;
use crate::states::{OfSetpoints, any_lecture, any_receiver, any_setpoint};

/// Runs `reset` and `push` of a parser, from its current state.
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

static BYTES: [u8; 4096] = [0; 4096];

/// Returns a slice of any length up to 4096 bytes. All its bytes are 0.
fn any_slice() -> &'static [u8] {
    part(&BYTES, 0, kani::any_where(|&length| length <= BYTES.len()))
}

/// Passes a slice of any length to `feed` or to `next`. Ignores executions with a second outcome: such an execution is
/// in the same loop again, in another state, and the harnesses start from any state.
fn any_slice_is_taken<P: OfSetpoints>(parser: P) {
    let bytes = any_slice();
    let placed = if kani::any() {
        let (mut fed, mut placed) = (parser, 0);
        fed.feed(bytes, |found| {
            kani::assume(placed == 0);
            placed = found.bytes();
        });
        assert!(placed + fed.pending() == parser.pending() + bytes.len());
        placed
    } else {
        slice_is_pulled(parser, bytes).0
    };
    kani::cover!(placed == P::LENGTH, "a frame, or a broken frame");
}

/// Passes a slice to `next`. Ignores executions with a second outcome. Returns the number of bytes in the outcome, and
/// the rest of the slice.
fn slice_is_pulled<P: OfSetpoints>(parser: P, bytes: &[u8]) -> (usize, &[u8]) {
    let (mut pulled, mut rest, mut placed) = (parser, bytes, 0);
    pulled.next_with(&mut rest, |one| {
        kani::assume(placed == 0);
        placed = one.bytes();
    });
    assert!(placed + pulled.pending() + rest.len() == parser.pending() + bytes.len());
    (placed, rest)
}

/// A receiver's `next` takes a slice of any length. The first byte is a terminator, so it may complete a pending frame.
/// `core` has the harnesses for the receiver's `feed`.
#[kani::proof]
#[kani::unwind(9)]
fn receiver_pulls_any_slice() {
    static TERMINATORS: [u8; 4096] = [b'\r'; 4096];
    let length = kani::any_where(|&length| length <= TERMINATORS.len());
    let bytes = part(&TERMINATORS, 0, length);
    let (placed, rest) = slice_is_pulled(any_receiver::<Bin, 7>(), bytes);
    kani::cover!(placed == 7 && rest.len() == 4095, "a frame");
}

#[kani::proof]
#[kani::unwind(10)]
fn lecture_takes_any_slice() {
    let machine = any_lecture();
    any_slice_is_taken(machine);
}

fn any_counters() -> Counters {
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
        discarded.broken_stuffing,
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
    counters
}

/// Runs `push` and `line_event` of a line with any counters, and adds up the counters.
#[kani::proof]
#[kani::unwind(10)]
fn line() {
    let counters = any_counters();
    let _ = counters.discarded.total();
    let _ = counters.events.total();
    let mut line = Line::resumed(any_lecture(), counters);
    line.push(kani::any());
    line.line_event(any_line_event(), |_| ());
    assert!(line.pending() == 0 && line.parser().pending() == 0);
    assert!(Line::new(any_lecture()).counters().bytes == 0);
    kani::cover!(line.counters().bytes == 0, "a counter wraps");
}

/// Runs the functions of a line that take bytes, line events or steps, with any parser and slices of any length. The
/// line passes on each message and each outcome of the parser.
#[kani::proof]
#[kani::unwind(10)]
fn line_of_any_parser() {
    let any_line = || Line::resumed(AnyParser::default(), any_counters());
    let has_found = |line: &Line<AnyParser>| line.parser().messages == 1;
    let mut line = any_line();
    assert!(line.push(kani::any()).is_some() == has_found(&line));
    let mut line = any_line();
    assert!(line.poll().is_some() == has_found(&line));
    let (mut line, mut rest) = (any_line(), any_slice());
    assert!(line.next(&mut rest).is_some() == has_found(&line));
    let mut line = any_line();
    let message = line.messages(any_slice()).next();
    assert!(message.is_some() == has_found(&line));
    let (mut line, mut outcomes) = (any_line(), 0);
    line.feed(any_slice(), |_| outcomes += 1);
    assert!(outcomes == line.parser().outcomes);
    let (mut line, mut outcomes) = (any_line(), 0);
    line.line_event(any_line_event(), |_| outcomes += 1);
    assert!(outcomes == line.parser().outcomes);
    let (mut line, mut stepped) = (any_line(), 0);
    line.poll_step(|_| stepped += 1);
    assert!(stepped == line.parser().outcomes);
    let (mut line, mut stepped) = (any_line(), 0);
    let events = line.counters().events.total();
    let goes_on = line.line_event_step(any_line_event(), |_| stepped += 1);
    assert!(stepped == line.parser().outcomes);
    let is_counted = line.counters().events.total() != events;
    // Only the last step of a line event counts the event.
    assert!(is_counted != goes_on);
    let _ = line.pending();
    kani::cover!(outcomes == 2 && stepped == 2, "two outcomes");
    kani::cover!(message.is_some(), "a message");
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
