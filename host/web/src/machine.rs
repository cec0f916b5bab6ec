//! A machine at the end of the line, the failsafe behind it, and what becomes of each frame.

use std::collections::VecDeque;
use std::fmt;
use std::num::NonZeroU32;
use std::ops::Range;

use framelock::lecture::Lecture;
use framelock::motion::{Failsafe, FailsafeParameters, Setpoint};
use framelock::{DiscardReason, LineEvent};
use framelock_receiving::{AnyLine, DeliveryCheck, FrameFormat, Piece, TrackedLine};
use framelock_simulation::LEVEL;
use serde::Serialize;

/// Times in milliseconds: three frames of silence, eight, and a second from end to end.
const FAILSAFE: FailsafeParameters<u8, 3> = FailsafeParameters {
    hold_after: 300,
    ramp_after: 800,
    park: [LEVEL.pitch, LEVEL.roll, LEVEL.yaw],
    ticks_per_unit: [NonZeroU32::new(4).expect("4 is not 0"); 3],
};

/// What has become of frames.
#[derive(Clone, Default, Serialize)]
pub(crate) struct Tally {
    /// Arrived whole, and were delivered.
    pub(crate) delivered: usize,
    /// Arrived whole, and were not delivered.
    missed: usize,
    /// Were given out, but are none that arrived whole.
    pub(crate) wrong: usize,
    /// Missed, and wrong, since the last that was delivered.
    pub(crate) missed_in_row: usize,
    pub(crate) wrong_in_row: usize,
    /// When the first of the row was missed.
    pub(crate) since: u32,
}

#[derive(Clone)]
pub(crate) struct Machine {
    pub(crate) line: TrackedLine,
    setpoints: Option<FrameFormat>,
    pub(crate) failsafe: Failsafe<u8, 3>,
    /// The frame given out last.
    pub(crate) frame: Vec<u8>,
    /// Where on the line the pending bytes are.
    places: VecDeque<usize>,
    /// What the last step has decided about bytes, by their places.
    pub(crate) fates: Vec<(usize, Fate)>,
    pub(crate) tally: Tally,
    /// When each frame that may yet be delivered arrived whole.
    check: DeliveryCheck<u32>,
}

/// What became of a byte.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fate {
    /// It is in a frame that was sent.
    Committed,
    /// It is in a frame that nobody sent.
    Wrong,
    /// It is in no frame.
    Discarded(DiscardReason),
}

impl fmt::Display for Fate {
    /// Writes what the page calls it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Committed => f.write_str("committed"),
            Self::Wrong => f.write_str("wrong"),
            Self::Discarded(why) => why.fmt(f),
        }
    }
}

impl Machine {
    pub(crate) fn new(line: AnyLine, setpoints: Option<FrameFormat>) -> Self {
        Self {
            line: TrackedLine::new(line),
            setpoints,
            failsafe: Failsafe::new(FAILSAFE, 0).expect("its times are in order"),
            frame: Vec::new(),
            places: VecDeque::new(),
            fates: Vec::new(),
            tally: Tally::default(),
            check: DeliveryCheck::default(),
        }
    }

    /// Takes the byte in that place. `whole`: the length of the frame that has arrived whole with it.
    pub(crate) fn push(&mut self, place: usize, byte: u8, at: u32, whole: Option<usize>) {
        self.places.push_back(place);
        if let Some(length) = whole {
            let end = self.line.decided() + self.line.pending().len() + 1;
            self.check.arrived(end.saturating_sub(length)..end, at);
        }
        let pieces = self.line.push(byte);
        self.decided(pieces, at);
    }

    /// The line is idle at that time.
    pub(crate) fn idle(&mut self, at: u32) {
        let pieces = self.line.line_event(LineEvent::Idle);
        self.decided(pieces, at);
    }

    /// The setpoint given out last.
    pub(crate) fn setpoint(&self) -> Option<Setpoint> {
        self.setpoints?.setpoint(&self.frame)
    }

    /// What the lecture's machine has stored, if this is that machine.
    pub(crate) fn lecture(&self) -> Option<&Lecture> {
        self.line.line().lecture()
    }

    fn decided(&mut self, pieces: Vec<Piece>, at: u32) {
        for piece in pieces {
            let Piece {
                from,
                bytes,
                discarded,
            } = piece;
            let count = bytes.len();
            let fate = if let Some(why) = discarded {
                Fate::Discarded(why)
            } else {
                self.frame = bytes;
                if let Some(setpoint) = self.setpoint() {
                    self.failsafe.frame(at, setpoint);
                }
                self.given_out(from..from + count)
            };
            let places = self.places.drain(..count.min(self.places.len()));
            self.fates.extend(places.map(|place| (place, fate)));
        }
        self.miss(self.line.decided());
    }

    /// These bytes are given out as a frame.
    fn given_out(&mut self, bytes: Range<usize>) -> Fate {
        self.miss(bytes.start);
        if self.check.delivered(&bytes).is_some() {
            self.tally.delivered += 1;
            (self.tally.missed_in_row, self.tally.wrong_in_row) = (0, 0);
            return Fate::Committed;
        }
        self.tally.wrong += 1;
        self.tally.wrong_in_row += 1;
        Fate::Wrong
    }

    /// Frames that begin before that byte can no longer be delivered.
    fn miss(&mut self, decided: usize) {
        while let Some(at) = self.check.missed(decided) {
            self.tally.missed += 1;
            self.tally.missed_in_row += 1;
            if self.tally.missed_in_row == 1 {
                self.tally.since = at;
            }
        }
    }
}
