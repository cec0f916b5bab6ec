//! What exception handlers cost: instructions and cycles, from entry to return.

use std::collections::BTreeMap;

/// One run of a handler, from entry to return; without the handlers that preempted it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Activation {
    /// The exception's number: 16 + n for interrupt n.
    pub exception: u16,
    /// When it was entered, in cycles: the beginning of stacking.
    pub at: u64,
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles, with stacking and unstacking.
    pub cycles: u64,
}

/// All runs of one handler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HandlerTotals {
    /// How often it ran.
    pub activations: u64,
    /// Instructions of all runs.
    pub instructions: u64,
    /// Cycles of all runs.
    pub cycles: u64,
    /// Instructions of the run that had most.
    pub worst_instructions: u64,
    /// Cycles of the run that had most.
    pub worst_cycles: u64,
}

/// Follows entries and returns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Handlers {
    active: Vec<Activation>,
    pub(crate) totals: BTreeMap<u16, HandlerTotals>,
    /// Every run that is over, if they are to be kept.
    pub(crate) kept: Option<Vec<Activation>>,
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

    /// Takes a step into account. Returns whether an instruction was executed in it: entering an
    /// exception is none.
    pub(crate) fn step(&mut self, step: &Step) -> bool {
        if step.before == step.after && !step.entered_again {
            self.charge(1, step.cycles);
            return true;
        }
        let position = self
            .active
            .iter()
            .rposition(|open| open.exception == step.after);
        let chained = step.entered_again || (step.before != 0 && !step.before_active);
        if step.after == 0 || (position.is_some() && !step.entered_again) {
            // Returned, to a preempted handler or to none.
            self.charge(1, step.cycles);
            self.close();
            return true;
        }
        if chained {
            // Returned, and the next one was entered without unstacking in between.
            self.charge(1, step.cycles);
            self.close();
            self.open(step.after, step.at + step.cycles, 0);
            return true;
        }
        self.open(step.after, step.at, step.cycles);
        false
    }

    fn open(&mut self, exception: u16, at: u64, cycles: u64) {
        self.active.push(Activation {
            exception,
            at,
            instructions: 0,
            cycles,
        });
    }

    fn charge(&mut self, instructions: u64, cycles: u64) {
        if let Some(open) = self.active.last_mut() {
            open.instructions += instructions;
            open.cycles += cycles;
        }
    }

    fn close(&mut self) {
        let Some(done) = self.active.pop() else {
            return;
        };
        let totals = self.totals.entry(done.exception).or_default();
        totals.activations += 1;
        totals.instructions += done.instructions;
        totals.cycles += done.cycles;
        totals.worst_instructions = totals.worst_instructions.max(done.instructions);
        totals.worst_cycles = totals.worst_cycles.max(done.cycles);
        if let Some(kept) = &mut self.kept {
            kept.push(done);
        }
    }
}
