//! A machine at the end of the line, its failsafe, and the outcome of each frame.

use std::collections::VecDeque;
use std::fmt;
use std::ops::Range;

use framelock::lecture::Lecture;
use framelock::motion::{Failsafe, FailsafeParameters, Output, Setpoint};
use framelock::{DiscardReason, LineEvent};
use framelock_receiving::{AnyLine, Piece, Protocol, Standstill, TrackedLine};
use framelock_simulation::LEVEL;
use serde::Serialize;

/// Times are in milliseconds. The failsafe holds after a silence of three frames and ramps after eight. Two frames
/// start an approach. The whole travel of an axis takes a second in an approach, and 0.4 seconds when live.
const FAILSAFE: FailsafeParameters<u8, 3> = FailsafeParameters {
    hold_after: 300,
    ramp_after: 800,
    frames_to_start: 2,
    approach_for: 1,
    live_travel: 400,
    ..FailsafeParameters::for_clock(1_000, 50, [LEVEL.pitch, LEVEL.roll, LEVEL.yaw])
};

/// Counts of the outcomes of frames.
#[derive(Default, Serialize)]
pub(crate) struct Tally {
    /// Frames that arrived intact and were delivered.
    pub(crate) delivered: usize,
    /// Frames that arrived intact and were not delivered.
    pub(crate) missed: usize,
    /// Deliveries of bytes that are not an intact frame.
    pub(crate) wrong: usize,
    /// The numbers of missed frames and of wrong deliveries since the last correct delivery.
    pub(crate) missed_in_row: usize,
    pub(crate) wrong_in_row: usize,
    /// The time at which the first of these missed frames arrived.
    pub(crate) since: u32,
}

pub(crate) struct Machine {
    pub(crate) line: TrackedLine,
    protocol: Protocol,
    failsafe: Failsafe<u8, 3>,
    pub(crate) output: Output<u8, 3>,
    pub(crate) standstill: Standstill,
    /// The frame delivered last.
    pub(crate) frame: Vec<u8>,
    /// The outcomes of the received bytes, in order, and the number of outcomes before the last step.
    pub(crate) fates: Vec<Fate>,
    pub(crate) decided_before: usize,
    pub(crate) tally: Tally,
    /// The intact frames that may still be delivered: their bytes in the received stream, and the times at which they
    /// arrived.
    arrived: VecDeque<(Range<usize>, u32)>,
}

/// The outcome of a byte.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fate {
    /// The byte belongs to a delivered frame that was sent.
    Delivered,
    /// The byte belongs to a delivered frame that nobody sent.
    Wrong,
    /// The byte belongs to no delivered frame.
    Discarded(DiscardReason),
}

impl fmt::Display for Fate {
    /// Writes the page's name for the outcome.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Delivered => f.write_str("delivered"),
            Self::Wrong => f.write_str("wrong"),
            Self::Discarded(why) => why.fmt(f),
        }
    }
}

impl Machine {
    pub(crate) fn new(line: AnyLine, protocol: Protocol) -> Self {
        let mut failsafe = Failsafe::new(FAILSAFE, 0).expect("the parameters do not contradict");
        Self {
            line: TrackedLine::new(line),
            protocol,
            output: failsafe.poll(0),
            failsafe,
            standstill: Standstill::new(1_000, FAILSAFE.hold_after),
            frame: Vec::new(),
            fates: Vec::new(),
            decided_before: 0,
            tally: Tally::default(),
            arrived: VecDeque::new(),
        }
    }

    /// Processes a byte that arrives at the time `at`. If this byte completes a frame that arrived intact, `whole` is
    /// the frame's length.
    pub(crate) fn push(&mut self, byte: u8, at: u32, whole: Option<usize>) {
        if let Some(length) = whole {
            let end = self.line.decided() + self.line.pending().len() + 1;
            self.arrived.push_back((end - length..end, at));
        }
        let pieces = self.line.push(byte);
        self.decided(pieces);
    }

    /// Reports a line event to the machine.
    pub(crate) fn line_event(&mut self, event: LineEvent) {
        let pieces = self.line.line_event(event);
        self.decided(pieces);
    }

    /// Polls the failsafe at this time.
    pub(crate) fn poll(&mut self, now: u32) {
        self.output = self.failsafe.poll(now);
        let frames = self.line.counters().frames.into();
        let slow_frames = self.failsafe.slow_frames();
        self.standstill.polled(now, frames, slow_frames);
    }

    /// Returns the setpoint delivered last.
    pub(crate) fn setpoint(&self) -> Option<Setpoint> {
        self.protocol.setpoint(&self.frame)
    }

    /// Returns the machine's name.
    pub(crate) fn name(&self) -> &'static str {
        match self.lecture() {
            Some(_) => "the lecture's machine",
            None => "framelock",
        }
    }

    /// Returns the lecture's machine, or `None` if this is framelock's receiver.
    pub(crate) fn lecture(&self) -> Option<&Lecture> {
        self.line.line().lecture()
    }

    fn decided(&mut self, pieces: Vec<Piece>) {
        for piece in pieces {
            let bytes = piece.from..piece.from + piece.bytes.len();
            let fate = if let Some(why) = piece.discarded {
                Fate::Discarded(why)
            } else {
                self.frame = piece.frame;
                if let Some(setpoint) = self.setpoint() {
                    self.failsafe.frame(setpoint);
                }
                self.deliver(&bytes)
            };
            self.fates.resize(bytes.end, fate);
        }
        self.miss(self.line.decided());
    }

    /// Counts these bytes, which the machine delivered as a frame, as a correct or a wrong delivery.
    fn deliver(&mut self, bytes: &Range<usize>) -> Fate {
        self.miss(bytes.start);
        if self
            .arrived
            .front()
            .is_some_and(|(arrived, _)| arrived == bytes)
        {
            self.arrived.pop_front();
            self.tally.delivered += 1;
            (self.tally.missed_in_row, self.tally.wrong_in_row) = (0, 0);
            return Fate::Delivered;
        }
        self.tally.wrong += 1;
        self.tally.wrong_in_row += 1;
        Fate::Wrong
    }

    /// Counts the intact frames that begin before byte number `decided` as missed. All bytes before `decided` have an
    /// outcome, so these frames can no longer be delivered.
    fn miss(&mut self, decided: usize) {
        while let Some((bytes, at)) = self.arrived.front()
            && bytes.start < decided
        {
            if self.tally.missed_in_row == 0 {
                self.tally.since = *at;
            }
            self.tally.missed += 1;
            self.tally.missed_in_row += 1;
            self.arrived.pop_front();
        }
    }
}
