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
    #![allow(
        clippy::unwrap_used,
        clippy::indexing_slicing,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a panic fails the test"
    )]

    use framelock::motion::Bin;
    use framelock::{Line, Receiver};

    use super::super::source::Datagrams;
    use super::*;

    const RATE: Rate = Rate(NonZeroU32::new(50).unwrap());

    /// The pitches while parking from pitch 9: first the pitches on the way, then the pitch of the park position.
    fn parked() -> Vec<u8> {
        let way = (1..50_u16).map(|frame| (9.0 + 119.0 * f64::from(frame) / 50.0).round() as u8);
        way.chain([128; 6]).collect()
    }

    /// Returns a source of ten frames with the pitches 0 to 9.
    fn ten() -> Source {
        let bin = Protocol::named("bin").unwrap();
        let frame = |pitch| bin.encode_setpoint([pitch, 128, 128].into());
        Source::Profile((0..10).map(frame).collect())
    }

    /// Returns the pitches that a receiver delivers, and the numbers of moving, silent and parking frames. The receiver
    /// discards nothing.
    fn run(
        clock: &mut TestClock,
        source: &Source,
        milliseconds: Option<u64>,
        parks: bool,
    ) -> (Vec<u8>, [u64; 3]) {
        let (mut bytes, frame) = (Vec::new(), Protocol::named("bin").unwrap());
        let mut transmission = Transmission::new(clock, &mut bytes, &frame, RATE);
        let length = milliseconds.map(Duration::from_millis);
        transmission.run(source, length, parks).unwrap();
        let Transmission {
            frames,
            silent,
            park_frames,
            ..
        } = transmission;
        let mut pitches = Vec::new();
        let mut line = Line::new(Receiver::<Bin>::new());
        line.feed(&bytes, |found| {
            let setpoint = found.message().unwrap();
            assert_eq!((setpoint.roll, setpoint.yaw), (128, 128));
            pitches.push(setpoint.pitch);
        });
        (pitches, [frames, silent, park_frames])
    }

    #[test]
    fn each_frame_is_sent_when_it_is_due_or_not_at_all() {
        let silent = Source::Datagrams(Datagrams::default());
        for (source, milliseconds, frames, counts) in [
            (&ten(), None, 10, [10, 0, 0]),
            // The transmission ends after its length, although the source has more frames.
            (&ten(), Some(60), 3, [3, 0, 0]),
            (&silent, Some(60), 0, [0, 3, 0]),
        ] {
            let mut clock = TestClock::default();
            let (pitches, actual) = run(&mut clock, source, milliseconds, false);
            assert_eq!(pitches, (0..frames).collect::<Vec<u8>>());
            assert_eq!(actual, counts);
            let waits = (0..counts[0] + counts[1]).map(|number| RATE.due(number));
            assert!(waits.eq(clock.waits));
        }
    }

    #[test]
    fn the_axes_park_in_a_straight_line_and_stay_there() {
        let mut clock = TestClock::default();
        let (pitches, counts) = run(&mut clock, &ten(), None, true);
        assert_eq!((pitches[9], &pitches[10..]), (9, &parked()[..]));
        assert_eq!(counts, [10, 0, 55]);
        // Parking keeps the rate of the motion.
        assert_eq!(clock.waits.last(), Some(&RATE.due(64)));
    }

    #[test]
    fn a_reason_to_stop_ends_the_motion_and_parks() {
        // Before the first frame, the position is unknown, so only the park position is sent.
        for (stop_after, park_frames) in [(4, 55), (0, 5)] {
            let mut clock = TestClock {
                stop_after: Some(stop_after),
                ..TestClock::default()
            };
            let (pitches, counts) = run(&mut clock, &ten(), None, true);
            assert_eq!(pitches[..stop_after], [0, 1, 2, 3][..stop_after]);
            assert!(pitches.ends_with(&[128; 5]));
            assert_eq!(counts, [stop_after as u64, 0, park_frames]);
        }
    }

    #[test]
    fn an_error_of_the_line_ends_the_transmission_and_keeps_the_count() {
        // The line has room for three frames.
        let (mut clock, mut bytes) = (TestClock::default(), [0; 21]);
        let (mut line, frame) = (&mut bytes[..], Protocol::named("bin").unwrap());
        let mut transmission = Transmission::new(&mut clock, &mut line, &frame, RATE);
        transmission.run(&ten(), None, true).unwrap_err();
        assert_eq!(transmission.frames, 3);
    }

    /// A clock that never really waits. The test chooses how late each wait ends.
    #[derive(Default)]
    struct TestClock {
        now: Duration,
        /// The lateness of each wait, in order. Further waits are on time.
        late: std::collections::VecDeque<Duration>,
        /// After this number of waits, the test asks to stop.
        stop_after: Option<usize>,
        waits: Vec<Duration>,
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
                ..TestClock::default()
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
