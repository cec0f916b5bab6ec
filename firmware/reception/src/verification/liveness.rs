//! L1 to L4: the reception makes progress. In the harnesses of L1 to L3, the chip takes no step during a round or a
//! tick. Between two rounds it takes at most the step of [`Chip::does_what_it_must`].

use super::chip::{Chip, FIFO};
use super::invariant::{any_reception, any_that_takes_bytes};
use crate::{MOST_RESTARTS, State};

impl Chip {
    /// Makes progress in an open transfer. If a byte waits, the byte is stored, and its ENDRX comes, unless this ENDRX
    /// is late or lost. If no byte waits, `NONE_WAITS` elapses.
    fn does_what_it_must(&mut self) {
        if self.open && (self.old > 0 || self.new > 0) {
            self.stores();
        } else if self.open {
            self.time = self.time.max(1);
        }
    }
}

#[kani::proof]
#[kani::unwind(6)]
fn a_round_takes_what_has_come() {
    let (mut reception, mut chip) = any_that_takes_bytes();
    let (before, had_ended) = (reception, chip.ended);
    let (time, had_failed) = (chip.time, chip.failed);
    reception.service(&mut chip);
    // L1: the round takes the byte.
    assert!(!chip.ended && (chip.open || chip.owes_end));
    let dropped = reception.skipped.wrapping_sub(before.skipped);
    assert!(u32::from(chip.pushed) + dropped == u32::from(had_ended));
    assert!(dropped == 0 || chip.reported, "dropped after a report");
    // The round reports the gap and the error.
    assert!(chip.idles == u8::from(time >= 2 && !before.since_byte.in_gap));
    assert!(!had_failed || chip.reported && reception.state != State::Receiving);
    assert!(had_ended || reception.since_byte.restarts >= before.since_byte.restarts);
    // The round clears ERROR.
    assert!(!chip.error);
    kani::cover!(chip.pushed == 1);
    kani::cover!(dropped == 1 && had_failed);
}

#[kani::proof]
#[kani::unwind(6)]
fn after_the_last_error_it_hears_again() {
    let (mut reception, mut chip) = any_that_takes_bytes();
    chip.may_owe = false;
    kani::assume(!chip.owes_end);
    // L2 needs one round for the error, one round for each byte in memory and in the FIFO, and one round for
    // `NONE_WAITS`.
    for _ in 0..FIFO + 2 {
        reception.service(&mut chip);
        (chip.failed, chip.overran) = (false, false);
        chip.does_what_it_must();
    }
    reception.service(&mut chip);
    assert!(reception.state == State::Receiving && chip.open && !chip.ended);
    assert!(!chip.wakes_by_timer);
    kani::cover!(chip.pushed == 0);
    kani::cover!(chip.pushed == 4);
}

#[kani::proof]
#[kani::unwind(6)]
fn an_error_wakes_when_its_time_is_over() {
    let (mut reception, mut chip) = any_that_takes_bytes();
    kani::assume(chip.failed);
    reception.service(&mut chip);
    kani::assume(!chip.stopping);
    // After too many errors, ERROR and the timer wake the handler again only after the tick.
    assert!(chip.wakes_by_timer == chip.wakes_by_error);
    if !chip.wakes_by_error {
        reception.tick(&mut chip);
        assert!(chip.wakes_by_error != chip.stopping);
        assert!(chip.wakes_by_timer == (reception.state == State::Draining));
    }
    kani::cover!(chip.restarts == 0);
}

#[kani::proof]
#[kani::unwind(6)]
fn a_lost_endrx_is_seen_by_the_second_tick() {
    let (mut reception, mut chip) = any_that_takes_bytes();
    kani::assume(chip.owes_end && !chip.failed);
    let hidden = chip.memory.is_some_and(|byte| byte.is_hidden);
    if hidden {
        // L3: more bytes arrive, and the FIFO overruns.
        (chip.failed, chip.overran) = (true, true);
        chip.time = chip.time.max(1);
        reception.service(&mut chip);
    } else {
        for _ in 0..2 {
            reception.tick(&mut chip);
            reception.service(&mut chip);
        }
    }
    assert!(chip.restarts == 1 && chip.reported);
    kani::cover!(hidden);
    kani::cover!(!hidden);
}

/// Checks that the UARTE is restarted when RXTO comes, or when twice the time `GAP` has elapsed without RXTO. After the
/// restart, a round that finds the time `NONE_WAITS` elapsed ends the drain.
#[kani::proof]
#[kani::unwind(6)]
fn after_a_stop_it_hears_again() {
    let mut reception = any_reception();
    kani::assume(reception.state == State::Stopping);
    let mut chip = Chip::any(&reception);
    kani::assume(chip.timeout || chip.time == 4);
    let restarts = reception.since_byte.restarts;
    reception.service(&mut chip);
    assert!(chip.open && reception.since_byte.restarts == restarts);
    chip.does_what_it_must();
    reception.service(&mut chip);
    assert!(reception.state == State::Receiving);
    kani::cover!(chip.timeout);
    kani::cover!(!chip.timeout);
}

/// Checks that each lost ENDRX adds one to the count of restarts since the last byte. So if no more bytes are read, the
/// tick returns false after `MOST_RESTARTS` restarts. The tick also returns false if there was no round since the last
/// tick.
#[kani::proof]
#[kani::unwind(6)]
fn if_endrx_or_the_rounds_come_no_more_it_says_so() {
    let (mut reception, mut chip) = any_that_takes_bytes();
    kani::assume(chip.owes_end && chip.memory.is_some_and(|byte| !byte.is_hidden));
    let restarts = reception.since_byte.restarts;
    reception.tick(&mut chip);
    let served: bool = kani::any();
    if served {
        reception.service(&mut chip);
    }
    let works = reception.tick(&mut chip);
    let now = reception.since_byte.restarts;
    assert!(now == restarts.saturating_add(1));
    assert!(works == (served && now < MOST_RESTARTS));
    kani::cover!(served && !works);
    kani::cover!(works);
}

/// Checks L2: a round ends the drain if it finds a transfer open, the timer at `NONE_WAITS` or later, and no error.
/// This holds whatever happened in earlier rounds, and however late the round is.
#[kani::proof]
#[kani::unwind(6)]
fn a_round_in_a_pause_ends_the_drain() {
    let (mut reception, mut chip) = any_that_takes_bytes();
    kani::assume(chip.open && chip.time > 0 && !chip.failed);
    let before = reception.state;
    reception.service(&mut chip);
    assert!(reception.state == State::Receiving);
    kani::cover!(before == State::Draining && chip.new > 0);
}

/// Checks L4: a duplicate ENDRX causes at most one spurious byte. This byte is delivered in addition to the stored
/// bytes, or instead of one of them.
#[kani::proof]
#[kani::unwind(6)]
fn an_endrx_that_comes_again_for_an_open_transfer_costs_a_byte() {
    let (mut reception, mut chip) = any_that_takes_bytes();
    kani::assume(chip.open);
    chip.ended = true;
    chip.ghost = true;
    chip.may_owe = false;
    chip.moves = true;
    let expected = chip.expected;
    reception.service(&mut chip);
    assert!(chip.holds(reception.state));
    kani::cover!(chip.pushed == 1 && chip.expected == expected);
    kani::cover!(chip.pushed == 1 && chip.expected == expected + 1 && !chip.ghost);
    kani::cover!(chip.pushed == 1 && chip.ghost);
}
