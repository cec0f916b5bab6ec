//! Proves S1 and S2 of theorem 12 by induction: the invariant holds at the start, and every step preserves it. Each
//! byte that the reception hands on goes to [`Chip::push`](crate::Registers::push), which asserts S1 and S2 for this
//! byte.

use super::Reception;
use super::chip::Chip;
use super::invariant::{any_reception, any_that_takes_bytes};
use crate::State;

#[kani::proof]
fn at_the_start() {
    let mut chip = Chip::any(&Reception::default());
    // The UARTE has just been switched on, and no transfer is open.
    chip.old = 0;
    chip.new = 0;
    chip.open = false;
    chip.ended = false;
    chip.owes_end = false;
    chip.failed = false;
    chip.overran = false;
    chip.next = chip.expected;
    let reception = Reception::begin(&mut chip);
    assert!(chip.holds(reception.state));
    assert!(chip.wakes_by_error);
    kani::cover!(chip.open);
}

#[kani::proof]
fn whatever_the_chip_does() {
    let reception = any_reception();
    let mut chip = Chip::any(&reception);
    chip.moves();
    assert!(chip.holds(reception.state));
    kani::cover!(chip.ended && !chip.failed && chip.new == 2);
    kani::cover!(chip.failed && chip.old == 1 && chip.new == 1);
}

/// Checks a round during which the chip takes any steps. `begins_with` restricts the state at the start of the round.
fn a_round(begins_with: fn(&Chip) -> bool) -> Chip {
    let (mut reception, mut chip) = any_that_takes_bytes();
    kani::assume(begins_with(&chip));
    chip.moves = true;
    reception.service(&mut chip);
    assert!(chip.holds(reception.state));
    chip
}

#[kani::proof]
#[kani::unwind(6)]
fn a_round_that_begins_with_an_open_transfer() {
    let chip = a_round(|chip| chip.open);
    kani::cover!(chip.pushed == 1 && chip.failed);
}

#[kani::proof]
#[kani::unwind(6)]
fn a_round_that_begins_with_an_end() {
    let chip = a_round(|chip| chip.ended);
    kani::cover!(chip.pushed == 1 && chip.failed);
}

#[kani::proof]
#[kani::unwind(6)]
fn a_round_that_begins_with_a_lost_end() {
    let chip = a_round(|chip| chip.owes_end);
    kani::cover!(chip.restarts == 1);
}

#[kani::proof]
#[kani::unwind(6)]
fn a_round_while_it_stops() {
    let mut reception = any_reception();
    kani::assume(reception.state == State::Stopping);
    let mut chip = Chip::any(&reception);
    chip.moves = true;
    reception.service(&mut chip);
    assert!(chip.holds(reception.state));
    kani::cover!(chip.open && chip.timeout);
    kani::cover!(chip.open && !chip.timeout);
    kani::cover!(chip.stopping);
}

#[kani::proof]
#[kani::unwind(6)]
fn a_tick_in_which_the_chip_moves() {
    let mut reception = any_reception();
    let mut chip = Chip::any(&reception);
    chip.moves = true;
    reception.tick(&mut chip);
    assert!(chip.holds(reception.state));
    kani::cover!(chip.restarts == 1);
}
