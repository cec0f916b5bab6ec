//! The counts of a simulation, and the figures calculated from them. Counts are whole numbers, so
//! that their sums do not depend on the order of the trials.

use std::collections::BTreeMap;

use crate::station::StationKind;
use crate::statistics::{Mean, Ratio};

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
    /// Breaks that the UART reported.
    pub breaks: u64,
}

/// Counts of what happened at one receiver and at the failsafe that follows it.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct ReceiverTally {
    /// The kind of the station.
    pub kind: StationKind,
    /// Frames whose setpoint the receiver delivered with the frame's own last byte.
    pub delivered: u64,
    /// Frames that arrived intact and that the receiver did not deliver.
    pub lost_intact: u64,
    /// Deliveries that end with a frame's last byte and consist of that frame's bytes, but have
    /// another setpoint.
    pub wrong_setpoints: u64,
    /// All other deliveries of something that is not a sent frame.
    pub false_frames: u64,
    /// Bytes that belong to no delivered frame.
    pub bytes_discarded: u64,
    /// A histogram of recoveries: the key is the number of intact frames lost before the recovery.
    pub back_by_frames: BTreeMap<u64, u64>,
    /// A histogram of recoveries: the key is the duration in microseconds, from the beginning of
    /// the first lost intact frame to the next delivery.
    pub back_by_microseconds: BTreeMap<u64, u64>,
    /// How often the receiver was still losing intact frames when the trial ended.
    pub never_back: u64,
    /// The longest time without a delivery, in microseconds.
    pub longest_silence: u64,
    /// How often the failsafe took over, because frames stopped coming or never came.
    pub engagements: u64,
    /// The largest difference of any axis between the failsafe's output and the setpoint sent last,
    /// in units of the setpoint.
    pub largest_error: u8,
    /// The sum of the squared differences between output and setpoint, over all three axes and all
    /// comparisons. `looks` is the number of comparisons.
    pub(crate) error_squares: u64,
    pub(crate) looks: u64,
    pub(crate) lost_per_byte: Ratio,
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
        add!(self.line, other.line; frames_sent frames_intact bytes_sent bytes_delivered bytes_lost
            framing_errors breaks);
        for (receiver, more) in self.receivers.iter_mut().zip(other.receivers) {
            receiver.add(more);
        }
        self
    }
}

impl ReceiverTally {
    fn add(&mut self, more: Self) {
        add!(self, more; delivered lost_intact wrong_setpoints false_frames bytes_discarded never_back
            engagements error_squares looks);
        self.lost_per_byte.add(more.lost_per_byte);
        self.longest_silence = self.longest_silence.max(more.longest_silence);
        self.largest_error = self.largest_error.max(more.largest_error);
        for (sum, more) in [
            (&mut self.back_by_frames, more.back_by_frames),
            (&mut self.back_by_microseconds, more.back_by_microseconds),
        ] {
            for (key, count) in more {
                *sum.entry(key).or_default() += count;
            }
        }
    }

    /// Returns the number of intact frames lost per byte lost after the UART, if any byte was lost.
    #[must_use]
    pub fn lost_per_byte(&self) -> Option<Mean> {
        self.lost_per_byte.mean()
    }

    /// Returns the number of times that the receiver recovered after a loss.
    #[must_use]
    pub fn times_back(&self) -> u64 {
        self.back_by_microseconds.values().sum()
    }

    /// Returns a percentile of the recovery times, in milliseconds: `percent` per cent of all
    /// recoveries took at most this long.
    #[must_use]
    pub fn back_within_ms(&self, percent: u64) -> Option<f64> {
        let (all, mut so_far) = (self.times_back(), 0);
        let mut times = self.back_by_microseconds.iter();
        let time = times.find(|(_, count)| {
            so_far += **count;
            100 * so_far >= percent * all
        });
        time.map(|(&microseconds, _)| milliseconds(microseconds))
    }

    /// Returns the longest time without a delivery, in milliseconds.
    #[must_use]
    pub fn longest_silence_ms(&self) -> f64 {
        milliseconds(self.longest_silence)
    }

    /// Returns the root mean square of the difference between the failsafe's output and the
    /// setpoint sent last, or `None` if the outputs were never compared. The figure is meaningful
    /// only for smooth motion, because the failsafe's approach cannot follow any other payload.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "printed digits are unaffected")]
    pub fn error_rms(&self) -> Option<f64> {
        let mean = self.error_squares as f64 / (3 * self.looks) as f64;
        (self.looks > 0).then(|| mean.sqrt())
    }
}

#[expect(clippy::cast_precision_loss, reason = "below 2^53")]
fn milliseconds(microseconds: u64) -> f64 {
    microseconds as f64 / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_is_a_value_that_occurred() {
        let tally = ReceiverTally {
            back_by_microseconds: BTreeMap::from([(10, 98), (20, 1), (500, 1)]),
            ..ReceiverTally::default()
        };
        assert_eq!(tally.back_within_ms(50), Some(0.01));
        assert_eq!(tally.back_within_ms(99), Some(0.02));
        assert_eq!(tally.back_within_ms(100), Some(0.5));
        assert_eq!(ReceiverTally::default().back_within_ms(50), None);
    }
}
