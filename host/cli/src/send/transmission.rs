//! Sends each frame when it is due, and parks after the last frame. Deadlines count from the start, so delays of up to
//! 250 ms do not add up. A longer delay postpones all later deadlines.

use std::io::{self, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use framelock::motion::Setpoint;
use framelock_receiving::Protocol;
use framelock_simulation::{LEVEL, between};

use super::source::Source;
use crate::options::whole;
use crate::output::Output;

/// The number of frames that repeat the park setpoint at the end of the parking, in case the line loses frames.
const PARK_FRAMES: u32 = 5;

/// Sends frames of one format, and counts them.
pub(super) struct Transmission<'a> {
    pub(super) pacer: Pacer,
    line: &'a mut Output,
    frame: &'a Protocol,
    rate: Rate,
    last: Option<Setpoint>,
    /// The number of frames, without the parking frames.
    pub(super) frames: u64,
    /// The number of due times at which there was nothing to send.
    pub(super) silent: u64,
    pub(super) park_frames: u64,
}

impl<'a> Transmission<'a> {
    pub(super) fn new(
        stop: Receiver<()>,
        line: &'a mut Output,
        frame: &'a Protocol,
        rate: Rate,
    ) -> Self {
        Self {
            pacer: Pacer::new(stop),
            line,
            frame,
            rate,
            last: None,
            frames: 0,
            silent: 0,
            park_frames: 0,
        }
    }

    /// Sends the frames of `source` until the source is over, `length` has passed or the pacer is told to stop. Then
    /// parks the axes, if `parks` is true.
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

    /// Moves the axes in a straight line to the middle position within a second, and then repeats this position.
    fn park(&mut self) -> io::Result<()> {
        self.pacer.start = self.pacer.now();
        let from = self.last.unwrap_or(LEVEL);
        let way = if from == LEVEL { 0 } else { self.rate.0 };
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

/// A number of frames per second, at least 1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Rate(pub(super) u32);

impl Rate {
    /// Parses a rate of 1 to 100 000 frames per second.
    pub(super) fn parse(text: &str) -> anyhow::Result<Self> {
        Ok(Self(whole(text, 1, 100_000)?))
    }

    /// Returns the due time of a frame, rounded down to a nanosecond. The error does not grow with `number`.
    pub(super) fn due(self, number: u64) -> Duration {
        let rate = self.0;
        let (seconds, frames) = (number / u64::from(rate), number % u64::from(rate));
        Duration::from_secs(seconds) + Duration::from_secs(frames) / rate
    }
}

/// Waits for deadlines, and measures the lateness. A message on its channel stops the transmission.
pub(super) struct Pacer {
    beginning: Instant,
    /// The time from `beginning` to the moment from which due times count. Postponing the deadlines increases it.
    start: Duration,
    /// The largest lateness that was at most [`MOST_MADE_UP`]. A longer delay is a hold-up.
    pub(super) worst: Duration,
    /// The number of times that all deadlines were postponed. `held_up` is the total time by which they were postponed.
    pub(super) hold_ups: u32,
    pub(super) held_up: Duration,
    stop: Receiver<()>,
    is_stopped: bool,
}

impl Pacer {
    /// Makes a pacer whose time starts now.
    fn new(stop: Receiver<()>) -> Self {
        Self {
            beginning: Instant::now(),
            start: Duration::ZERO,
            worst: Duration::ZERO,
            hold_ups: 0,
            held_up: Duration::ZERO,
            stop,
            is_stopped: false,
        }
    }

    /// Returns the time since the beginning.
    pub(super) fn now(&self) -> Duration {
        self.beginning.elapsed()
    }

    /// Waits until `due` after the start, but returns false as soon as the first message arrives. All later waits
    /// belong to the parking, and ignore further messages.
    fn wait_until(&mut self, due: Duration) -> bool {
        let deadline = self.start + due;
        let left = deadline.saturating_sub(self.now());
        if self.is_stopped {
            std::thread::sleep(left);
        } else if self.stop.recv_timeout(left) != Err(RecvTimeoutError::Timeout) {
            self.is_stopped = true;
            return false;
        }
        self.measure(deadline, self.now());
        true
    }

    /// Measures how late the wait for a deadline ended at `now`. After a hold-up, postpones all later deadlines.
    fn measure(&mut self, deadline: Duration, now: Duration) {
        let late = now.saturating_sub(deadline);
        if late > MOST_MADE_UP {
            self.start += late;
            self.hold_ups += 1;
            self.held_up += late;
        } else {
            self.worst = self.worst.max(late);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn deadlines_do_not_drift() {
        for rate in [1, 3, 50, 60, 7_919, 100_000] {
            let paced = Rate(rate);
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
            let mut pacer = Pacer::new(channel().1);
            pacer.start = ms(7);
            let (mut now, mut deadlines) = (ms(7), Vec::new());
            for (late, due) in late.map(ms).into_iter().zip([0, 20, 40, 60]) {
                let deadline = pacer.start + ms(due);
                deadlines.push(deadline);
                now = now.max(deadline) + late;
                pacer.measure(deadline, now);
            }
            assert_eq!((pacer.worst, pacer.hold_ups), (ms(worst), hold_ups));
            assert_eq!(pacer.held_up, ms(10_000) * hold_ups);
            assert_eq!(deadlines, waits.map(ms));
        }
    }

    #[test]
    fn a_reason_to_stop_ends_the_wait() {
        let (stop, stopped) = channel();
        let mut pacer = Pacer::new(stopped);
        assert!(pacer.wait_until(Duration::ZERO));
        assert_eq!(stop.send(()), Ok(()));
        // Without the message, this call would wait for an hour.
        assert!(!pacer.wait_until(Duration::from_secs(3600)));
        assert!(pacer.wait_until(Duration::ZERO));
    }
}
