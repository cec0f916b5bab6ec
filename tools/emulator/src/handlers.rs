//! What exception handlers cost: instructions and cycles, from entry to return.

use crate::trace::Activation;

/// Follows entries and returns.
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
