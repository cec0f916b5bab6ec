//! How a program tells a slow sender from a silent line.

/// Detects a sender whose frames are too far apart to start the actuators.
///
/// Divide the time into periods of at least twice the failsafe's `hold_after`, for example seconds. At the end of each
/// period, report the failsafe's count of [slow frames](super::Failsafe::slow_frames). One slow frame is normal after
/// a pause of the sender, so the sender is slow only if each of the last two periods had slow frames.
///
/// ```
/// use framelock::motion::Pace;
///
/// let mut pace = Pace::default();
/// pace.period_ended(1); // the first frame after a pause
/// assert!(!pace.is_slow());
/// pace.period_ended(6); // and five more in the next second
/// assert!(pace.is_slow());
/// pace.period_ended(6); // No slow frames: the line is silent, or the sender is fast enough.
/// assert!(!pace.is_slow());
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Pace {
    slow_frames: u32,
    /// Whether the last period had slow frames, and whether the period before it had.
    had_slow: [bool; 2],
}

impl Pace {
    /// Takes the failsafe's count of slow frames at the end of a period. The count may wrap.
    pub fn period_ended(&mut self, slow_frames: u32) {
        let [last, _] = self.had_slow;
        self.had_slow = [slow_frames != self.slow_frames, last];
        self.slow_frames = slow_frames;
    }

    /// Returns true if each of the last two periods had slow frames.
    #[must_use]
    pub fn is_slow(&self) -> bool {
        let [last, before] = self.had_slow;
        last && before
    }
}

#[cfg(kani)]
mod verification {
    use super::Pace;

    /// Whatever the counts are, a sender is slow exactly if the count changed in each of the last two periods.
    #[kani::proof]
    fn slow_if_both_periods_had_slow_frames() {
        let mut pace = Pace {
            slow_frames: kani::any(),
            had_slow: kani::any(),
        };
        let [first, second, third]: [u32; 3] = kani::any();
        pace.period_ended(first);
        pace.period_ended(second);
        pace.period_ended(third);
        assert_eq!(pace.is_slow(), second != first && third != second);
        kani::cover!(pace.is_slow());
        kani::cover!(!pace.is_slow());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sender_stays_slow_for_as_long_as_it_is() {
        let mut pace = Pace::default();
        let mut count = u32::MAX - 700;
        pace.period_ended(count);
        for _ in 0..1_000 {
            count = count.wrapping_add(1);
            pace.period_ended(count);
            assert!(pace.is_slow());
        }
        pace.period_ended(count);
        assert!(!pace.is_slow());
    }
}
