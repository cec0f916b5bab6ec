//! What became of each frame at a receiver, and whether the receiver is deaf.

use std::collections::VecDeque;
use std::time::Duration;

use framelock_simulation::Outcome;

use super::bytes::ByteOnLine;

/// What became of a frame at a receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fate {
    /// None was sent when one was due.
    NotSent,
    /// Its setpoint was committed with its last byte.
    Delivered,
    /// The line lost or changed some of it, and the receiver committed nothing.
    Broken,
    /// It arrived whole, and the receiver committed nothing.
    Missed,
    /// The receiver committed something else.
    Wrong,
}

impl Fate {
    /// Of a frame's bytes, at the station with that number.
    pub(super) fn of(frame: &[ByteOnLine], station: usize) -> Self {
        let mut outcomes = frame.iter().filter_map(|byte| byte.outcomes.get(station));
        if outcomes.clone().any(|outcome| *outcome == Outcome::Wrong) {
            Self::Wrong
        } else if outcomes.next_back() == Some(&Outcome::Delivered) {
            Self::Delivered
        } else if frame.iter().any(ByteOnLine::is_fault) {
            Self::Broken
        } else {
            Self::Missed
        }
    }
}

/// More than any terminal has columns.
const KEPT: usize = 1000;

/// A receiver's frames in the order they were due.
#[derive(Debug, Default)]
pub(super) struct Lane {
    fates: VecDeque<Fate>,
    /// When the first frame began that it missed since it last delivered one.
    deaf_since: Option<Duration>,
    longest_deafness: Duration,
}

impl Lane {
    /// The fate of the frame that was due at that time.
    pub(super) fn push(&mut self, due: Duration, fate: Fate) {
        if self.fates.len() == KEPT {
            self.fates.pop_front();
        }
        self.fates.push_back(fate);
        match fate {
            Fate::Missed => self.deaf_since = self.deaf_since.or(Some(due)),
            // Where nothing is sent, nothing can be missed.
            Fate::Delivered | Fate::NotSent => {
                self.longest_deafness = self.longest_deafness(due);
                self.deaf_since = None;
            }
            Fate::Broken | Fate::Wrong => {}
        }
    }

    /// The last `count`, oldest first.
    pub(super) fn last(&self, count: usize) -> impl Iterator<Item = Fate> {
        let before = self.fates.len().saturating_sub(count);
        self.fates.iter().skip(before).copied()
    }

    /// For how long it has been deaf, if it is.
    pub(super) fn deaf(&self, now: Duration) -> Option<Duration> {
        self.deaf_since.map(|since| now.saturating_sub(since))
    }

    /// The longest that it was deaf.
    pub(super) fn longest_deafness(&self, now: Duration) -> Duration {
        self.deaf(now)
            .unwrap_or_default()
            .max(self.longest_deafness)
    }
}
