//! The whole demonstration in virtual time: nothing in here waits, draws or prints.

use std::collections::VecDeque;
use std::time::Duration;

use framelock::{Bin, FailsafeError, Format, Lecture, Receiver, Setpoint};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::recent::{ByteOnLine, Recent};
use super::script::{MotionPc, Passage, Script};
use super::station::{Outcome, Report, Station, failsafe_parameters};
use crate::faulty_line::FaultyLine;
use crate::line_rate::BITS_PER_BYTE;

/// What is asked for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Plan {
    pub(super) seed: u64,
    pub(super) seconds: u32,
    /// The probability that a byte is lost.
    pub(super) drop: f64,
    /// The probability that one bit of a byte is inverted.
    pub(super) flip: f64,
    pub(super) baud: u32,
    /// Frames in a second. They fit: see [`crate::line_rate`].
    pub(super) rate: u32,
    /// After so many byte times without a byte, the frame under way is dropped.
    pub(super) idle_gap: Option<u32>,
}

pub(super) const FRAME_LENGTH: usize = 7;

const NANOSECONDS: u64 = 1_000_000_000;

/// A point of the recent past: when, and the pitch that was demanded and put out.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Sample {
    pub(super) at: Duration,
    pub(super) sent: Option<u8>,
    pub(super) discard: u8,
    pub(super) rescan: u8,
}

/// How far apart samples are, and how many are kept: the last ten seconds.
const SAMPLE_EVERY: Duration = Duration::from_millis(100);
const SAMPLES: usize = 100;

/// A motion PC, a line, and a station for each policy at its end.
#[derive(Debug)]
pub(super) struct Simulation {
    plan: Plan,
    script: Script,
    motion_pc: MotionPc,
    line: FaultyLine,
    discard: Station<Lecture>,
    rescan: Station<Receiver<Bin>>,

    now: Duration,
    slot: u64,
    /// The next byte of the frame that is being sent; 0 if that is yet to begin.
    place: usize,
    frame: SentFrame,
    byte_at: Duration,
    is_idle: bool,

    sent: u64,
    broken: u64,
    last_sent: Option<Setpoint>,
    sent_at: Duration,
    longest_pause: Duration,
    recent: Recent,
    samples: VecDeque<Sample>,
}

/// A frame on its way.
#[derive(Debug, Default)]
struct SentFrame {
    setpoint: Setpoint,
    bytes: [u8; FRAME_LENGTH],
    /// Whether every byte so far has arrived as it was sent.
    is_whole: bool,
}

impl Simulation {
    pub(super) fn new(plan: Plan) -> Result<Self, FailsafeError> {
        // Streams of their own, so that the rates of the faults do not change the motion.
        let random = |stream| {
            let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
            random.set_stream(stream);
            random
        };
        let script = Script {
            slots: u64::from(plan.seconds) * u64::from(plan.rate),
        };
        let parameters = failsafe_parameters(Duration::from_secs(1) / plan.rate);
        Ok(Self {
            plan,
            script,
            motion_pc: MotionPc::new(script, random(0), plan.rate),
            line: FaultyLine::new(random(1), plan.drop, plan.flip),
            discard: Station::new(Lecture::new(), parameters)?,
            rescan: Station::new(Receiver::new(), parameters)?,
            now: Duration::ZERO,
            slot: 0,
            place: 0,
            frame: SentFrame::default(),
            byte_at: Duration::ZERO,
            is_idle: true,
            sent: 0,
            broken: 0,
            last_sent: None,
            sent_at: Duration::ZERO,
            longest_pause: Duration::ZERO,
            recent: Recent::default(),
            samples: VecDeque::new(),
        })
    }

    /// Goes on to `time`, or to the end. What comes of it does not depend on the steps taken.
    pub(super) fn advance_to(&mut self, time: Duration) {
        while self.slot < self.script.slots {
            let is_sent = self.script.passage(self.slot).0.is_sent();
            let next = if is_sent {
                self.slot_begin() + self.byte_times(self.place as u64 + 1)
            } else {
                self.slot_begin()
            };
            if next > time {
                break;
            }
            self.now = next;
            if self.place == 0 {
                self.begin_slot();
            }
            if is_sent {
                self.send_byte();
            } else {
                self.slot += 1;
            }
        }
        self.now = self.now.max(time.min(self.end()));
        self.poll();
        self.longest_pause = self
            .longest_pause
            .max(self.now.saturating_sub(self.sent_at));
    }

    fn slot_begin(&self) -> Duration {
        Duration::from_nanos(self.slot * NANOSECONDS / u64::from(self.plan.rate))
    }

