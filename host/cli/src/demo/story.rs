//! The story of the demonstration: its parts as data, and the receivers' outcomes in virtual time. Nothing in this
//! module waits, draws or prints.

use std::time::Duration;

use anyhow::Result;
use framelock::Encode as _;
use framelock::motion::{Bin, Failsafe, FailsafeParameters, Output, Setpoint};
use framelock_receiving::{AnyLine, Policy, Protocol, TrackedLine};
use framelock_simulation::{Axis, Motion, Shape};

/// The time between frames, long enough to watch each frame. Motion software sends 50 frames a second or more.
const FRAME_TIME: Duration = Duration::from_millis(100);

/// The time between polls of the failsafes.
const POLL_EVERY: Duration = Duration::from_millis(2);

/// A failsafe for frames that are 100 ms apart. Its clock counts microseconds.
const FAILSAFE: FailsafeParameters<u8, 3> = FailsafeParameters {
    hold_after: 500_000,
    ramp_after: 2_500_000,
    // An axis moves 160 units per second in an approach, and 800 when live.
    approach_travel: 1_593_750,
    live_travel: 318_750,
    ..FailsafeParameters::for_clock(1_000_000, 2_000, [0x80; 3])
};

/// A part of the story.
pub(super) struct Part {
    pub(super) heading: &'static str,
    /// A few plain sentences, in at most four lines of at most 78 columns.
    pub(super) text: &'static str,
    frames: u32,
    /// Returns the setpoint that the PC sends at this time of the story, or `None` while the PC is silent.
    setpoint: fn(Duration) -> Option<Setpoint>,
    faults: &'static [Fault],
}

/// A byte that the line loses or changes: the number of the frame in its part, the byte's index in this frame, and the
/// bits that the line inverts, or `None` if it loses the byte.
type Fault = (u32, usize, Option<u8>);

/// The setpoint at which the seat stands still. Its frame is `41 42 00 41 42 00 0D`, so the payload contains the sync
/// bytes.
const STILL: Setpoint = Setpoint {
    pitch: 0x41,
    roll: 0x42,
    yaw: 0x00,
};

/// The parts of the story, in order.
pub(super) const STORY: [Part; 5] = [
    Part {
        heading: "STANDING STILL",
        text: "A PC tells a motion seat where to be, 10 times a second, over a serial line.\n\
               Two receivers hear it: the usual state machine, from a lecture, and framelock.\n\
               The seat stands still, so one frame repeats. By chance its position holds the\n\
               bytes AB, which also start a frame.",
        frames: 20,
        setpoint: |_| Some(STILL),
        faults: &[],
    },
    Part {
        heading: "ONE LOST BYTE",
        text: "One byte was lost, and one frame with it. Since then the lecture's machine\n\
               takes the AB inside each frame for its start, finds no CR at the end, and\n\
               starts over. The line is fine again, but this receiver is deaf: its failsafe\n\
               parks the seat. framelock looks at the bytes again, and hears the next frame.",
        frames: 60,
        setpoint: |_| Some(STILL),
        faults: &[(0, 0, None)],
    },
    Part {
        heading: "A BAD LINE",
        text: "The ride begins. The position changes, so the lecture's machine finds its way\n\
               back. Now the line loses a byte here and there. framelock loses the frame that\n\
               the byte was in; the lecture's machine often misses the next one as well.\n\
               Without a checksum, no receiver notices an inverted bit in a position.",
        frames: 50,
        setpoint: |time| Some(moving(time)),
        faults: &[
            (4, 2, None),
            (11, 6, None),
            (18, 4, Some(0x20)),
            (25, 5, None),
            (32, 6, Some(0x01)),
            (39, 3, None),
            (46, 0, None),
        ],
    },
    Part {
        heading: "SILENCE",
        text: "The PC sends nothing, so no frame can arrive. After each receiver comes\n\
               framelock's failsafe: it holds the seat in its place, then moves it slowly to\n\
               the middle and parks it there.",
        frames: 40,
        setpoint: |_| None,
        faults: &[],
    },
    Part {
        heading: "BACK AGAIN",
        text: "Frames arrive again. The failsafe moves the seat slowly to the position that\n\
               the PC sends, then lets it follow.",
        frames: 30,
        setpoint: |time| Some(moving(time)),
        faults: &[(8, 4, None), (15, 6, None)],
    },
];

/// The length of the story: the sum of the lengths of its parts.
pub(super) const END: Duration = Duration::from_secs(20);

impl Part {
    pub(super) const fn length(&self) -> Duration {
        FRAME_TIME.saturating_mul(self.frames)
    }

