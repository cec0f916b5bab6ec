//! A machine at the end of the line, the failsafe behind it, and what becomes of each frame.

use std::collections::VecDeque;
use std::num::NonZeroU32;

use framelock::motion::{Failsafe, FailsafeParameters, Setpoint};
use framelock::{DiscardReason, Found};
use framelock_simulation::LEVEL;
use serde::Serialize;

use crate::parser::AnyLine;

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

/// A frame that arrived whole: where it begins, its length, and when it ended.
#[derive(Clone)]
struct Whole {
    place: usize,
    length: usize,
    at: u32,
}

#[derive(Clone)]
pub(crate) struct Machine {
    pub(crate) line: AnyLine,
    pub(crate) failsafe: Failsafe<u8, 3>,
    /// The frame given out last.
    pub(crate) frame: Vec<u8>,
    /// The bytes that may yet be part of a frame, and their places on the line.
    pub(crate) pending: VecDeque<(usize, u8)>,
    /// What the last step has decided about bytes, by their places.
    pub(crate) fates: Vec<(usize, &'static str)>,
    pub(crate) tally: Tally,
    /// Those that may yet be delivered.
    whole: VecDeque<Whole>,
}

impl Machine {
    pub(crate) fn new(line: AnyLine) -> Self {
        Self {
            line,
            failsafe: Failsafe::new(FAILSAFE, 0).expect("its times are in order"),
            frame: Vec::new(),
            pending: VecDeque::new(),
            fates: Vec::new(),
            tally: Tally::default(),
            whole: VecDeque::new(),
        }
    }

    /// Takes the byte in that place. `whole`: the length of the frame that has arrived whole with it.
    pub(crate) fn push(&mut self, place: usize, byte: u8, at: u32, whole: Option<usize>) {
        self.pending.push_back((place, byte));
        self.whole.extend(whole.map(|length| {
            let place = place + 1 - length;
            Whole { place, length, at }
        }));
        let found = self.line.feed(&[byte]);
        self.decided(found, at);
    }

    /// The line is idle at that time.
    pub(crate) fn idle(&mut self, at: u32) {
        let found = self.line.idle();
        self.decided(found, at);
    }

    /// The setpoint given out last.
    pub(crate) fn setpoint(&self) -> Option<Setpoint> {
        match (&self.line, &self.frame[..]) {
            (AnyLine::Described(_), _) => None,
            (_, &[_, _, _, pitch, roll, yaw, ..]) => Some(Setpoint { pitch, roll, yaw }),
            _ => None,
        }
    }

    fn decided(&mut self, all: Vec<Found<()>>, at: u32) {
        for found in all {
            let fate = match found {
                Found::Discarded { why, .. } => reason(why),
                Found::Frame { length, .. } => {
                    let bytes = self.pending.iter().map(|(_, byte)| *byte);
                    self.frame = bytes.take(length).collect();
                    if let Some(setpoint) = self.setpoint() {
                        self.failsafe.frame(at, setpoint);
                    }
                    self.given_out(length)
                }
            };
            let settled = self.pending.drain(..found.bytes().min(self.pending.len()));
            self.fates.extend(settled.map(|(place, _)| (place, fate)));
        }
        self.miss();
    }

    /// The first of the pending bytes are a frame.
    fn given_out(&mut self, length: usize) -> &'static str {
        self.miss();
        let first = self.pending.front().map(|(place, _)| (*place, length));
        let whole = self.whole.front().map(|whole| (whole.place, whole.length));
        if first == whole {
            self.whole.pop_front();
            self.tally.delivered += 1;
            (self.tally.missed_in_row, self.tally.wrong_in_row) = (0, 0);
            return "committed";
        }
        self.tally.wrong += 1;
        self.tally.wrong_in_row += 1;
        "wrong"
    }

    /// Frames that begin before the pending bytes can no longer be delivered.
    fn miss(&mut self) {
        let from = self.pending.front().map_or(usize::MAX, |(place, _)| *place);
        while self.whole.front().is_some_and(|whole| whole.place < from)
            && let Some(Whole { at, .. }) = self.whole.pop_front()
        {
            self.tally.missed += 1;
            self.tally.missed_in_row += 1;
            if self.tally.missed_in_row == 1 {
                self.tally.since = at;
            }
        }
    }
}

/// Why bytes are in no frame.
fn reason(why: DiscardReason) -> &'static str {
    match why {
        DiscardReason::NoSync => "no sync",
        DiscardReason::BrokenSync => "broken sync",
        DiscardReason::Header => "wrong header",
        DiscardReason::TooLong => "too long",
        DiscardReason::UnknownMessage => "unknown message",
        DiscardReason::Terminator => "wrong terminator",
        DiscardReason::Check => "check failed",
        DiscardReason::LineEvent => "idle line",
        _ => "other",
    }
}
