//! What became of each frame at a receiver, and whether the receiver is deaf.

use std::collections::VecDeque;
use std::time::Duration;

use framelock_simulation::Fate;

/// More than any terminal has columns.
const KEPT: usize = 1000;

/// A receiver's frames in the order they were due.
#[derive(Debug, Default)]
pub(super) struct Lane {
    /// None where no frame was sent when one was due.
    fates: VecDeque<Option<Fate>>,
    /// When the first frame began that it missed since it last delivered one.
    deaf_since: Option<Duration>,
    longest_deafness: Duration,
}

impl Lane {
    /// Appends the fate of the frame that was due at that time; none if no frame was sent.
    pub(super) fn push(&mut self, due: Duration, fate: Option<Fate>) {
        if self.fates.len() == KEPT {
            self.fates.pop_front();
        }
        self.fates.push_back(fate);
        match fate {
            Some(Fate::Missed) => self.deaf_since = self.deaf_since.or(Some(due)),
            // Where nothing is sent, nothing can be missed.
            Some(Fate::Delivered) | None => {
                self.longest_deafness = self.longest_deafness(due);
                self.deaf_since = None;
            }
            Some(Fate::Broken | Fate::Wrong) => {}
        }
    }

    /// The last `count`, oldest first.
    pub(super) fn last(&self, count: usize) -> impl Iterator<Item = Option<Fate>> {
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
