//! What happened on the board so far, in the order in which it happened. Times are in cycles. Exception
//! handlers are recorded with their cost: instructions and cycles, from entry to return.

use crate::chip::ResetCause;
use crate::gpio::Pins;
use crate::pwm::Period;

/// A word in RAM that has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The number that [`crate::Board::watch`] gave the word.
    pub watch: usize,
    /// When the instruction that changed it was over.
    pub at: u64,
    /// What it is now.
    pub value: u32,
}

/// One run of an exception handler, from entry to return; without the handlers that preempted it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Activation {
    /// The exception's number: 16 + n for interrupt n.
    pub exception: u16,
    /// When it was entered: the beginning of stacking.
    pub at: u64,
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles, with stacking and unstacking.
    pub cycles: u64,
}

/// A reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reset {
    /// When.
    pub at: u64,
    /// Why.
    pub cause: ResetCause,
}

/// All of it. Take it now and then (`std::mem::take`) in a long run, or it grows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Trace {
    /// Changes of the watched words.
    pub changes: Vec<Change>,
    /// Runs of handlers that are over.
    pub activations: Vec<Activation>,
    /// PWM periods, the one that has begun included.
    pub pwm_periods: Vec<Period>,
    /// Changes of the output pins, and when.
    pub pin_changes: Vec<(u64, Pins)>,
    /// Resets; power-on is none.
    pub resets: Vec<Reset>,
}

/// Follows entries into handlers and returns from them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Handlers {
    /// The handler that runs, and before it those that it preempted.
    active: Vec<Activation>,
}

/// What the core did in one step.
pub(crate) struct Step {
    /// The exception that was active before it, and after it; 0: none.
    pub(crate) before: u16,
    pub(crate) after: u16,
    /// Whether `before` is still active, if it is an exception.
    pub(crate) before_active: bool,
    /// Whether the step went on in the same handler's first instruction: it returned and was
    /// entered again at once.
    pub(crate) entered_again: bool,
    pub(crate) at: u64,
    pub(crate) cycles: u64,
}

impl Handlers {
    /// Nothing is active after a reset.
    pub(crate) fn reset(&mut self) {
        self.active.clear();
    }

    /// Takes a step into account. Returns whether an instruction was executed in it, since entering
    /// an exception is none, and the run of a handler that is over with it.
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
            // Returned, to a preempted handler or to none.
            self.charge(step.cycles);
            return (true, self.active.pop());
        }
        if chained {
            // Returned, and the next one was entered without unstacking in between.
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
            instructions: 0,
            cycles,
        });
    }

    /// An instruction, if a handler runs.
    fn charge(&mut self, cycles: u64) {
        if let Some(running) = self.active.last_mut() {
            running.instructions += 1;
            running.cycles += cycles;
        }
    }
}
