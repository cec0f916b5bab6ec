//! The fate of each frame at a receiver, and the times during which the receiver was deaf.

use std::time::Duration;

use framelock_simulation::Fate;

/// The fates of the frames at one receiver, in the order in which the frames were due.
#[derive(Debug, Default)]
pub(super) struct Lane {
    /// The fates; `None` for a slot in which no frame was sent.
    fates: Vec<Option<Fate>>,
    /// The time of the first frame that the receiver has missed since its last delivery.
    deaf_since: Option<Duration>,
    longest_deafness: Duration,
}

impl Lane {
    /// Appends the fate of the frame that was due at this time, or `None` if no frame was sent.
    pub(super) fn push(&mut self, due: Duration, fate: Option<Fate>) {
        self.fates.push(fate);
        match fate {
            Some(Fate::Missed) => self.deaf_since = self.deaf_since.or(Some(due)),
            // While nothing is sent, no frame can be missed.
            Some(Fate::Delivered) | None => {
                self.longest_deafness = self.longest_deafness(due);
                self.deaf_since = None;
            }
            Some(Fate::Broken | Fate::Wrong) => {}
        }
    }

    /// Returns the last `count` fates, oldest first.
    pub(super) fn last(&self, count: usize) -> impl Iterator<Item = Option<Fate>> {
        let before = self.fates.len().saturating_sub(count);
        self.fates.iter().skip(before).copied()
    }

    /// Returns the time since the receiver became deaf, or `None` if the receiver is not deaf.
    pub(super) fn deaf(&self, now: Duration) -> Option<Duration> {
        self.deaf_since.map(|since| now.saturating_sub(since))
    }

    /// Returns the longest time during which the receiver was deaf.
    pub(super) fn longest_deafness(&self, now: Duration) -> Duration {
        self.deaf(now)
            .unwrap_or_default()
            .max(self.longest_deafness)
    }
}