    /// Returns the bytes of a frame as they arrive; `None` for a byte that the line loses.
    fn carry(&self, frame: u32, sent: [u8; 7]) -> [Option<u8>; 7] {
        let mut received = sent.map(Some);
        for &(faulty, place, inverted) in self.faults {
            if faulty == frame {
                received[place] = inverted.map(|bits| sent[place] ^ bits);
            }
        }
        received
    }
}

/// Returns the setpoint of a moving seat.
fn moving(time: Duration) -> Setpoint {
    let motion = Motion {
        shape: Shape::FigureOfEight,
        amplitude: 80,
        axes: vec![Axis::Pitch, Axis::Roll],
    };
    motion.at(time)
}

/// The outcome of a sent frame at a receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Fate {
    /// The receiver delivered the frame's setpoint with the frame's last byte.
    Delivered,
    /// The frame arrived whole, but the receiver delivered nothing.
    Missed,
    /// The line lost or changed a byte, and the receiver delivered nothing.
    Broken,
    /// The receiver delivered another setpoint.
    Wrong,
}

/// The effect of one byte on a receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outcome {
    /// The receiver delivered nothing. It now holds this many bytes of a possible frame.
    Pending(usize),
    /// The receiver delivered the frame's setpoint.
    Delivered,
    /// The receiver delivered another setpoint.
    Wrong,
}

/// One byte on the line, and its outcome at each receiver; no outcomes if the byte was lost.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct ByteOnLine {
    pub(super) sent: u8,
    pub(super) received: Option<u8>,
    pub(super) outcomes: Vec<Outcome>,
}

/// A receiver, followed by a failsafe.
pub(super) struct Station {
    pub(super) name: &'static str,
    line: TrackedLine,
    failsafe: Failsafe<u8, 3>,
    /// The failsafe's output at the last poll.
    pub(super) output: Output<u8, 3>,
    /// The outcomes of the frames; `None` for a time at which the PC sent no frame.
    pub(super) fates: Vec<Option<Fate>>,
    /// The time of the first frame that the receiver has missed since its last delivery or the last silence.
    deaf_since: Option<Duration>,
    longest_deafness: Duration,
}

impl Station {
    fn new(name: &'static str, bin: &Protocol, policy: Policy) -> Result<Self> {
        let mut failsafe = Failsafe::new(FAILSAFE, 0)?;
        Ok(Self {
            name,
            line: TrackedLine::new(AnyLine::new(bin, policy)?),
            output: failsafe.poll(0),
            failsafe,
            fates: Vec::new(),
            deaf_since: None,
            longest_deafness: Duration::ZERO,
        })
    }

    /// Takes a byte of the frame with this setpoint.
    fn push(&mut self, bin: &Protocol, byte: u8, setpoint: Setpoint) -> Outcome {
        let pieces = self.line.push(byte);
        let mut frames = pieces.iter().filter(|piece| piece.discarded.is_none());
        match frames.find_map(|frame| bin.setpoint(&frame.bytes)) {
            None => Outcome::Pending(self.line.pending().len()),
            Some(delivered) => {
                self.failsafe.frame(delivered);
                if delivered == setpoint {
                    Outcome::Delivered
                } else {
                    Outcome::Wrong
                }
            }
        }
    }

    /// Records the outcome of the frame that was sent at this time, or `None` if no frame was sent.
    fn record(&mut self, time: Duration, fate: Option<Fate>) {
        match fate {
            Some(Fate::Missed) => self.deaf_since = self.deaf_since.or(Some(time)),
            // While nothing is sent, no frame can be missed.
            Some(Fate::Delivered) | None => {
                self.longest_deafness = self.longest_deafness(time);
                self.deaf_since = None;
            }
            Some(Fate::Broken | Fate::Wrong) => {}
        }
        self.fates.push(fate);
    }

    /// Returns the number of frames with this outcome.
    pub(super) fn count(&self, fate: Fate) -> usize {
        let fates = self.fates.iter();
        fates.filter(|each| **each == Some(fate)).count()
    }

    /// Returns the time since the receiver became deaf, or `None` if the receiver is not deaf.
    pub(super) fn deaf_for(&self, now: Duration) -> Option<Duration> {
        self.deaf_since.map(|since| now.saturating_sub(since))
    }

    /// Returns the longest time during which the receiver was deaf.
    pub(super) fn longest_deafness(&self, now: Duration) -> Duration {
        self.longest_deafness
            .max(self.deaf_for(now).unwrap_or(Duration::ZERO))
    }
}

/// The story up to a point in time.
pub(super) struct Story {
    pub(super) time: Duration,
    bin: Protocol,
    /// The last setpoint that was sent.
    pub(super) setpoint: Option<Setpoint>,
    /// The lecture's machine and framelock.
    pub(super) stations: [Station; 2],
    /// The last frame with a fault and the two frames after it; before the first fault, the first three frames.
    pub(super) close_up: Vec<[ByteOnLine; 7]>,
}

