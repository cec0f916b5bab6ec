//! The invariant of the chip and the reception. It holds before and after each round, each tick and each step of the
//! chip.

use super::Reception;
use super::chip::{Byte, Chip, FIFO, TIMES};
use crate::{ERRORS_A_TICK, SinceByte, State};

/// The limit on the number of the next byte at the start of a harness, so that numbers do not overflow within a round.
const NUMBERS: u8 = 30;

impl Chip {
    /// Returns an arbitrary chip in a state in which the invariant holds.
    pub(super) fn any(reception: &Reception) -> Self {
        let chip = Self {
            next: kani::any(),
            old: kani::any(),
            new: kani::any(),
            open: kani::any(),
            memory: kani::any(),
            ended: kani::any(),
            owes_end: kani::any(),
            failed: kani::any(),
            error: kani::any(),
            overran: kani::any(),
            time: kani::any(),
            stopping: kani::any(),
            timeout: kani::any(),
            may_owe: true,
            moves: false,
            ghost: false,
            expected: kani::any(),
            reported: kani::any(),
            owed: false,
            looked_at: None,
            pushed: 0,
            idles: 0,
            restarts: 0,
            wakes_by_error: true,
            wakes_by_timer: reception.state == State::Draining,
        };
        kani::assume(chip.next < NUMBERS && chip.holds(reception.state));
        chip
    }

    /// Returns whether the invariant holds.
    pub(super) fn holds(&self, state: State) -> bool {
        if state == State::Stopping {
            // In this state, no byte is stored or handed on.
            return self.stopping
                && self.reported
                && self.expected < self.next + 1
                && self.time < TIMES;
        }
        let draining = state == State::Draining;
        !self.stopping
            && self.is_possible()
            && self.is_in_order()
            // During a drain, an event has been reported since the last byte was handed on.
            && (!draining || self.reported)
            && (self.failed || draining || self.is_lost_and_hidden() || self.is_clean())
            // The FIFO was empty when the timer reached `NONE_WAITS`, so all bytes that are now in the FIFO came later.
            && (self.failed || !draining || !self.open || self.time == 0 || self.old == 0)
    }

    /// Returns whether the chip's state is possible. In a possible state, exactly one of three cases holds: a transfer
    /// is open, or the last transfer's ENDRX has come, or the last transfer's ENDRX is still due.
    fn is_possible(&self) -> bool {
        self.old < FIFO + 1
            && self.new < FIFO + 1
            && self.old + self.new < FIFO + 1
            && self.new < self.next + 1
            && self.time < TIMES
            && (self.failed || !self.overran)
            // A byte stays in the FIFO after an overrun (A4). An open transfer takes this byte before `NONE_WAITS`
            // (A1).
            && (!self.open || !self.overran || self.time == 0 && self.old + self.new > 0)
            && u8::from(self.open) + u8::from(self.ended) + u8::from(self.owes_end) == 1
            && self.open != self.memory.is_some()
            && self.memory.is_none_or(|byte| byte.number < self.next)
    }

    /// Returns whether the sound bytes in memory and in the FIFO come after all bytes that were handed on. So no byte
    /// is handed on twice.
    fn is_in_order(&self) -> bool {
        let follows = match self.memory {
            Some(Byte {
                number, is_sound, ..
            }) if is_sound => self.expected < number + 1 && number < self.first_new(),
            _ => true,
        };
        self.expected < self.first_new() + 1 && follows
    }

    /// Returns whether the bytes in memory and in the FIFO are sound and consecutive, and the first of them directly
    /// follows the last byte handed on. It need not follow that byte if an event was reported in between.
    fn is_clean(&self) -> bool {
        let next = self.memory.map_or(self.first_new(), |byte| byte.number);
        self.old == 0
            && self
                .memory
                .is_none_or(|byte| byte.is_sound && byte.number + 1 == self.first_new())
            && (next == self.expected || self.reported)
    }

    /// Returns whether a byte with the value `NO_BYTE` lies in memory and its ENDRX is lost. In this state, no further
    /// byte is stored until the FIFO has overrun.
    fn is_lost_and_hidden(&self) -> bool {
        self.owes_end && self.memory.is_some_and(|byte| byte.is_hidden)
    }
}

/// Returns a reception in an arbitrary state. More than `ERRORS_A_TICK` errors have the same effect as this number.
pub(super) fn any_reception() -> Reception {
    Reception {
        state: match kani::any() {
            0_u8 => State::Receiving,
            1 => State::Draining,
            _ => State::Stopping,
        },
        since_byte: SinceByte {
            in_gap: kani::any(),
            lay_there: kani::any(),
            restarts: kani::any(),
        },
        served: kani::any(),
        errors: kani::any_where(|errors| *errors < ERRORS_A_TICK + 1),
        skipped: kani::any(),
        restarts: 0,
    }
}

/// Returns a reception in an arbitrary state other than stopping, and a chip in any state that is possible with it.
pub(super) fn any_that_takes_bytes() -> (Reception, Chip) {
    let reception = any_reception();
    kani::assume(reception.state != State::Stopping);
    (reception, Chip::any(&reception))
}
