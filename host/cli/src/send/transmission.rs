//! Sends each frame when it is due, and parks after the last frame.

use std::io::{self, Write};
use std::time::Duration;

use framelock::motion::Setpoint;
use framelock_receiving::Protocol;
use framelock_simulation::between;

use super::pacer::{Clock, Pacer, Rate};
use super::source::Source;

/// The number of frames with the park setpoint. Repetitions help if the line loses frames.
const PARK_FRAMES: u32 = 5;

/// The parking at the end of a transmission.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Parking {
    pub(super) at: Setpoint,
    /// The duration of the way to the park setpoint, in seconds. With 0, the first parking frame already has the park
    /// setpoint.
    pub(super) seconds: f64,
}

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

    /// Sends the frames of `source` for at most `length`, or until there is a reason to stop, and then parks.
    pub(super) fn run(
        &mut self,
        source: &Source,
        length: Option<Duration>,
        parking: Option<Parking>,
    ) -> io::Result<()> {
        let dues = (0..).map_while(|number| Some((number, source.due(number, self.rate)?)));
        for (number, due) in dues {
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
        if let Some(parking) = parking {
            self.park(parking)?;
        }
        self.line.flush()
    }

    /// Moves the axes in a straight line to the park setpoint.
    fn park(&mut self, Parking { at, seconds }: Parking) -> io::Result<()> {
        self.pacer.restart();
        let from = self.last.unwrap_or(at);
        let way = if from == at || seconds <= 0.0 {
            0
        } else {
            self.rate.frames_in(seconds)
        };
        for frame in 1..=way.saturating_add(PARK_FRAMES) {
            // The first parking frame is due one frame time after the last frame of the motion.
            self.pacer.wait_until(self.rate.due(frame.into()));
            let setpoint = if frame < way {
                between(from, at, f64::from(frame) / f64::from(way))
            } else {
                at
            };
            self.line.write_all(&self.frame.encode_setpoint(setpoint))?;
            self.park_frames += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::indexing_slicing,
        reason = "a panic fails the test"
    )]

    use std::num::NonZeroU32;

    use framelock::motion::Bin;
    use framelock::{Line, Receiver};

    use super::super::datagrams::Datagrams;
    use super::super::pacer::tests::TestClock;
    use super::super::source::tests::profile;
    use super::*;

    const RATE: Rate = Rate(NonZeroU32::new(50).unwrap());

    const PARKING: Parking = Parking {
        at: Setpoint {
            pitch: 100,
            roll: 128,
            yaw: 128,
        },
        seconds: 0.1,
    };

    /// The pitches while parking from pitch 9: first the pitches on the way, then the pitch of the park position.
    const PARKED: [u8; 10] = [27, 45, 64, 82, 100, 100, 100, 100, 100, 100];

    /// Returns a source of ten frames with the pitches 0 to 9.
    fn ten() -> Source {
        let rows: Vec<String> = (0..10).map(|pitch| format!("{pitch},128,128\n")).collect();
        Source::Profile(profile(&rows.concat()))
    }

    /// Returns the pitches that a receiver delivers, and the numbers of moving, silent and parking frames. The receiver
    /// discards nothing.
    fn run(
        clock: &mut TestClock,
        source: &Source,
        milliseconds: Option<u64>,
        parking: Option<Parking>,
    ) -> (Vec<u8>, [u64; 3]) {
        let (mut bytes, frame) = (Vec::new(), Protocol::named("bin").unwrap());
        let mut transmission = Transmission::new(clock, &mut bytes, &frame, RATE);
        let length = milliseconds.map(Duration::from_millis);
        transmission.run(source, length, parking).unwrap();
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
            let (pitches, actual) = run(&mut clock, source, milliseconds, None);
            assert_eq!(pitches, (0..frames).collect::<Vec<u8>>());
            assert_eq!(actual, counts);
            let waits = (0..counts[0] + counts[1]).map(|number| RATE.due(number));
            assert!(waits.eq(clock.waits));
        }
    }

    #[test]
    fn the_axes_park_in_a_straight_line_and_stay_there() {
        let mut clock = TestClock::default();
        let (pitches, counts) = run(&mut clock, &ten(), None, Some(PARKING));
        assert_eq!((pitches[9], &pitches[10..]), (9, &PARKED[..]));
        assert_eq!(counts, [10, 0, 10]);
        // Parking keeps the rate of the motion.
        assert_eq!(clock.waits.last(), Some(&RATE.due(19)));
        let at_once = Parking {
            seconds: 0.0,
            ..PARKING
        };
        let (pitches, _) = run(&mut TestClock::default(), &ten(), None, Some(at_once));
        assert_eq!(pitches[10..], [100; 5]);
    }

    #[test]
    fn a_reason_to_stop_ends_the_motion_and_parks() {
        // Before the first frame, the position is unknown, so only the park position is sent.
        for (stop_after, park_frames) in [(4, 10), (0, 5)] {
            let mut clock = TestClock {
                stop_after: Some(stop_after),
                ..TestClock::default()
            };
            let (pitches, counts) = run(&mut clock, &ten(), None, Some(PARKING));
            assert_eq!(pitches[..stop_after], [0, 1, 2, 3][..stop_after]);
            assert!(pitches.ends_with(&[100; 5]));
            assert_eq!(counts, [stop_after as u64, 0, park_frames]);
        }
    }

    #[test]
    fn frames_in_returns_at_least_one_frame_and_saturates() {
        for (seconds, frames) in [(1.0, 50), (0.0, 1), (1e300, u32::MAX)] {
            assert_eq!(RATE.frames_in(seconds), frames);
        }
    }

    #[test]
    fn an_error_of_the_line_ends_the_transmission_and_keeps_the_count() {
        // The line has room for three frames.
        let (mut clock, mut bytes) = (TestClock::default(), [0; 21]);
        let (mut line, frame) = (&mut bytes[..], Protocol::named("bin").unwrap());
        let mut transmission = Transmission::new(&mut clock, &mut line, &frame, RATE);
        transmission.run(&ten(), None, Some(PARKING)).unwrap_err();
        assert_eq!(transmission.frames, 3);
    }
}
