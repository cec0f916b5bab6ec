//! Why a round may be looked at as if it happened at one moment, though the chip moves while it runs.
//!
//! Any number of the chip's steps may come between two accesses of the handler. The *moment* is when a round
//! reads the number of errors, or finds that there was none.
//!
//! * **Before the moment** the handler looks at events, and clears those that it sees. No step depends on
//!   an event ([`steps_read_no_event`]), so the invariant holds of the chip with the cleared events put back.
//!   What the handler saw had happened by then: [`motion`](super::motion) takes any number of RXSTARTED and
//!   ENDRX up to the present one, in the order in which it looked. They only grow, and after RXTO no half
//!   ends: each step's harness asserts that. The count of a silence is a part of the handler's state as soon
//!   as it is read, and the invariant speaks of it.
//! * **After the moment** an access might as well have come at the moment, if no step in between changes what
//!   it reads or does something else for what it writes. A byte that may be read stays
//!   ([`stored_bytes_stay`]). What is written may be written sooner ([`writes_may_come_sooner`]), with two
//!   exceptions: naming a half, if RXSTARTED takes it over before; and taking away the shortcut, if ENDRX
//!   comes before. RXSTARTED cannot come then without another ENDRX, which `round_while_receiving` asserts.
//!   So ENDRX is left, and errors, which the handler may read newer than they were at the moment.
//! * **If ENDRX comes after the moment**, and before the handler has named a half or taken away the shortcut,
//!   the handler sees it and gives up: every round asserts that. From then on the invariant asks of the chip
//!   only what every step keeps, however late the handler is ([`a_chip_stays_sound`]).
//! * The last look of a round, for a gap, is a round of its own: what comes before it keeps the invariant.
//!   So is a tick. Its moment is its first access.
//! * When the UARTE is begun anew it is off, and nothing moves that matters ([`nothing_moves_while_it_is_off`]):
//!   the moment is STARTRX. What was before does not matter ([`it_begins_anew`]).

use super::chip::{Chip, Dma, HALF, Step};
use super::induction::{any_half, anything};
use super::invariant::{holds, is_sound};
use crate::{Registers as _, State};

fn any_chip() -> Chip {
    anything(State::Receiving).0
}

/// What the chip only sets and the handler reads and clears, and what the handler sets and no step reads.
fn without_events(chip: Chip) -> Chip {
    Chip {
        started: false,
        ended: false,
        ends: 0,
        timed_out: false,
        error: false,
        overrun: false,
        silent: false,
        gap: false,
        listening: false,
        expected: 0,
        reported: false,
        fed: 0,
        ..chip
    }
}

/// A step does the same, and sets the same events, whichever events are set, whatever was handed on.
#[kani::proof]
#[kani::unwind(6)]
fn steps_read_no_event() {
    let before = any_chip();
    let (mut chip, mut other) = (before, without_events(before));
    chip.step();
    other.step();
    assert!(without_events(chip) == without_events(other));
    let joined = Chip {
        started: before.started | other.started,
        ended: before.ended | other.ended,
        ends: before.ends + other.ends,
        timed_out: before.timed_out | other.timed_out,
        error: before.error | other.error,
        overrun: before.overrun | other.overrun,
        silent: before.silent | other.silent,
        gap: before.gap | other.gap,
        listening: before.listening,
        expected: before.expected,
        reported: before.reported,
        fed: before.fed,
        ..other
    };
    assert!(chip == joined);
    kani::cover!(other.ended, "ENDRX");
}

/// A byte that may be read stays as it is, and may be read.
#[kani::proof]
#[kani::unwind(6)]
fn stored_bytes_stay() {
    let mut chip = any_chip();
    let (half, at) = (any_half(), kani::any_where(|&at: &u8| at < HALF));
    let is_stored = |chip: &Chip| chip.named != half && (chip.writing != half || at < chip.done);
    kani::assume(is_stored(&chip) && chip.done <= HALF);
    let byte = |chip: &Chip| chip.memory[half as usize][usize::from(at)];
    let before = byte(&chip);
    chip.step();
    assert!(is_stored(&chip) && byte(&chip) == before);
    kani::cover!(chip.writing == half, "the half is written");
}

/// What the handler writes after a step it could as well have written before, and the chip then have made
/// that step or none; but for RXSTARTED, which takes the pointer over, and ENDRX while the shortcut is
/// there.
#[kani::proof]
#[kani::unwind(6)]
fn writes_may_come_sooner() {
    let before = any_chip();
    let half = any_half();
    let which: u8 = kani::any();
    let write = |mut chip: Chip| {
        match which {
            0 => chip.named = half,
            1 => {
                chip.short = false;
                // It is cleared next.
                chip.timed_out = false;
            }
            2 => chip.stopping = true,
            _ => chip.flushing = true,
        }
        chip
    };
    let step = |mut chip: Chip| {
        chip.step();
        chip
    };
    kani::assume(which != 0 || before.chance.step != Step::Restart);
    kani::assume(which != 1 || before.chance.step != Step::End);
    kani::assume(!before.stopping && !before.flushing);
    let late = write(step(before));
    assert!(late == step(write(before)) || late == write(before));
    kani::cover!(which == 0 && late.done > before.done, "a byte is stored");
}

/// When the receiver is off nothing moves but the silence and what nobody hears.
#[kani::proof]
#[kani::unwind(6)]
fn nothing_moves_while_it_is_off() {
    let before = any_chip();
    let is_off = !before.runs && !before.short && !before.stopping && !before.flushing;
    kani::assume(is_off && !before.ready_due && before.dma == Dma::Closed);
    let mut chip = before;
    chip.step();
    let as_before = Chip {
        broken: before.broken,
        silent: before.silent,
        silence_seen: before.silence_seen,
        at_silence: before.at_silence,
        gap: before.gap,
        gap_seen: before.gap_seen,
        ..chip
    };
    assert!(as_before == before);
    assert!(chip.at_silence == before.at_silence || chip.at_silence == chip.count);
    kani::cover!(chip.broken && !before.broken, "a byte is not heard");
}

/// What holds of the chip alone every step keeps, also when the handler is late.
#[kani::proof]
#[kani::unwind(6)]
fn a_chip_stays_sound() {
    let (before, reception) = anything(State::Receiving);
    kani::assume(is_sound(&before, &reception));
    let mut chip = before;
    chip.step();
    assert!(is_sound(&chip, &reception));
    if before.runs && !before.stopping && !before.flushing {
        assert!(chip.runs && !chip.stopping && !chip.flushing);
    }
    assert!(before.short || chip.timed_out == before.timed_out || before.stopping);
    kani::cover!(chip.ends > 1, "late");
}

/// To begin anew takes nothing but a chip that is off, or is switched off.
#[kani::proof]
#[kani::unwind(6)]
fn it_begins_anew() {
    let (mut chip, mut reception) = anything(State::Flushing);
    kani::assume(is_sound(&chip, &reception));
    let is_off = !chip.runs && !chip.stopping && !chip.flushing;
    if !is_off || chip.ready_due || chip.dma != Dma::Closed || kani::any() {
        chip.switch_off_and_on();
    }
    reception.begin_again(&mut chip);
    assert!(holds(&chip, &reception));
    kani::cover!(chip.errors > 1, "with errors that were not read");
}
