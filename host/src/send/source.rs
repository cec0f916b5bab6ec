//! What is to be sent, and when.

use std::num::NonZeroU32;
use std::time::Duration;

use framelock::Setpoint;

use super::motion::Motion;

/// Gives frames, numbered from 0.
pub(super) trait Source {
    /// When the frame is due, counted from the first; none behind the last. Asked for each frame in
    /// turn.
    fn due(&mut self, number: u64) -> Option<Duration>;

    /// Where the axes are to be in it, asked when it is due; none if nothing is to be sent.
    fn setpoint(&mut self, number: u64, due: Duration) -> Option<Setpoint>;
}

/// Frames in a second.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Rate(pub(super) NonZeroU32);

impl Rate {
    /// When a frame is due, to the nanosecond below, however many came before.
    pub(super) fn due(self, number: u64) -> Duration {
        let rate = self.0.get();
        let (seconds, frames) = (number / u64::from(rate), number % u64::from(rate));
        Duration::from_secs(seconds) + Duration::from_secs(frames) / rate
    }

    /// How many frames so much time has room for, 1 at least.
    pub(super) fn frames_in(self, seconds: f64) -> u32 {
        let frames = (f64::from(self.0.get()) * seconds).round().max(1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at least 1, and the cast saturates"
        )]
        let frames = frames as u32;
        frames
    }
}

/// A built-in motion.
pub(super) struct PacedMotion {
    pub(super) motion: Motion,
    pub(super) rate: Rate,
}

impl Source for PacedMotion {
    fn due(&mut self, number: u64) -> Option<Duration> {
        Some(self.rate.due(number))
    }

    fn setpoint(&mut self, _number: u64, due: Duration) -> Option<Setpoint> {
        Some(self.motion.at(due))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    #[test]
    fn deadlines_do_not_drift() {
        for rate in [1, 3, 50, 60, 7_919, 100_000] {
            let paced = Rate(NonZeroU32::new(rate).unwrap());
            // A thousand years of whole seconds.
            for seconds in [0, 1, 3_600, 31_557_600_000] {
                let first = seconds * u64::from(rate);
                assert_eq!(paced.due(first), Duration::from_secs(seconds));
                let next = paced.due(first + 1).saturating_sub(paced.due(first));
                assert_eq!(next, Duration::from_secs(1) / rate);
            }
        }
    }

    #[test]
    fn a_time_has_room_for_so_many_frames() {
        let rate = Rate(NonZeroU32::new(50).unwrap());
        assert_eq!(rate.frames_in(1.0), 50);
        assert_eq!(rate.frames_in(0.0), 1);
        assert_eq!(rate.frames_in(1e300), u32::MAX);
    }
}
