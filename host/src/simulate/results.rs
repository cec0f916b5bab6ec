//! What came of a simulation, as it is written.

use std::collections::BTreeMap;

use serde::Serialize;

use super::parameters::Parameters;
use super::payload::Payload;
use super::statistics::{Mean, Ratio, Share};
use super::tally::{LineTally, ReceiverTally, Tally};
use crate::names::PolicyName;

/// One set of parameters, and what came of it.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct Point {
    pub(super) parameters: Parameters,
    pub(super) line: LineResult,
    pub(super) receivers: Vec<ReceiverResult>,
}

/// What happened on the line.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct LineResult {
    pub(super) frames_sent: u64,
    /// Of the frames sent.
    pub(super) frames_intact: Share,
    pub(super) bytes_sent: u64,
    pub(super) bytes_delivered: u64,
    pub(super) bytes_lost: u64,
    pub(super) framing_errors: u64,
    pub(super) breaks: u64,
}

/// What one receiver made of it.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct ReceiverResult {
    #[serde(serialize_with = "by_its_name")]
    pub(super) policy: PolicyName,
    /// The idle-gap rule in byte times, if it has one.
    pub(super) idle_gap: Option<u32>,
    /// Of the frames sent.
    pub(super) delivered: Share,
    /// Of the frames that arrived intact.
    pub(super) lost_intact: Share,
    /// For each byte that was lost behind the UART, if any was.
    pub(super) lost_intact_per_lost_byte: Option<Mean>,
    /// Of the frames sent.
    pub(super) wrong_setpoints: Share,
    /// Of the bytes delivered.
    pub(super) false_frames: Share,
    pub(super) bytes_discarded: u64,
    pub(super) resynchronisation: ResynchronisationResult,
    pub(super) longest_silence_ms: f64,
    pub(super) failsafe_engagements: u64,
    /// In units of demand; of smooth motion only, since the failsafe's approach cannot follow any
    /// other.
    pub(super) actuator_error: Option<ActuatorErrorResult>,
}

/// From the first intact frame after a loss to the next that is delivered.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct ResynchronisationResult {
    pub(super) count: u64,
    pub(super) median_ms: Option<f64>,
    pub(super) percentile_99_ms: Option<f64>,
    pub(super) longest_ms: Option<f64>,
    /// How often none was delivered before the trial ended.
    pub(super) never: u64,
    /// How often so many intact frames were lost before one was delivered.
    pub(super) by_intact_frames_lost: BTreeMap<u64, u64>,
}

/// Over all axes and all looks at the outputs.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct ActuatorErrorResult {
    pub(super) largest: u8,
    pub(super) rms: f64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde wants it so")]
fn by_its_name<S: serde::Serializer>(
    policy: &PolicyName,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(policy_name(*policy))
}

/// As the command line names it.
pub(super) fn policy_name(policy: PolicyName) -> &'static str {
    match policy {
        PolicyName::Rescan => "rescan",
        PolicyName::Discard => "discard",
    }
}

impl Point {
    pub(super) fn new(parameters: Parameters, tally: &Tally) -> Self {
        let line = LineResult {
            frames_sent: tally.line.frames_sent,
            frames_intact: Share::new(tally.line.frames_intact, tally.line.frames_sent),
            bytes_sent: tally.line.bytes_sent,
            bytes_delivered: tally.line.bytes_delivered,
            bytes_lost: tally.line.bytes_lost,
            framing_errors: tally.line.framing_errors,
            breaks: tally.line.breaks,
        };
        let gap = Some(parameters.idle_gap);
        let kinds = [
            (PolicyName::Discard, None),
            (PolicyName::Discard, gap),
            (PolicyName::Rescan, None),
            (PolicyName::Rescan, gap),
        ];
        let is_motion = parameters.payload == Payload::Motion;
        let receivers = kinds
            .into_iter()
            .zip(&tally.receivers)
            .map(|((policy, idle_gap), receiver)| ReceiverResult {
                policy,
                idle_gap,
                actuator_error: actuator_error(receiver).filter(|_| is_motion),
                ..result(&tally.line, tally.trials, receiver)
            })
            .collect();
        Self {
            parameters,
            line,
            receivers,
        }
    }

    /// What the receiver of that policy made of it.
    pub(super) fn receiver(
        &self,
        policy: PolicyName,
        has_idle_gap: bool,
    ) -> Option<&ReceiverResult> {
        let wanted = |receiver: &&ReceiverResult| {
            receiver.policy == policy && receiver.idle_gap.is_some() == has_idle_gap
        };
        self.receivers.iter().find(wanted)
    }
}

fn result(line: &LineTally, trials: u64, receiver: &ReceiverTally) -> ReceiverResult {
    let lost = Ratio {
        trials,
        above: receiver.lost_intact,
        below: line.bytes_lost,
        above_squares: receiver.lost_intact_squares,
        products: receiver.lost_products,
        below_squares: line.bytes_lost_squares,
    };
    let times = &receiver.resynchronisation.by_microseconds;
    ReceiverResult {
        policy: PolicyName::Rescan,
        idle_gap: None,
        delivered: Share::new(receiver.delivered, line.frames_sent),
        lost_intact: Share::new(receiver.lost_intact, line.frames_intact),
        lost_intact_per_lost_byte: lost.mean(),
        wrong_setpoints: Share::new(receiver.wrong_setpoints, line.frames_sent),
        false_frames: Share::new(receiver.false_frames, line.bytes_delivered),
        bytes_discarded: receiver.bytes_discarded,
        resynchronisation: ResynchronisationResult {
            count: times.values().sum(),
            median_ms: percentile(times, 50).map(milliseconds),
            percentile_99_ms: percentile(times, 99).map(milliseconds),
            longest_ms: times.keys().next_back().copied().map(milliseconds),
            never: receiver.resynchronisation.never,
            by_intact_frames_lost: receiver.resynchronisation.by_frames.clone(),
        },
        longest_silence_ms: milliseconds(receiver.longest_silence),
        failsafe_engagements: receiver.engagements,
        actuator_error: None,
    }
}

#[expect(clippy::cast_precision_loss, reason = "what it loses is not written")]
fn actuator_error(receiver: &ReceiverTally) -> Option<ActuatorErrorResult> {
    let error = receiver.error;
    (error.samples > 0).then(|| ActuatorErrorResult {
        largest: error.largest,
        rms: (error.squares as f64 / (3 * error.samples) as f64).sqrt(),
    })
}

#[expect(clippy::cast_precision_loss, reason = "below 2^53")]
fn milliseconds(microseconds: u64) -> f64 {
    microseconds as f64 / 1000.0
}

/// The least value that is not less than so many per cent of all.
fn percentile(counts: &BTreeMap<u64, u64>, percent: u64) -> Option<u64> {
    let all: u64 = counts.values().sum();
    let mut so_far = 0;
    counts.iter().find_map(|(&value, count)| {
        so_far += count;
        (100 * so_far >= percent * all).then_some(value)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_is_a_value_that_occurred() {
        let counts = BTreeMap::from([(10, 98), (20, 1), (500, 1)]);
        assert_eq!(percentile(&counts, 50), Some(10));
        assert_eq!(percentile(&counts, 99), Some(20));
        assert_eq!(percentile(&counts, 100), Some(500));
        assert_eq!(percentile(&BTreeMap::new(), 50), None);
    }
}