impl Story {
    pub(super) fn new() -> Result<Self> {
        let bin = Protocol::named("bin")?;
        Ok(Self {
            time: Duration::ZERO,
            setpoint: None,
            stations: [
                Station::new("the lecture's machine", &bin, Policy::Lecture)?,
                Station::new("framelock", &bin, Policy::Framelock)?,
            ],
            close_up: Vec::new(),
            bin,
        })
    }

    /// Advances to `time`, or to the end. The results do not depend on the number of calls.
    pub(super) fn advance_to(&mut self, time: Duration) {
        while self.time + POLL_EVERY <= time.min(END) {
            if self.time.as_millis().is_multiple_of(FRAME_TIME.as_millis()) {
                self.send_frame();
            }
            self.time += POLL_EVERY;
            let ticks = u32::try_from(self.time.as_micros()).expect("the story is short");
            for station in &mut self.stations {
                station.output = station.failsafe.poll(ticks);
            }
        }
    }

    /// Returns the current part.
    pub(super) fn part(&self) -> &'static Part {
        let last = self.time.saturating_sub(POLL_EVERY);
        part_at(last).0
    }

    /// Sends the frame that is due now, unless the PC is silent.
    fn send_frame(&mut self) {
        let (part, frame) = part_at(self.time);
        let Some(setpoint) = (part.setpoint)(self.time) else {
            let stations = self.stations.iter_mut();
            return stations.for_each(|station| station.record(self.time, None));
        };
        self.setpoint = Some(setpoint);
        let sent = Bin::encode(setpoint);
        let received = part.carry(frame, sent);
        let is_whole = received == sent.map(Some);
        let bytes = std::array::from_fn(|place| ByteOnLine {
            sent: sent[place],
            received: received[place],
            outcomes: received[place].map_or(Vec::new(), |byte| {
                let stations = self.stations.iter_mut();
                let push = |station: &mut Station| station.push(&self.bin, byte, setpoint);
                stations.map(push).collect()
            }),
        });
        for (index, station) in self.stations.iter_mut().enumerate() {
            let outcomes = bytes.iter().map(|byte| byte.outcomes.get(index));
            let has = |outcome| outcomes.clone().any(|one| one == Some(&outcome));
            let fate = match is_whole {
                _ if has(Outcome::Wrong) => Fate::Wrong,
                _ if has(Outcome::Delivered) => Fate::Delivered,
                true => Fate::Missed,
                false => Fate::Broken,
            };
            station.record(self.time, Some(fate));
        }
        if self.close_up.len() == 3 && !is_whole {
            self.close_up.clear();
        }
        if self.close_up.len() < 3 {
            self.close_up.push(bytes);
        }
    }
}

/// Returns the part at this time, and the number of the frame in this part.
fn part_at(time: Duration) -> (&'static Part, u32) {
    let mut begin = Duration::ZERO;
    for part in &STORY {
        let elapsed = time.saturating_sub(begin);
        if elapsed < part.length() {
            let frame = elapsed.as_millis() / FRAME_TIME.as_millis();
            return (part, u32::try_from(frame).expect("the story is short"));
        }
        begin += part.length();
    }
    unreachable!("the story is over")
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    /// Returns the story at this time.
    pub(in crate::demo) fn story_at(milliseconds: u64) -> Story {
        let mut story = Story::new().unwrap();
        story.advance_to(Duration::from_millis(milliseconds));
        story
    }

    #[test]
    fn the_parts_fit_and_end_with_the_story() {
        assert_eq!(STORY.iter().map(Part::length).sum::<Duration>(), END);
        for part in &STORY {
            let mut lines = part.text.lines();
            assert!(lines.all(|line| line.len() <= 78) && part.text.lines().count() <= 4);
            assert!(part.faults.iter().all(|(frame, ..)| *frame < part.frames));
        }
    }

    #[test]
    fn the_results_do_not_depend_on_the_steps() {
        let at_once = story_at(20_000);
        for step in [1, 33, 700, 5_000] {
            let mut story = Story::new().unwrap();
            let mut time = Duration::ZERO;
            while story.time < END {
                time += Duration::from_millis(step);
                story.advance_to(time);
            }
            for (stepped, station) in story.stations.iter().zip(&at_once.stations) {
                assert_eq!(stepped.fates, station.fates, "{step} ms");
                assert_eq!(stepped.output, station.output, "{step} ms");
            }
            assert_eq!(story.close_up, at_once.close_up);
        }
    }
}
