//! No panic, no overflow, nothing out of bounds: every public function, any state, any arguments.
//!
//! `Covers:` lines name the functions; the command that runs the proofs checks that every public
//! function of the core stands in one.

use framelock::{
    Accounting, Bin, BinCrc8, Counters, Discard, Discarded, Failsafe, FailsafeParameters, Format,
    Frame, LineEvent, LineEvents, Parser, Receiver, Rescan, Setpoint, Shape, State, Window, Word,
    crc8,
};

use super::{any_lecture, any_receiver, any_setpoint};

/// Every operation of a parser, from the state it is in.
fn any_operations<P: Parser<Message = Setpoint> + Copy>(parser: P) {
    let mut pushed = parser;
    let committed = pushed.push(kani::any()).is_some();
    assert!(pushed.pending() < P::FRAME_LENGTH);
    assert!(!committed || pushed.pending() == 0);
    kani::cover!(committed, "a commit");
    kani::cover!(
        pushed.pending() == P::FRAME_LENGTH - 1,
        "all but the last byte held"
    );
    let mut reset = parser;
    reset.reset();
    assert!(reset.pending() == 0);
}

/// M1: from any of the seven states any byte leads to one of the seven.
///
/// Theorem: 1, 2
/// Length: any
/// Covers: Lecture::new, Lecture::push, Lecture::pending, Lecture::reset
/// Covers: State::lecture_name, State::bytes_taken, Setpoint::from
#[kani::proof]
#[kani::unwind(9)]
fn lecture() {
    let machine = any_lecture();
    any_operations(machine);
    let mut after = machine;
    after.push(kani::any());
    assert!(after.state.bytes_taken() < 7);
    assert!(!after.state.lecture_name().is_empty());
    let setpoint = any_setpoint();
    assert!(Setpoint::from(<[u8; 3]>::from(setpoint)) == setpoint);
}

/// R1: from any state any byte leads to a state that holds fewer bytes than a frame.
///
/// Theorem: 1, 2
/// Length: any
/// Covers: Receiver::new, Receiver::holding, Receiver::push, Receiver::pending, Receiver::reset
/// Covers: Receiver::window, Receiver::state, Receiver::temp, Window::push, Window::holding, Window::count
/// Covers: Window::history, Window::with, Bin::decode, Format::check, Frame::from_word
#[kani::proof]
#[kani::unwind(9)]
fn receiver_of_bin() {
    any_operations(any_receiver::<Bin, Discard>());
    let mut receiver = any_receiver::<Bin, Rescan>();
    any_operations(receiver);
    receiver.push(kani::any());
    assert!(receiver.state().bytes_taken() == receiver.pending());
    let known = receiver.temp();
    assert!(known[0].is_some() == (receiver.pending() > 3));
    assert!(known[2].is_some() == (receiver.pending() > 5));
}

/// R1, F2: likewise for BIN-CRC8.
///
/// Theorem: 1, 2
/// Length: any
/// Covers: Receiver::push, Receiver::pending, BinCrc8::check, BinCrc8::decode, crc8
#[kani::proof]
#[kani::unwind(34)]
fn receiver_of_bin_crc8() {
    any_operations(any_receiver::<BinCrc8, Rescan>());
}

/// R3, F2: likewise for BIN-CRC8 under Discard.
///
/// Theorem: 1, 2
/// Length: any
/// Covers: Receiver::push, Receiver::pending
#[kani::proof]
#[kani::unwind(34)]
fn discarding_receiver_of_bin_crc8() {
    any_operations(any_receiver::<BinCrc8, Discard>());
}

/// The engine's parts, of both words.
///
/// Theorem: 1
/// Length: any
/// Covers: Shape::new, Shape::length, Shape::sync_length, Shape::mask, Shape::pattern
/// Covers: Word::lowest, Word::leading_zero_bytes, Word::load, Word::to_be_bytes
#[kani::proof]
#[kani::unwind(17)]
fn engine() {
    let shape = Shape::<u64>::new(kani::any::<[Option<u8>; 8]>());
    assert!(shape.length() == 8 && shape.sync_length() <= 8);
    assert!(shape.pattern() & !shape.mask() == 0);
    let word: u64 = kani::any();
    assert!(word.lowest() == u64::to_be_bytes(word)[7]);
    assert!(Word::leading_zero_bytes(word) <= 8);
    assert!(u64::load(&u64::to_be_bytes(word)) == Some(word));
    assert!(u64::load(&[0; 7]).is_none());
    let wide: u128 = kani::any();
    assert!(wide.lowest() == u128::to_be_bytes(wide)[15]);
    assert!(Word::leading_zero_bytes(wide) <= 16);
    assert!(u128::load(&u128::to_be_bytes(wide)) == Some(wide));
    let wide_shape = Shape::<u128>::new(kani::any::<[Option<u8>; 16]>());
    let window = Window::holding(&wide_shape, wide, kani::any());
    let (after, committed) = window.push(&wide_shape, kani::any(), |_| true);
    assert!(after.count() < 16 && !(committed && after.count() > 0));
    kani::cover!(committed, "a commit of sixteen bytes");
}

