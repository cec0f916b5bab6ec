//! A receiver on the line, the failsafe behind it, and how well both do.

use std::num::NonZeroU32;
use std::time::Duration;

use framelock::{
    Accounting, Counters, Failsafe, FailsafeError, FailsafeParameters, LineEvent, Output, Parser,
    Phase, Setpoint, State,
};

use crate::setpoints::LEVEL;

/// 160 units in a second: faster than the motion, so that it catches up with it.
const MICROSECONDS_PER_UNIT: NonZeroU32 = NonZeroU32::new(6_250).unwrap();

/// Hold after five frames' time without a commit, move to park after twenty-five. Its ticks are
/// microseconds.
pub(super) fn failsafe_parameters(period: Duration) -> FailsafeParameters {
    FailsafeParameters {
        hold_after: ticks(period * 5),
        ramp_after: ticks(period * 25),
        park: LEVEL,
        ticks_per_unit: [MICROSECONDS_PER_UNIT; 3],
    }
}

/// The time as the failsafe is told it: a counter that wraps.
fn ticks(time: Duration) -> u32 {
    let [a, b, c, d, ..] = time.as_micros().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

/// How well a receiver does.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Tally {
    /// Frames sent whose setpoint was committed with their own last byte.
    pub(super) received: u64,
    /// Frames sent whose setpoint was not.
    pub(super) lost: u64,
    /// Those of them that the line delivered whole.
    pub(super) lost_though_whole: u64,
    /// Commits of anything else: not with the last byte of a frame, or not its setpoint.
    pub(super) wrong: u64,
    /// The longest time without a commit.
    pub(super) longest_silence: Duration,
    /// How often the failsafe took over from a setpoint.
    pub(super) engagements: u64,
}

/// What a byte made of a receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outcome {
    /// It waits for that byte now.
    Waits(State),
    /// It committed the setpoint of the frame that the byte ends.
    Right,
    /// It committed something else.
    Wrong,
}

/// A receiver and its failsafe.
#[derive(Debug)]
pub(super) struct Station<P> {
    line: Accounting<P>,
    failsafe: Failsafe,
    output: Output,
    is_following: bool,
    committed_at: Duration,
    tally: Tally,
}

/// What there is to see of a station.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Report {
    pub(super) state: State,
    pub(super) output: Output,
    pub(super) tally: Tally,
    pub(super) counters: Counters,
}

impl<P: Parser<Message = Setpoint>> Station<P> {
    pub(super) fn new(parser: P, parameters: FailsafeParameters) -> Result<Self, FailsafeError> {
        let mut failsafe = Failsafe::new(parameters, 0)?;
        Ok(Self {
            line: Accounting::new(parser),
            output: failsafe.poll(0),
            failsafe,
            is_following: false,
            committed_at: Duration::ZERO,
            tally: Tally::default(),
        })
    }

    /// Takes a byte; `ended` is the setpoint of the frame that it ends, if it ends one.
    pub(super) fn push(&mut self, now: Duration, byte: u8, ended: Option<Setpoint>) -> Outcome {
        let Some(setpoint) = self.line.push(byte) else {
            return Outcome::Waits(self.state());
        };
        self.poll(now);
        self.failsafe.frame(ticks(now), setpoint);
        self.committed_at = now;
        self.poll(now);
        if ended == Some(setpoint) {
            Outcome::Right
        } else {
            self.tally.wrong += 1;
            Outcome::Wrong
        }
    }

    /// The line has been idle.
    pub(super) fn idle(&mut self) {
        self.line.line_event(LineEvent::Idle);
    }

    /// A frame has been sent to its end: whether it was received, and whether the line delivered
    /// every byte of it as it was.
    pub(super) fn sent(&mut self, is_received: bool, is_whole: bool) {
        if is_received {
            self.tally.received += 1;
            return;
        }
        self.tally.lost += 1;
        if is_whole {
            self.tally.lost_though_whole += 1;
        }
    }

    /// Time passes.
    pub(super) fn poll(&mut self, now: Duration) {
        self.output = self.failsafe.poll(ticks(now));
        let is_following = matches!(self.output.phase, Phase::Live | Phase::Approach);
        if self.is_following && !is_following {
            self.tally.engagements += 1;
        }
        self.is_following = is_following;
        let silence = now.saturating_sub(self.committed_at);
        self.tally.longest_silence = self.tally.longest_silence.max(silence);
    }

    pub(super) fn report(&self) -> Report {
        Report {
            state: self.state(),
            output: self.output,
            tally: self.tally,
            counters: *self.line.counters(),
        }
    }

    /// By the number of bytes held, which is what the lecture's states are.
    fn state(&self) -> State {
        State::ALL
            .get(self.line.pending())
            .copied()
            .unwrap_or(State::Terminator)
    }
}
