//! The record of events on the board, in the order in which they happened. Times are in cycles. Each
//! run of an exception handler is recorded with its cycles, from entry to return.

use crate::MICROSECOND;

/// Why the chip was reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The reset pin was pulled: [`crate::Board::reset`].
    Pin,
    /// The watchdog was not fed.
    Watchdog,
    /// The firmware requested the reset (AIRCR.SYSRESETREQ).
    Soft,
    /// The core locked up, because a handler of faults itself had a fault. See [`crate::Board::let_faults_be_handled`].
    Lockup,
    /// The supply was too low for a moment: [`crate::Board::brown_out`].
    BrownOut,
}

/// The levels of the output pins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pins {
    /// A bit for each output pin of P0 and P1.
    pub outputs: [u32; 2],
    /// A bit for each output pin that is high.
    pub high: [u32; 2],
}

/// One period of the pulses on the pins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Period {
    /// The beginning of the period, in cycles.
    pub at: u64,
    /// The length of the period, in cycles.
    pub length: u64,
    /// For each channel, the number of cycles for which it is high; `None` if the channel has no pin.
    pub high: [Option<u64>; 4],
}

impl Period {
    /// Returns the widths of the pulses in microseconds, rounded down; `None` for a channel without a
    /// pin.
    #[must_use]
    pub fn pulses(&self) -> [Option<u64>; 4] {
        self.high
            .map(|high| high.map(|cycles| cycles / MICROSECOND))
    }
}

/// A change of a watched word in RAM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The number that [`crate::Board::watch`] returned for the word.
    pub watch: usize,
    /// The end of the instruction that changed the word.
    pub at: u64,
    /// The new value.
    pub value: u32,
}

/// One run of an exception handler, from entry to return, without the handlers that preempted it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Activation {
    /// The exception's number: 16 + n for interrupt n.
    pub exception: u16,
    /// The instant of entry: the beginning of stacking.
    pub at: u64,
    /// The number of cycles, including stacking and unstacking.
    pub cycles: u64,
}

/// A reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reset {
    /// The instant of the reset.
    pub at: u64,
    /// The cause of the reset.
    pub cause: ResetCause,
}

/// All events so far. The trace keeps growing. In a long run, empty it from time to time with `std::mem::take`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trace {
    /// Changes of the watched words.
    pub changes: Vec<Change>,
    /// Completed runs of handlers.
    pub activations: Vec<Activation>,
    /// PWM periods, including the current one.
    pub pwm_periods: Vec<Period>,
    /// Changes of the output pins, with their instants.
    pub pin_changes: Vec<(u64, Pins)>,
    /// Resets, without power-on.
    pub resets: Vec<Reset>,
}

/// Tracks entries into handlers and returns from them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Handlers {
    /// The active handlers: the running one last, after those that it preempted.
    active: Vec<Activation>,
}

/// One step of the core.
pub(crate) struct Step {
    /// The active exceptions before and after the step; 0 means none.
    pub(crate) before: u16,
    pub(crate) after: u16,
    /// Whether the exception `before` is still active.
    pub(crate) before_active: bool,
    /// Whether the handler returned and was entered again in this step. The next instruction is then the handler's
    /// first.
    pub(crate) entered_again: bool,
    pub(crate) at: u64,
    pub(crate) cycles: u64,
}

impl Handlers {
    /// Forgets all handlers. None is active after a reset.
    pub(crate) fn reset(&mut self) {
        self.active.clear();
    }

    /// Records a step. Returns whether the step executed an instruction. If the step completed a run of a handler, also
    /// returns this run. A step that only enters an exception executes no instruction.
    pub(crate) fn step(&mut self, step: &Step) -> (bool, Option<Activation>) {
        if step.before == step.after && !step.entered_again {
            self.charge(step.cycles);
            return (true, None);
        }
        let position = self
            .active
            .iter()
            .rposition(|open| open.exception == step.after);
        let chained = step.entered_again || (step.before != 0 && !step.before_active);
        if step.after == 0 || (position.is_some() && !step.entered_again) {
            // A handler returned, to a preempted handler or to thread mode.
            self.charge(step.cycles);
            return (true, self.active.pop());
        }
        if chained {
            // A handler returned, and the next one was entered without unstacking in between.
            self.charge(step.cycles);
            let done = self.active.pop();
            self.open(step.after, step.at + step.cycles, 0);
            return (true, done);
        }
        self.open(step.after, step.at, step.cycles);
        (false, None)
    }

    fn open(&mut self, exception: u16, at: u64, cycles: u64) {
        self.active.push(Activation {
            exception,
            at,
            cycles,
        });
    }

    /// Adds cycles to the running handler, if a handler is running.
    fn charge(&mut self, cycles: u64) {
        if let Some(running) = self.active.last_mut() {
            running.cycles += cycles;
        }
    }
}
