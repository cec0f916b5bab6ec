//! The counts of a simulation.

use crate::station::ReceiverTally;

/// Counts of events on the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LineTally {
    /// Frames sent completely.
    pub frames_sent: u64,
    /// Frames whose bytes all arrived as they were sent, with nothing between them.
    pub frames_intact: u64,
    /// Bytes sent.
    pub bytes_sent: u64,
    /// Bytes passed to the receivers.
    pub bytes_delivered: u64,
    /// Bytes lost after the UART.
    pub bytes_lost: u64,
    /// Framing errors that the UART reported.
    pub framing_errors: u64,
}

/// Counts from any number of trials with the same parameters.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Tally {
    /// The number of trials.
    pub trials: u64,
    /// The counts of the line.
    pub line: LineTally,
    /// The counts of each receiver.
    pub receivers: Vec<ReceiverTally>,
}

/// Adds the fields of `$more` to those of `$sum`.
macro_rules! add {
    ($sum:expr, $more:expr; $($field:ident)+) => { $($sum.$field += $more.$field;)+ };
}

impl Tally {
    /// Returns the sum of both tallies.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        if self.receivers.is_empty() {
            return other;
        }
        self.trials += other.trials;
        add!(self.line, other.line; frames_sent frames_intact bytes_sent bytes_delivered bytes_lost framing_errors);
        for (sum, more) in self.receivers.iter_mut().zip(other.receivers) {
            add!(sum, more; delivered lost_intact wrong_setpoints false_frames bytes_discarded deaf engagements);
            sum.longest_silence = sum.longest_silence.max(more.longest_silence);
        }
        self
    }
}
