//! The invariant holds at the start, and after each step of the chip and each round and tick of the handler.

use super::chip::{Chip, Dma, HALF, MANY, wide};
use super::invariant::{Handler, holds};
use super::motion::{Motion, starts};
use crate::{Half, Reception, State};

/// Whatever may be, if the invariant holds.
pub(super) fn any(state: State) -> (Chip, Handler) {
    let (chip, reception) = anything(state);
    kani::assume(holds(&chip, &reception));
    (chip, reception)
}

/// Whatever the model's numbers allow.
pub(super) fn anything(state: State) -> (Chip, Handler) {
    let chip = Chip {
        chance: kani::any(),
        motion: None,
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
        error: kani::any(),
        listening: kani::any(),
        overrun: kani::any(),
        silent: kani::any(),
        gap: kani::any(),
        silence_seen: kani::any(),
        gap_seen: kani::any(),
        count: kani::any(),
        at_end: kani::any(),
        at_error: kani::any(),
        at_silence: kani::any(),
        errors: kani::any(),
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
        doubt: kani::any::<u8>().into(),
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
    kani::assume(is_near);
    (chip, reception)
}

/// Only differences of counts matter, so one count does for all.
const BEGUN_AT: u8 = MANY / 2;

pub(super) fn any_half() -> Half {
    if kani::any() {
        Half::First
    } else {
        Half::Second
    }
}

#[kani::proof]
#[kani::unwind(6)]
fn at_the_start() {
    let mut chip = Chip::new();
    let mut reception = Reception::new();
    reception.errors_seen = wide(0);
    reception.begin(&mut chip);
    assert!(holds(&chip, &reception));
    kani::cover!(chip.started, "it has started");
}

/// A step of the chip while receiving keeps the invariant. What a round may have read before it was not
/// more than there is now. Returns the chip before it and after.
fn step_while_receiving(step: impl FnOnce(&mut Chip)) -> (Chip, Chip) {
    let (before, reception) = any(State::Receiving);
    let mut chip = before;
    step(&mut chip);
    assert!(holds(&chip, &reception));
    assert!(before.ends <= chip.ends && starts(&before, &reception) <= starts(&chip, &reception));
    (before, chip)
}

/// So does one while the UARTE is stopped or flushed. After RXTO nothing ends but the flush.
fn step_while_restarting(state: State) -> (Chip, Chip) {
    let (before, reception) = any(state);
    let mut chip = before;
    chip.step();
    assert!(holds(&chip, &reception));
    assert!(before.ends == chip.ends || before.ends < chip.ends && !before.timed_out);
    (before, chip)
}

#[kani::proof]
#[kani::unwind(6)]
fn arrival_while_receiving() {
    let (before, chip) = step_while_receiving(Chip::arrive);
    kani::cover!(chip.errors > before.errors, "a byte is spoilt");
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
    let (before, chip) = step_while_restarting(State::Stopping { exact: false });
    kani::cover!(chip.timed_out && !before.timed_out, "it has stopped");
}

#[kani::proof]
#[kani::unwind(6)]
fn step_while_stopping_exactly() {
    let (before, chip) = step_while_restarting(State::Stopping { exact: true });
    kani::cover!(chip.ended && !before.ended, "what was stored is known");
}

#[kani::proof]
#[kani::unwind(6)]
fn step_while_flushing() {
    let (before, chip) = step_while_restarting(State::Flushing);
    kani::cover!(chip.ended && !before.ended, "it is flushed");
}

/// The invariant holds. If a half has ended since the moment, the handler has given up.
fn is_kept(chip: &Chip, reception: &Handler) -> bool {
    let has_given_up = reception.state == State::Stopping { exact: false };
    holds(chip, reception) && (!chip.has_ended() || has_given_up)
}

/// A round, but for its last look, keeps it while the chip moves, with S1 and S2, which [`Chip`] asserts;
/// and S3. Returns what was, and what is.
fn round(state: State) -> ((Chip, Handler), (Chip, Handler)) {
    let (then, before) = any(state);
    let (mut chip, mut reception) = (then, before);
    chip.motion = Some(Motion::around(&chip, &before));
    reception.service(&mut chip);
    assert!(is_kept(&chip, &reception));
    if state == State::Receiving {
        assert!(reception.rounds == 1);
    } else {
        assert!(reception.rounds == 0);
        let is_waiting = reception.waited == before.waited + 1;
        assert!(reception.state == State::Receiving || is_waiting);
    }
    ((then, before), (chip, reception))
}

#[kani::proof]
#[kani::unwind(6)]
fn round_while_receiving() {
    let ((then, before), (chip, reception)) = round(State::Receiving);
    let halves = then.ends + u8::from(chip.has_ended()) + u8::from(!before.named);
    // After errors counts may be too high, and a half too many is taken to be full.
    let is_exact = then.errors == 0 && before.doubt == 0;
    assert!(
        !is_exact || reception.late == 0 || halves > 1,
        "a second half was full"
    );
    if chip.has_seen_start() && reception.state == State::Receiving {
        let is_open = chip.ends == 0 && chip.dma != Dma::Restarting;
        assert!(is_open, "the next half is named in time");
    }
    kani::cover!(chip.fed == HALF, "a half is taken");
    kani::cover!(reception.late == 1, "late");
    kani::cover!(chip.has_ended() && chip.fed == HALF, "late meanwhile");
}

/// So does the last look of a round, for a gap.
#[kani::proof]
#[kani::unwind(6)]
fn gap() {
    let (mut chip, mut reception) = any(State::Receiving);
    chip.motion = Some(Motion::from_here(&chip, &reception));
    if let Some(stop) = reception.end_at_gap(&mut chip) {
        reception.stop(stop, &mut chip);
    }
    assert!(is_kept(&chip, &reception));
    let is_exact = reception.state == State::Stopping { exact: true };
    kani::cover!(is_exact, "a gap in doubt");
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
    let (mut chip, mut reception) = any(state);
    chip.motion = Some(Motion::from_here(&chip, &reception));
    let needs_a_round = reception.tick(&mut chip);
    assert!(is_kept(&chip, &reception));
    assert!(needs_a_round == (reception.state != State::Receiving));
    kani::cover!(
        state == State::Receiving && reception.state == State::Stopping { exact: true },
        "it was quiet for long enough"
    );
}

#[kani::proof]
#[kani::unwind(6)]
fn round_while_stopping() {
    let (_, (_, reception)) = round(State::Stopping { exact: false });
    kani::cover!(reception.state == State::Flushing, "stopped");
    kani::cover!(reception.state == State::Receiving, "patience ends");
}

#[kani::proof]
#[kani::unwind(6)]
fn round_while_stopping_exactly() {
    let (_, (chip, reception)) = round(State::Stopping { exact: true });
    kani::cover!(
        reception.follows && chip.fed > 0,
        "what was stored is taken"
    );
}

#[kani::proof]
#[kani::unwind(6)]
fn round_while_flushing() {
    let (_, (chip, reception)) = round(State::Flushing);
    let has_begun = reception.state == State::Receiving;
    kani::cover!(has_begun && chip.fed > 0, "what was flushed is taken");
}

/// S4: two rounds leave no interrupt that would come again at once, unless the second has begun anew:
/// then a third.
fn rounds_end(state: State) {
    let (mut chip, mut reception) = any(state);
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
