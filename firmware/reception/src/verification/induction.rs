//! The invariant holds at the start, and after each step of the chip and each round and tick of the handler.

use super::chip::{Chip, HALF, MANY, wide};
use super::invariant::{Handler, holds};
use crate::{Half, Reception, State};

/// Nothing happens while the handler runs.
type Still = Chip<true, false>;

/// Whatever may be, if the invariant holds.
fn any<const ERRORS: bool, const MOVING: bool>(state: State) -> (Chip<ERRORS, MOVING>, Handler) {
    let chip = Chip {
        number: kani::any(),
        broken: kani::any(),
        fifo: kani::any(),
        held: kani::any(),
        ready_due: kani::any(),
        runs: kani::any(),
        stopping: kani::any(),
        flushing: kani::any(),
        dma: kani::any(),
        named: any_half(),
        writing: any_half(),
        done: kani::any(),
        short: kani::any(),
        amount: kani::any(),
        memory: kani::any(),
        started: kani::any(),
        ended: kani::any(),
        ends: kani::any(),
        timed_out: kani::any(),
        error: ERRORS && kani::any(),
        listening: !ERRORS || kani::any(),
        overrun: ERRORS && kani::any(),
        silent: kani::any(),
        gap: kani::any(),
        silence_seen: kani::any(),
        gap_seen: kani::any(),
        count: kani::any(),
        at_end: kani::any(),
        at_error: kani::any(),
        at_silence: kani::any(),
        errors: if ERRORS { kani::any() } else { 0 },
        expected: kani::any(),
        reported: kani::any(),
        fed: 0,
    };
    let reception = Reception {
        state,
        open: any_half(),
        taken: kani::any::<u8>().into(),
        begun_at: wide(BEGUN_AT),
        named: kani::any(),
        doubt: if ERRORS { kani::any::<u8>().into() } else { 0 },
        errors_seen: wide(0),
        errors_left: kani::any::<u8>().into(),
        count_at_tick: kani::any::<u8>().into(),
        quiet_for: kani::any::<u8>().into(),
        silent_at: kani::any::<Option<u8>>().map(wide),
        amount: kani::any::<u8>().into(),
        follows: kani::any(),
        waited: kani::any::<u8>().into(),
        late: 0,
        skipped: 0,
        rounds: 0,
    };
    let is_near = chip.count < MANY
        && chip.number < MANY
        && chip.ends < MANY / HALF
        && chip.errors < MANY
        && reception.doubt < 100;
    kani::assume(is_near && holds(&chip, &reception));
    (chip, reception)
}

/// Only differences of counts matter, so one count does for all.
const BEGUN_AT: u8 = MANY / 2;

fn any_half() -> Half {
    if kani::any() {
        Half::First
    } else {
        Half::Second
    }
}

#[kani::proof]
#[kani::unwind(6)]
fn at_the_start() {
    let mut chip = Chip::<true, true>::new();
    let mut reception = Reception::new();
    reception.errors_seen = wide(0);
    reception.begin(&mut chip);
    assert!(holds(&chip, &reception));
    kani::cover!(chip.started, "it has started");
}

/// A byte that comes keeps the invariant.
#[kani::proof]
#[kani::unwind(6)]
fn arrival_while_receiving() {
    let (mut chip, reception) = any::<true, false>(State::Receiving);
    let errors = chip.errors;
    chip.arrive();
    assert!(holds(&chip, &reception));
    kani::cover!(chip.errors > errors, "a byte is spoilt");
}

/// So does whatever else the chip does.
fn arrival_or_step(state: State) -> (Still, Still) {
    let (before, reception) = any::<true, false>(state);
    let mut chip = before;
    if kani::any() {
        chip.arrive();
    } else {
        chip.go_on();
    }
    assert!(holds(&chip, &reception));
    (before, chip)
}

/// So does a step of the chip while receiving. Returns the chip before it and after.
fn step_while_receiving(step: impl FnOnce(&mut Still)) -> (Still, Still) {
    let (before, reception) = any::<true, false>(State::Receiving);
    let mut chip = before;
    step(&mut chip);
    assert!(holds(&chip, &reception));
    (before, chip)
}

#[kani::proof]
#[kani::unwind(6)]
fn a_byte_is_counted_while_receiving() {
    let (before, chip) = step_while_receiving(Chip::ready);
    kani::cover!(chip.count > before.count, "RXDRDY");
}

#[kani::proof]
#[kani::unwind(6)]
fn a_byte_is_stored_while_receiving() {
    let (before, chip) = step_while_receiving(Chip::store);
    kani::cover!(chip.done > before.done, "a byte is stored");
}

#[kani::proof]
#[kani::unwind(6)]
fn a_half_ends_while_receiving() {
    let (before, chip) = step_while_receiving(Chip::end);
    kani::cover!(chip.ends > before.ends, "ENDRX");
}

