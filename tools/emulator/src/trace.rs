//! What happened on the board so far, in the order in which it happened. Times are in cycles.

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
