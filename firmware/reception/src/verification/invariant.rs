//! What always holds of the chip and of the reception, between any two rounds and steps.

use super::Reception;
use super::chip::{Byte, Chip, FIFO, TIMES};
use crate::{ERRORS_A_TICK, SinceByte, State};

/// Numbers on the line begin below this: they do not wrap within a round.
const NUMBERS: u8 = 30;

impl Chip {
    /// Any state in which the invariant holds.
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

    /// The invariant.
    pub(super) fn holds(&self, state: State) -> bool {
        if state == State::Stopping {
            // Nothing comes out.
            return self.stopping
                && self.reported
                && self.expected < self.next + 1
                && self.time < TIMES;
        }
        let draining = state == State::Draining;
        !self.stopping
            && self.is_possible()
            && self.is_in_order()
            // The one report stands in front of all that comes behind the drain.
            && (!draining || self.reported)
            && (self.failed || draining || self.is_lost_and_hidden() || self.is_clean())
            // When the time is over the FIFO is empty: what is in it has come since.
            && (self.failed || !draining || !self.open || self.time == 0 || self.old == 0)
    }

    /// One transfer is open, or its ENDRX has come, or is still to come.
    fn is_possible(&self) -> bool {
        self.old < FIFO + 1
            && self.new < FIFO + 1
            && self.old + self.new < FIFO + 1
            && self.new < self.next + 1
            && self.time < TIMES
            && (self.failed || !self.overran)
            // A full FIFO keeps a byte until a transfer takes it, which A1 says is soon.
            && (!self.open || !self.overran || self.time == 0 && self.old + self.new > 0)
            && u8::from(self.open) + u8::from(self.ended) + u8::from(self.owes_end) == 1
            && self.open != self.memory.is_some()
            && self.memory.is_none_or(|byte| byte.number < self.next)
    }

    /// Nothing that was handed on comes again.
    fn is_in_order(&self) -> bool {
        let follows = match self.memory {
            Some(Byte {
                number, is_sound, ..
            }) if is_sound => self.expected < number + 1 && number < self.first_new(),
            _ => true,
        };
        self.expected < self.first_new() + 1 && follows
    }

    /// No error has come that was not reported: what has come out next is the next on the line, or an event
    /// was reported since.
    fn is_clean(&self) -> bool {
        let next = self.memory.map_or(self.first_new(), |byte| byte.number);
        self.old == 0
            && self
                .memory
                .is_none_or(|byte| byte.is_sound && byte.number + 1 == self.first_new())
            && (next == self.expected || self.reported)
    }

    /// A byte lies in memory, looks like none, and its ENDRX will never come: nothing comes out any more until
    /// the FIFO has overrun.
    fn is_lost_and_hidden(&self) -> bool {
        self.owes_end && self.memory.is_some_and(|byte| byte.is_hidden)
    }
}

/// Any state of the reception.
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

/// Any state of a reception that takes bytes, and a chip that it may meet.
pub(super) fn any_that_takes_bytes() -> (Reception, Chip) {
    let reception = any_reception();
    kani::assume(reception.state != State::Stopping);
    (reception, Chip::any(&reception))
}