#[kani::proof]
#[kani::unwind(6)]
fn a_half_begins_while_receiving() {
    let (before, chip) = step_while_receiving(Chip::restart);
    kani::cover!(chip.started && !before.started, "RXSTARTED");
}

#[kani::proof]
#[kani::unwind(6)]
fn the_line_falls_silent_while_receiving() {
    let (before, chip) = step_while_receiving(Chip::fall_silent);
    kani::cover!(chip.silent && !before.silent, "silence");
}

#[kani::proof]
#[kani::unwind(6)]
fn the_chip_times_out_while_receiving() {
    let (before, chip) = step_while_receiving(|chip| {
        chip.time_out();
        chip.time_out_unasked();
        chip.end_flush();
    });
    kani::cover!(chip.timed_out && !before.timed_out, "RXTO unasked");
}

#[kani::proof]
#[kani::unwind(6)]
fn step_while_stopping() {
    let (before, chip) = arrival_or_step(State::Stopping { exact: false });
    kani::cover!(chip.timed_out && !before.timed_out, "it has stopped");
}

#[kani::proof]
#[kani::unwind(6)]
fn step_while_stopping_exactly() {
    let (before, chip) = arrival_or_step(State::Stopping { exact: true });
    kani::cover!(chip.ended && !before.ended, "what was stored is known");
}

#[kani::proof]
#[kani::unwind(6)]
fn step_while_flushing() {
    let (before, chip) = arrival_or_step(State::Flushing);
    kani::cover!(chip.ended && !before.ended, "it is flushed");
}

/// A round keeps it, with S1 and S2, which [`Chip`] asserts; and S3.
fn round(state: State) -> (Still, Handler) {
    let (mut chip, before) = any::<true, false>(state);
    let mut reception = before;
    reception.service(&mut chip);
    assert!(holds(&chip, &reception));
    if state == State::Receiving {
        assert!(reception.rounds == 1);
    } else {
        assert!(reception.rounds == 0);
        let is_waiting = reception.waited == before.waited + 1;
        assert!(reception.state == State::Receiving || is_waiting);
    }
    (chip, reception)
}

#[kani::proof]
#[kani::unwind(6)]
fn round_while_receiving() {
    let (chip, reception) = round(State::Receiving);
    kani::cover!(chip.fed == HALF, "a half is taken");
    kani::cover!(reception.late == 1, "late");
    kani::cover!(
        reception.state == State::Stopping { exact: true },
        "silence"
    );
}

/// So does a tick.
#[kani::proof]
#[kani::unwind(6)]
fn tick() {
    let state = if kani::any() {
        State::Receiving
    } else {
        State::Flushing
    };
    let (mut chip, mut reception) = any::<true, false>(state);
    let needs_a_round = reception.tick(&mut chip);
    assert!(holds(&chip, &reception));
    assert!(needs_a_round == (reception.state != State::Receiving));
    kani::cover!(
        state == State::Receiving && reception.state == State::Stopping { exact: true },
        "it was quiet for long enough"
    );
}

#[kani::proof]
#[kani::unwind(6)]
fn round_while_stopping() {
    let (_, reception) = round(State::Stopping { exact: false });
    kani::cover!(reception.state == State::Flushing, "stopped");
    kani::cover!(reception.state == State::Receiving, "patience ends");
}

#[kani::proof]
#[kani::unwind(6)]
fn round_while_stopping_exactly() {
    let (chip, reception) = round(State::Stopping { exact: true });
    kani::cover!(
        reception.follows && chip.fed > 0,
        "what was stored is taken"
    );
}

#[kani::proof]
#[kani::unwind(6)]
fn round_while_flushing() {
    let (chip, reception) = round(State::Flushing);
    let has_begun = reception.state == State::Receiving;
    kani::cover!(has_begun && chip.fed > 0, "what was flushed is taken");
}

/// S4: two rounds leave no interrupt that would come again at once, unless the second has begun anew:
/// then a third.
fn rounds_end(state: State) {
    let (mut chip, mut reception) = any::<true, false>(state);
    reception.service(&mut chip);
    let before = reception.state;
    reception.service(&mut chip);
    if before != State::Receiving && reception.state == State::Receiving {
        reception.service(&mut chip);
    }
    assert!(chip.is_quiet());
    kani::cover!(reception.state == State::Receiving);
}

#[kani::proof]
#[kani::unwind(6)]
fn rounds_end_while_receiving() {
    rounds_end(State::Receiving);
}

#[kani::proof]
#[kani::unwind(6)]
fn rounds_end_while_stopping() {
    rounds_end(State::Stopping { exact: kani::any() });
}

#[kani::proof]
#[kani::unwind(6)]
fn rounds_end_while_flushing() {
    rounds_end(State::Flushing);
}
