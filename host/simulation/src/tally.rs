//! What is counted, and the figures that come of it. Counts are whole numbers, so that the sum of
//! trials does not depend on their order.

use std::collections::BTreeMap;

use crate::station::Kind;
use crate::statistics::{Mean, Ratio};

/// What happened on the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LineTally {
    /// Frames sent to their end.
    pub frames_sent: u64,
    /// Frames of which every byte was delivered as it was sent, and nothing between them.
    pub frames_intact: u64,
    /// Bytes sent.
    pub bytes_sent: u64,
    /// Bytes that the receivers were given.
    pub bytes_delivered: u64,
    /// Bytes that were lost behind the UART.
    pub bytes_lost: u64,
    /// Framing errors that the UART reported.
    pub framing_errors: u64,
    /// Breaks that the UART reported.
    pub breaks: u64,
}

/// What became of the frames in one receiver, and behind its failsafe.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct ReceiverTally {
    /// Which receiver.
    pub kind: Kind,
    /// Frames whose setpoint was committed with the frame's own last byte.
    pub delivered: u64,
    /// Frames that arrived intact and were not delivered.
    pub lost_intact: u64,
    /// Commits that end with a frame's last byte and consist of that frame's bytes, but whose
    /// setpoint is another.
    pub wrong_setpoints: u64,
    /// All other commits of what is no frame that was sent.
    pub false_frames: u64,
    /// Bytes that are part of no committed frame.
    pub bytes_discarded: u64,
    /// By the number of intact frames lost on the way back: how often.
    pub back_by_frames: BTreeMap<u64, u64>,
    /// By microseconds from the first intact frame after a loss to the next delivery: how often.
    pub back_by_microseconds: BTreeMap<u64, u64>,
    /// How often intact frames were being lost when the trial ended.
    pub never_back: u64,
    /// The longest time without a commit, in microseconds.
    pub longest_silence: u64,
    /// How often the failsafe took over: frames stopped coming, or none came from the beginning.
    pub engagements: u64,
    /// The output of the failsafe against the setpoint sent last, in units of demand: the largest
    /// difference of any axis.
    pub largest_error: u8,
    /// Its squares over three axes, and how often the outputs were looked at.
    pub(crate) error_squares: u64,
    pub(crate) looks: u64,
    pub(crate) lost_per_byte: Ratio,
}

/// What was counted in any number of trials with the same parameters.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Tally {
    /// How many trials.
    pub trials: u64,
    /// The line.
    pub line: LineTally,
    /// Each receiver.
    pub receivers: Vec<ReceiverTally>,
}

/// Adds the fields of one to those of the other.
macro_rules! add {
    ($sum:expr, $more:expr; $($field:ident)+) => { $($sum.$field += $more.$field;)+ };
}

impl Tally {
    /// Both together.
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

    /// Intact frames lost for each byte that was lost behind the UART, if any was.
    #[must_use]
    pub fn lost_per_byte(&self) -> Option<Mean> {
        self.lost_per_byte.mean()
    }

    /// How often it was back after a loss.
    #[must_use]
    pub fn times_back(&self) -> u64 {
        self.back_by_microseconds.values().sum()
    }

    /// In how many milliseconds it was back, in that many per cent of all cases: the least time
    /// that occurred and is enough.
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

    /// The longest time without a commit.
    #[must_use]
    pub fn longest_silence_ms(&self) -> f64 {
        milliseconds(self.longest_silence)
    }

    /// The output of the failsafe against the setpoint sent last, root of the mean square; none if
    /// it was never looked at. Means something for smooth motion only, since the failsafe's approach
    /// cannot follow any other.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "what it loses is not written")]
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
