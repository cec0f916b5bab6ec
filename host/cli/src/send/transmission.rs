//! Sends each frame when it is due, and parks after the last frame. Every deadline counts from the start, so lateness
//! never adds up.

use std::io::{self, Write};
use std::num::NonZeroU32;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use framelock::motion::Setpoint;
use framelock_receiving::Protocol;
use framelock_simulation::{LEVEL, between};

use super::source::Source;
use crate::options::whole;

/// The number of frames with the park setpoint. Repetitions help if the line loses frames.
const PARK_FRAMES: u32 = 5;

/// Sends frames of one format, and counts them.
pub(super) struct Transmission<'a, C, W> {
    pub(super) pacer: Pacer<C>,
    line: &'a mut W,
    frame: &'a Protocol,
    rate: Rate,
    last: Option<Setpoint>,
    /// The number of frames, without the parking frames.
    pub(super) frames: u64,
    /// The number of due times at which there was nothing to send.
    pub(super) silent: u64,
    pub(super) park_frames: u64,
}

impl<'a, C: Clock, W: Write> Transmission<'a, C, W> {
    pub(super) fn new(clock: C, line: &'a mut W, frame: &'a Protocol, rate: Rate) -> Self {
        Self {
            pacer: Pacer::new(clock),
            line,
            frame,
            rate,
            last: None,
            frames: 0,
            silent: 0,
            park_frames: 0,
        }
    }

    /// Sends the frames of `source` for at most `length`, or until there is a reason to stop, and then parks if wanted.
    pub(super) fn run(
        &mut self,
        source: &Source,
        length: Option<Duration>,
        parks: bool,
    ) -> io::Result<()> {
        for number in (0..).take_while(|number| !source.is_over(*number)) {
            let due = self.rate.due(number);
            if length.is_some_and(|length| due >= length) || !self.pacer.wait_until(due) {
                break;
            }
            let Some(bytes) = source.frame(number, due, self.frame) else {
                self.silent += 1;
                continue;
            };
            self.last = self.frame.setpoint(&bytes);
            self.line.write_all(&bytes)?;
            self.frames += 1;
        }
        if parks {
            self.park()?;
        }
        self.line.flush()
    }

    /// Moves the axes in a straight line to the middle position, which takes a second.
    fn park(&mut self) -> io::Result<()> {
        self.pacer.restart();
        let from = self.last.unwrap_or(LEVEL);
        let way = if from == LEVEL { 0 } else { self.rate.0.get() };
        for frame in 1..=way + PARK_FRAMES {
            // The first parking frame is due one frame time after the last frame of the motion.
            self.pacer.wait_until(self.rate.due(frame.into()));
            let setpoint = if frame < way {
                between(from, LEVEL, f64::from(frame) / f64::from(way))
            } else {
                LEVEL
            };
            self.line.write_all(&self.frame.encode_setpoint(setpoint))?;
            self.park_frames += 1;
        }
        Ok(())
    }
}

/// If a frame is late by at most this time, the next frames are sent sooner to catch up. If a frame is later than that,
/// the process or the line was held up. All later deadlines are then postponed, so that the motion does not rush.
const MOST_MADE_UP: Duration = Duration::from_millis(250);

/// A number of frames per second.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Rate(pub(super) NonZeroU32);

impl Rate {
    /// Parses a rate of 1 to 100 000 frames per second.
    pub(super) fn parse(text: &str) -> anyhow::Result<Self> {
        let rate = whole::<u32>(text, 1, 100_000)?;
        Ok(Self(NonZeroU32::new(rate).expect("at least 1")))
    }

    /// Returns the due time of a frame, rounded down to a nanosecond. The error does not grow with `number`.
    pub(super) fn due(self, number: u64) -> Duration {
        let rate = self.0.get();
        let (seconds, frames) = (number / u64::from(rate), number % u64::from(rate));
        Duration::from_secs(seconds) + Duration::from_secs(frames) / rate
    }
}

/// A clock that can wait until a given time.
pub(super) trait Clock {
    /// Returns the time since an arbitrary start.
    fn now(&self) -> Duration;

    /// Waits until `time` and returns true, or returns false as soon as there is a reason to stop.
    fn wait_until(&mut self, time: Duration) -> bool;
}