    fn byte_times(&self, count: u64) -> Duration {
        Duration::from_nanos(count * BITS_PER_BYTE * NANOSECONDS / u64::from(self.plan.baud))
    }

    /// The next frame is due, whether it is sent or not.
    fn begin_slot(&mut self) {
        self.poll();
        let setpoint = self.motion_pc.setpoint(self.slot);
        self.frame = SentFrame {
            setpoint,
            bytes: Bin::encode(setpoint),
            is_whole: true,
        };
        let is_due = self
            .samples
            .back()
            .is_none_or(|last| self.now >= last.at + SAMPLE_EVERY);
        if is_due {
            if self.samples.len() == SAMPLES {
                self.samples.pop_front();
            }
            let [discard, rescan] = self.reports().map(|report| report.output.setpoint.pitch);
            self.samples.push_back(Sample {
                at: self.now,
                sent: self.last_sent.map(|setpoint| setpoint.pitch),
                discard,
                rescan,
            });
        }
    }

    fn send_byte(&mut self) {
        let Some(&sent) = self.frame.bytes.get(self.place) else {
            return;
        };
        let received = self.carry(sent);
        self.frame.is_whole &= received == Some(sent);
        let is_last = self.place + 1 == FRAME_LENGTH;
        let ended = is_last.then_some(self.frame.setpoint);

        let (mut discard, mut rescan) = (None, None);
        if let Some(byte) = received {
            self.notice_idle_gap();
            discard = Some(self.discard.push(self.now, byte, ended));
            rescan = Some(self.rescan.push(self.now, byte, ended));
            self.byte_at = self.now;
            self.is_idle = false;
        }
        let byte = ByteOnLine {
            sent,
            place: self.place,
            received,
            discard,
            rescan,
        };
        self.recent.push(self.now, byte);

        self.place += 1;
        if is_last {
            let is_whole = self.frame.is_whole;
            self.sent += 1;
            self.broken += u64::from(!is_whole);
            self.discard.sent(discard == Some(Outcome::Right), is_whole);
            self.rescan.sent(rescan == Some(Outcome::Right), is_whole);
            self.last_sent = ended;
            self.longest_pause = self
                .longest_pause
                .max(self.now.saturating_sub(self.sent_at));
            self.sent_at = self.now;
            self.place = 0;
            self.slot += 1;
        }
    }

    /// The byte as it arrives: with the line's faults in motion, with one loss while parked.
    fn carry(&mut self, byte: u8) -> Option<u8> {
        match self.script.passage(self.slot).0 {
            Passage::Motion => self.line.carry(byte),
            Passage::Parked
                if self.place == 0
                    && self.line.drops()
                    && self.script.loses_first_byte(self.slot) =>
            {
                None
            }
            _ => Some(byte),
        }
    }

    fn poll(&mut self) {
        self.notice_idle_gap();
        self.discard.poll(self.now);
        self.rescan.poll(self.now);
    }

    fn notice_idle_gap(&mut self) {
        let Some(gap) = self.plan.idle_gap else {
            return;
        };
        // The byte that ends the gap takes one byte time to come in.
        let longest = self.byte_times(u64::from(gap) + 1);
        if !self.is_idle && self.now > self.byte_at + longest {
            self.discard.idle();
            self.rescan.idle();
            self.is_idle = true;
        }
    }

    pub(super) fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The virtual time.
    pub(super) fn now(&self) -> Duration {
        self.now
    }

    pub(super) fn end(&self) -> Duration {
        Duration::from_secs(self.plan.seconds.into())
    }

    pub(super) fn is_over(&self) -> bool {
        self.now >= self.end()
    }

    /// What is going on: the passage of the frame sent last, or of the one under way.
    pub(super) fn passage(&self) -> Passage {
        let slot = if self.place == 0 {
            self.slot.saturating_sub(1)
        } else {
            self.slot
        };
        self.script.passage(slot).0
    }

    /// Of the lecture's machine and of the receiver.
    pub(super) fn reports(&self) -> [Report; 2] {
        [self.discard.report(), self.rescan.report()]
    }

    /// Frames sent to their end.
    pub(super) fn sent(&self) -> u64 {
        self.sent
    }

    /// Those of them that did not arrive whole.
    pub(super) fn broken(&self) -> u64 {
        self.broken
    }

    /// The longest time between the ends of two frames sent: nobody's silence can be shorter.
    pub(super) fn longest_pause(&self) -> Duration {
        self.longest_pause
    }

    /// The setpoint sent last.
    pub(super) fn last_sent(&self) -> Option<Setpoint> {
        self.last_sent
    }

    pub(super) fn recent(&self) -> &Recent {
        &self.recent
    }

    pub(super) fn samples(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter()
    }
}

#[cfg(test)]
pub(super) mod tests;
