//! Frames on time: every deadline counts from the beginning, so lateness never adds up.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Lateness up to this is made up for, by frames that follow sooner. Beyond it the process or the
/// line was held up, and motion must not be run through in a rush: everything moves back.
const MOST_MADE_UP: Duration = Duration::from_millis(250);

/// A clock that can be waited for.
pub(super) trait Clock {
    /// Time since some beginning.
    fn now(&self) -> Duration;

    /// Waits until it is `time`, or until there is a reason to stop: then gives false.
    fn wait_until(&mut self, time: Duration) -> bool;
}

/// How well deadlines were kept.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Punctuality {
    /// The most that a frame was behind its deadline.
    pub(super) worst: Duration,
    /// How often everything was moved back, and by how much in all.
    pub(super) hold_ups: u32,
    pub(super) held_up: Duration,
}

/// Keeps the deadlines.
pub(super) struct Pacer<C> {
    clock: C,
    /// When it was made, and when the first frame was due, by the clock.
    beginning: Duration,
    start: Duration,
    punctuality: Punctuality,
}

impl<C: Clock> Pacer<C> {
    /// Time counts from now.
    pub(super) fn new(clock: C) -> Self {
        Self {
            beginning: clock.now(),
            start: clock.now(),
            clock,
            punctuality: Punctuality::default(),
        }
    }

    /// From here on time counts from now.
    pub(super) fn restart(&mut self) {
        self.start = self.clock.now();
    }

    /// Waits until so long after the beginning; gives false if there is a reason to stop.
    pub(super) fn wait_until(&mut self, due: Duration) -> bool {
        let deadline = self.start + due;
        if !self.clock.wait_until(deadline) {
            return false;
        }
        let late = self.clock.now().saturating_sub(deadline);
        if late > MOST_MADE_UP {
            self.start += late;
            self.punctuality.hold_ups += 1;
            self.punctuality.held_up += late;
        } else {
            self.punctuality.worst = self.punctuality.worst.max(late);
        }
        true
    }

    /// Since it was made.
    pub(super) fn elapsed(&self) -> Duration {
        self.clock.now().saturating_sub(self.beginning)
    }

    /// How well deadlines were kept so far.
    pub(super) fn punctuality(&self) -> Punctuality {
        self.punctuality
    }
}

/// The computer's clock; a message is a reason to stop.
pub(super) struct RealClock {
    beginning: Instant,
    stop: Receiver<()>,
    is_stopped: bool,
}

impl RealClock {
    pub(super) fn new(stop: Receiver<()>) -> Self {
        Self {
            beginning: Instant::now(),
            stop,
            is_stopped: false,
        }
    }
}

impl Clock for RealClock {
    fn now(&self) -> Duration {
        self.beginning.elapsed()
    }

    /// There is one reason to stop: what is waited for afterwards is the parking.
    fn wait_until(&mut self, time: Duration) -> bool {
        let left = time.saturating_sub(self.now());
        if self.is_stopped {
            std::thread::sleep(left);
            return true;
        }
        match self.stop.recv_timeout(left) {
            Ok(()) => {
                self.is_stopped = true;
                false
            }
            Err(RecvTimeoutError::Timeout) => true,
            Err(RecvTimeoutError::Disconnected) => {
                std::thread::sleep(time.saturating_sub(self.now()));
                true
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Is late as the test wants, and never really waits.
    #[derive(Default)]
    pub(in super::super) struct TestClock {
        pub(in super::super) now: Duration,
        /// By how much each wait is late, in turn; then none is.
        pub(in super::super) late: std::collections::VecDeque<Duration>,
        /// After so many waits there is a reason to stop.
        pub(in super::super) stop_after: Option<usize>,
        pub(in super::super) waits: Vec<Duration>,
    }

    impl Clock for &mut TestClock {
        fn now(&self) -> Duration {
            self.now
        }

        fn wait_until(&mut self, time: Duration) -> bool {
            if self.stop_after == Some(self.waits.len()) {
                self.stop_after = None;
                return false;
            }
            self.waits.push(time);
            self.now = self.now.max(time) + self.late.pop_front().unwrap_or_default();
            true
        }
    }

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn lateness_does_not_add_up() {
        let mut clock = TestClock {
            now: ms(7),
            late: [0, 5, 30, 0, 3].map(ms).into(),
            ..TestClock::default()
        };
        let mut pacer = Pacer::new(&mut clock);
        for frame in 0..6 {
            assert!(pacer.wait_until(ms(20) * frame));
        }
        let expected = Punctuality {
            worst: ms(30),
            ..Punctuality::default()
        };
        assert_eq!(pacer.punctuality(), expected);
        assert_eq!(clock.waits, [7, 27, 47, 67, 87, 107].map(ms));
    }

    #[test]
    fn a_hold_up_moves_everything_back() {
        let mut clock = TestClock {
            late: [0, 10_000, 0, 0].map(ms).into(),
            ..TestClock::default()
        };
        let mut pacer = Pacer::new(&mut clock);
        for frame in 0..4 {
            assert!(pacer.wait_until(ms(20) * frame));
        }
        let expected = Punctuality {
            worst: ms(0),
            hold_ups: 1,
            held_up: ms(10_000),
        };
        assert_eq!(pacer.punctuality(), expected);
        assert_eq!(clock.waits, [0, 20, 10_040, 10_060].map(ms));
    }

    #[test]
    fn a_reason_to_stop_ends_the_wait() {
        let (stop, stopped) = std::sync::mpsc::channel();
        let mut clock = RealClock::new(stopped);
        assert!(clock.wait_until(Duration::ZERO));
        assert_eq!(stop.send(()), Ok(()));
        // Would take an hour otherwise.
        assert!(!clock.wait_until(Duration::from_secs(3600)));
        assert!(clock.wait_until(Duration::ZERO));
    }
}
