//! The reason why a failsafe does not follow the sender, in words.

use framelock::motion::{Pace, Phase};

/// Distinguishes a silent sender from a sender whose frames are too far apart for the failsafe. Compares the counts of
/// frames and of slow frames at the ends of periods. A period is one second, or twice the failsafe's `hold_after` if
/// that is longer.
#[derive(Clone, Debug)]
pub struct Standstill {
    period: u32,
    /// The failsafe's `hold_after` in milliseconds, rounded down.
    hold_after_ms: u64,
    /// The beginning of the current period.
    since: u32,
    frames: u64,
    /// The count of frames at the beginning of the current period.
    frames_before: u64,
    /// Whether the last complete period had frames.
    had_frames: bool,
    pace: Pace,
}

impl Standstill {
    /// Starts at the time 0. `hold_after` is the failsafe's parameter, in ticks of the failsafe's clock.
    #[must_use]
    pub fn new(ticks_per_second: u32, hold_after: u32) -> Self {
        Self {
            period: ticks_per_second.max(hold_after.saturating_mul(2)),
            hold_after_ms: u64::from(hold_after) * 1_000 / u64::from(ticks_per_second.max(1)),
            since: 0,
            frames: 0,
            frames_before: 0,
            had_frames: false,
            pace: Pace::default(),
        }
    }

    /// Takes the time of a poll, the number of frames that the failsafe has received so far, and the failsafe's count
    /// of slow frames after the poll.
    pub fn polled(&mut self, now: u32, frames: u64, slow_frames: u32) {
        self.frames = frames;
        if now.wrapping_sub(self.since) >= self.period {
            self.had_frames = frames != self.frames_before;
            self.pace.period_ended(slow_frames);
            (self.since, self.frames_before) = (now, frames);
        }
    }

    /// Returns the reason why the actuators do not follow the sender in this phase. Returns `None` if they follow, or
    /// if too little time has passed to know the reason.
    #[must_use]
    pub fn reason(&self, phase: Phase) -> Option<String> {
        match phase {
            Phase::Live => None,
            Phase::Approach => Some("moves slowly to the setpoint".to_owned()),
            _ if self.pace.is_slow() => Some(format!(
                "frames arrive too far apart ({} ms or more)",
                self.hold_after_ms
            )),
            _ if self.had_frames || self.frames != self.frames_before => None,
            _ => Some("no frames".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use framelock::motion::{Failsafe, FailsafeParameters};

    use super::*;

    /// Returns the phase and the reason at each of these times in milliseconds. Frames arrive every `apart`
    /// milliseconds until the time `end`. If `apart` is 0, none arrive.
    fn reasons(
        hold_after: u32,
        apart: u32,
        end: u32,
        times: &[u32],
    ) -> Vec<(Phase, Option<String>)> {
        let parameters = FailsafeParameters {
            hold_after,
            ramp_after: hold_after.max(500),
            ..FailsafeParameters::for_clock(1_000, 5, [128_u8; 3])
        };
        let mut failsafe = Failsafe::new(parameters, 0).unwrap();
        let mut standstill = Standstill::new(1_000, hold_after);
        let mut frames = 0;
        let mut seen = Vec::new();
        for now in (5..=times.last().copied().unwrap()).step_by(5) {
            if apart > 0 && now < end && now.is_multiple_of(apart) {
                failsafe.frame([255; 3]);
                frames += 1;
            }
            let phase = failsafe.poll(now).phase;
            standstill.polled(now, frames, failsafe.slow_frames());
            if times.contains(&now) {
                seen.push((phase, standstill.reason(phase)));
            }
        }
        seen
    }

    const ALWAYS: u32 = u32::MAX;

    #[test]
    fn a_silent_sender_differs_from_a_slow_one_and_from_an_approach() {
        let apart = "frames arrive too far apart (100 ms or more)";
        for (per_second, phase, reason) in [
            (0, Phase::Parked, Some("no frames")),
            (1, Phase::Parked, Some(apart)),
            (5, Phase::Parked, Some(apart)),
            (10, Phase::Parked, Some(apart)),
            (20, Phase::Live, None),
            (50, Phase::Live, None),
        ] {
            let every = 1_000_u32.checked_div(per_second).unwrap_or(0);
            let seen = reasons(100, every, ALWAYS, &[4_000, 7_200, 10_050]);
            let expected = (phase, reason.map(str::to_owned));
            assert_eq!(seen, vec![expected; 3], "{per_second}");
        }
        let approach = (
            Phase::Approach,
            Some("moves slowly to the setpoint".to_owned()),
        );
        assert_eq!(reasons(100, 20, ALWAYS, &[500]), [approach]);
    }

    #[test]
    fn a_pause_is_no_slow_sender_and_the_first_seconds_claim_nothing_wrong() {
        // The sender stops after 5 s.
        let stopped = reasons(100, 20, 5_000, &[5_200, 5_700, 7_100, 9_000]);
        let no_frames = Some("no frames".to_owned());
        assert_eq!(
            stopped,
            [
                (Phase::Hold, None),
                (Phase::Ramp, None),
                (Phase::Parked, no_frames.clone()),
                (Phase::Parked, no_frames)
            ]
        );
        // A slow sender is known after two seconds.
        let slow = reasons(100, 200, ALWAYS, &[300, 1_300, 1_995]);
        assert_eq!(slow, vec![(Phase::Parked, None); 3]);
    }

    #[test]
    fn a_long_hold_time_needs_long_periods() {
        // The failsafe allows 3 s between frames. The frames come 4 s apart, or not at all.
        for (apart, reason) in [
            (4_000, "frames arrive too far apart (3000 ms or more)"),
            (0, "no frames"),
        ] {
            let seen = reasons(3_000, apart, ALWAYS, &[20_000, 23_000, 27_000]);
            let expected = (Phase::Parked, Some(reason.to_owned()));
            assert_eq!(seen, vec![expected; 3], "{apart}");
        }
    }
}
