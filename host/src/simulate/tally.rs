//! What is counted. Whole numbers only, so that the sum does not depend on the order.

use std::collections::BTreeMap;

/// What happened on the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct LineTally {
    pub(super) bytes_sent: u64,
    /// Bytes that the receivers were given.
    pub(super) bytes_delivered: u64,
    /// Bytes that were lost behind the UART.
    pub(super) bytes_lost: u64,
    pub(super) framing_errors: u64,
    pub(super) breaks: u64,
    pub(super) frames_sent: u64,
    /// Frames of which every byte was delivered as it was sent, and nothing between them.
    pub(super) frames_intact: u64,
    /// The sum over all trials of the square of the bytes lost.
    pub(super) bytes_lost_squares: u64,
}

/// What became of the frames in one receiver, and behind its failsafe.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct ReceiverTally {
    /// Frames whose setpoint was committed with the frame's own last byte.
    pub(super) delivered: u64,
    /// Frames that arrived intact and were not delivered.
    pub(super) lost_intact: u64,
    /// Commits that end with a frame's last byte and consist of that frame's bytes, but whose
    /// setpoint is another.
    pub(super) wrong_setpoints: u64,
    /// All other commits of what is no frame that was sent.
    pub(super) false_frames: u64,
    pub(super) bytes_discarded: u64,
    pub(super) resynchronisation: Resynchronisation,
    /// The longest time without a commit, in microseconds.
    pub(super) longest_silence: u64,
    /// How often the failsafe took over from a setpoint.
    pub(super) engagements: u64,
    pub(super) error: ActuatorError,
    /// Sums over all trials: the square of the intact frames lost, and that times the bytes lost.
    pub(super) lost_intact_squares: u64,
    pub(super) lost_products: u64,
}

/// How long it took to be back.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Resynchronisation {
    /// How often so many intact frames were lost on the way.
    pub(super) by_frames: BTreeMap<u64, u64>,
    /// How often it took so many microseconds.
    pub(super) by_microseconds: BTreeMap<u64, u64>,
    /// How often intact frames were being lost when the trial ended.
    pub(super) never: u64,
}

/// The output of the failsafe against the setpoint sent last, in units of demand.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct ActuatorError {
    pub(super) largest: u8,
    /// Over three axes.
    pub(super) squares: u64,
    pub(super) samples: u64,
}

/// All receivers, in this order: Discard, Discard with an idle-gap rule, Rescan, Rescan with an
/// idle-gap rule.
pub(super) const RECEIVERS: usize = 4;

/// Of any number of trials.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Tally {
    pub(super) trials: u64,
    pub(super) line: LineTally,
    pub(super) receivers: [ReceiverTally; RECEIVERS],
}

impl Tally {
    /// Both together.
    pub(super) fn and(mut self, other: Self) -> Self {
        self.trials += other.trials;
        let (line, more) = (&mut self.line, other.line);
        line.bytes_sent += more.bytes_sent;
        line.bytes_delivered += more.bytes_delivered;
        line.bytes_lost += more.bytes_lost;
        line.framing_errors += more.framing_errors;
        line.breaks += more.breaks;
        line.frames_sent += more.frames_sent;
        line.frames_intact += more.frames_intact;
        line.bytes_lost_squares += more.bytes_lost_squares;
        for (receiver, more) in self.receivers.iter_mut().zip(other.receivers) {
            receiver.add(more);
        }
        self
    }
}

impl ReceiverTally {
    fn add(&mut self, more: Self) {
        self.delivered += more.delivered;
        self.lost_intact += more.lost_intact;
        self.wrong_setpoints += more.wrong_setpoints;
        self.false_frames += more.false_frames;
        self.bytes_discarded += more.bytes_discarded;
        self.resynchronisation.add(more.resynchronisation);
        self.longest_silence = self.longest_silence.max(more.longest_silence);
        self.engagements += more.engagements;
        self.error.largest = self.error.largest.max(more.error.largest);
        self.error.squares += more.error.squares;
        self.error.samples += more.error.samples;
        self.lost_intact_squares += more.lost_intact_squares;
        self.lost_products += more.lost_products;
    }
}

impl Resynchronisation {
    /// It took so long, and so many intact frames were lost.
    pub(super) fn record(&mut self, frames: u64, microseconds: u64) {
        *self.by_frames.entry(frames).or_default() += 1;
        *self.by_microseconds.entry(microseconds).or_default() += 1;
    }

    fn add(&mut self, more: Self) {
        for (sum, more) in [
            (&mut self.by_frames, more.by_frames),
            (&mut self.by_microseconds, more.by_microseconds),
        ] {
            for (key, count) in more {
                *sum.entry(key).or_default() += count;
            }
        }
        self.never += more.never;
    }
}
