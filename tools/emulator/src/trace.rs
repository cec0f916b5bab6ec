//! The record of events on the board. The events of each kind are in the order in which they happened. Times are in
//! cycles.

use std::collections::BTreeSet;

use crate::MICROSECOND;

/// The cause of a reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The reset pin was pulled: [`crate::Board::reset`].
    Pin,
    /// The watchdog was not fed.
    Watchdog,
    /// The firmware requested the reset (AIRCR.SYSRESETREQ).
    Soft,
    /// The core locked up, because a fault occurred in a fault handler. See [`crate::Board::let_faults_be_handled`].
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
    /// The end of the instruction that changed the word, or an instant shortly after EasyDMA or a test changed it.
    pub at: u64,
    /// The new value.
    pub value: u32,
}

/// One run of an exception handler, from entry to return, without the handlers that preempted it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Activation {
    /// The exception's number: 16 + n for interrupt n.
    pub exception: u16,
    /// The instant of entry: the beginning of stacking, or in a tail chain the end of the handler before.
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
    /// The names of the deviations from the default assumptions that have had an effect: see
    /// [`crate::Assumptions::each`].
    pub deviations: BTreeSet<&'static str>,
}