/// Any counters whatever.
pub(super) fn any_counters() -> Counters {
    let [bytes, frames, resynchronisations] = kani::any();
    let [no_sync, broken_sync, check, terminator, line_event] = kani::any();
    let [framing, parity, overrun, line_break, idle] = kani::any();
    Counters {
        bytes,
        frames,
        discarded: Discarded {
            no_sync,
            broken_sync,
            check,
            terminator,
            line_event,
        },
        resynchronisations,
        events: LineEvents {
            framing,
            parity,
            overrun,
            line_break,
            idle,
        },
    }
}

/// Any line event.
pub(super) fn any_line_event() -> LineEvent {
    match kani::any::<u8>() {
        0 => LineEvent::Framing,
        1 => LineEvent::Parity,
        2 => LineEvent::Overrun,
        3 => LineEvent::Break,
        _ => LineEvent::Idle,
    }
}

/// L1, L2: the accounts, with any counters.
///
/// Theorem: 1
/// Length: any
/// Covers: Accounting::new, Accounting::resumed, Accounting::push, Accounting::feed
/// Covers: Accounting::line_event, Accounting::counters, Accounting::pending
/// Covers: Accounting::parser, Discarded::total
#[kani::proof]
#[kani::unwind(9)]
fn accounting() {
    let fresh = Accounting::new(any_lecture());
    assert!(fresh.counters().bytes == fresh.pending() as u64);
    let mut line = Accounting::resumed(any_receiver::<Bin, Rescan>(), any_counters());
    line.line_event(any_line_event());
    line.push(kani::any());
    line.line_event(any_line_event());
    assert!(line.pending() == 0 && *line.parser() == Receiver::new());
    let _ = line.counters().discarded.total();
    kani::cover!(line.counters().bytes == 0, "a counter wraps");
}

/// F1, F2: encoding and decoding.
///
/// Theorem: 1
/// Length: any
/// Covers: Bin::encode, Bin::decode, BinCrc8::encode, BinCrc8::decode, Frame::from_word
#[kani::proof]
#[kani::unwind(34)]
fn formats() {
    let setpoint = any_setpoint();
    assert!(Bin::decode(Bin::encode(setpoint)) == setpoint);
    assert!(BinCrc8::decode(BinCrc8::encode(setpoint)) == setpoint);
    assert!(Bin::check(kani::any()));
    let word: u64 = kani::any();
    assert!(<[u8; 8]>::from_word(word) == u64::to_be_bytes(word));
    let payload: [u8; 4] = kani::any();
    assert!(crc8(payload) == crate::reference::crc8(&payload));
    kani::cover!(crc8(payload) == 0, "a checksum of 0");
    kani::cover!(setpoint.pitch != setpoint.roll, "axes that differ");
}

/// S1 to S3: any parameters that are accepted, any state, any times.
///
/// Theorem: 1
/// Length: any
/// Covers: Failsafe::new, Failsafe::frame, Failsafe::poll, FailsafeParameters::parked_after
#[kani::proof]
#[kani::unwind(9)]
fn failsafe() {
    let parameters = FailsafeParameters {
        hold_after: kani::any(),
        ramp_after: kani::any(),
        park: any_setpoint(),
        ticks_per_unit: [kani::any(), kani::any(), kani::any()],
    };
    let _ = parameters.parked_after();
    let built = Failsafe::new(parameters, kani::any());
    let valid = parameters.hold_after > 0 && parameters.ramp_after >= parameters.hold_after;
    assert!(built.is_ok() == valid);
    if let Ok(mut failsafe) = built {
        failsafe.frame(kani::any(), any_setpoint());
        failsafe.poll(kani::any());
        kani::cover!(true, "built");
    }
    let mut failsafe = Failsafe::in_state(
        parameters,
        (kani::any(), kani::any()),
        any_setpoint(),
        kani::any(),
        kani::any(),
    );
    failsafe.frame(kani::any(), any_setpoint());
    failsafe.poll(kani::any());
}

/// Every state has the place of its index.
///
/// Theorem: 2
/// Length: any
/// Covers: State::bytes_taken
#[kani::proof]
#[kani::unwind(8)]
fn states_are_numbered() {
    let index: usize = kani::any_where(|&index| index < 7);
    assert!(State::ALL[index].bytes_taken() == index);
    kani::cover!(index == 6, "the last state");
}