/// Waits for deadlines, and measures the lateness.
pub(super) struct Pacer<C> {
    pub(super) clock: C,
    /// The clock's time from which due times are counted. Postponing the deadlines increases it.
    start: Duration,
    /// The largest lateness of a frame.
    pub(super) worst: Duration,
    /// The number of times that all deadlines were postponed. `held_up` is the total time by which they were postponed.
    pub(super) hold_ups: u32,
    pub(super) held_up: Duration,
}

impl<C: Clock> Pacer<C> {
    /// Makes a pacer whose time starts now.
    pub(super) fn new(clock: C) -> Self {
        Self {
            start: clock.now(),
            clock,
            worst: Duration::ZERO,
            hold_ups: 0,
            held_up: Duration::ZERO,
        }
    }

    /// Counts due times from now on.
    pub(super) fn restart(&mut self) {
        self.start = self.clock.now();
    }

    /// Waits until `due` after the start. Returns false if there is a reason to stop.
    pub(super) fn wait_until(&mut self, due: Duration) -> bool {
        let deadline = self.start + due;
        if !self.clock.wait_until(deadline) {
            return false;
        }
        let late = self.clock.now().saturating_sub(deadline);
        if late > MOST_MADE_UP {
            self.start += late;
            self.hold_ups += 1;
            self.held_up += late;
        } else {
            self.worst = self.worst.max(late);
        }
        true
    }
}

/// The computer's clock. A message on its channel is a reason to stop.
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

    /// Waits, but returns false as soon as the first message arrives. Later waits belong to the parking, and further
    /// messages do not stop the parking.
    fn wait_until(&mut self, time: Duration) -> bool {
        let left = time.saturating_sub(self.now());
        if self.is_stopped {
            std::thread::sleep(left);
            return true;
        }
        self.is_stopped = self.stop.recv_timeout(left) != Err(RecvTimeoutError::Timeout);
        !self.is_stopped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clock that never really waits. The test chooses how late each wait ends.
    struct TestClock {
        now: Duration,
        /// The lateness of each wait, in order. Further waits are on time.
        late: std::collections::VecDeque<Duration>,
        waits: Vec<Duration>,
    }

    impl Clock for &mut TestClock {
        fn now(&self) -> Duration {
            self.now
        }

        fn wait_until(&mut self, time: Duration) -> bool {
            self.waits.push(time);
            self.now = self.now.max(time) + self.late.pop_front().unwrap_or(Duration::ZERO);
            true
        }
    }

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn deadlines_do_not_drift() {
        for rate in [1, 3, 50, 60, 7_919, 100_000] {
            let paced = Rate(NonZeroU32::new(rate).expect("not 0"));
            // The times go up to a thousand years.
            for seconds in [0, 1, 3_600, 31_557_600_000] {
                let first = seconds * u64::from(rate);
                assert_eq!(paced.due(first), Duration::from_secs(seconds));
                let next = paced.due(first + 1).saturating_sub(paced.due(first));
                assert_eq!(next, Duration::from_secs(1) / rate);
            }
        }
    }

    #[test]
    fn lateness_does_not_add_up_and_a_hold_up_moves_everything_back() {
        for (late, waits, worst, hold_ups) in [
            ([0, 5, 30, 0], [7, 27, 47, 67], 30, 0),
            ([0, 250, 0, 3], [7, 27, 47, 67], 250, 0),
            ([0, 10_000, 0, 0], [7, 27, 10_047, 10_067], 0, 1),
        ] {
            let mut clock = TestClock {
                now: ms(7),
                late: late.map(ms).into(),
                waits: Vec::new(),
            };
            let mut pacer = Pacer::new(&mut clock);
            for frame in 0..4 {
                assert!(pacer.wait_until(ms(20) * frame));
            }
            assert_eq!((pacer.worst, pacer.hold_ups), (ms(worst), hold_ups));
            assert_eq!(pacer.held_up, ms(10_000) * hold_ups);
            assert_eq!(clock.waits, waits.map(ms));
        }
    }

    #[test]
    fn a_reason_to_stop_ends_the_wait() {
        let (stop, stopped) = std::sync::mpsc::channel();
        let mut clock = RealClock::new(stopped);
        assert!(clock.wait_until(Duration::ZERO));
        assert_eq!(stop.send(()), Ok(()));
        // Without the message, this would wait for an hour.
        assert!(!clock.wait_until(Duration::from_secs(3600)));
        assert!(clock.wait_until(Duration::ZERO));
    }
}
