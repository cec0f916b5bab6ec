//! Runs the demonstration in virtual time. Nothing in this module waits, draws or prints.

use std::time::Duration;

use anyhow::Result;
use framelock::motion::{Output, Setpoint};
use framelock_simulation::{
    Event, FaultRates, FrameFormat, LineTally, Origin, Parameters, Policy, ReceiverTally, Seed,
    SmoothMotion, StationKind, Transmission, Trial, check_rate,
};

use super::Arguments;
use super::bytes::{ByteOnLine, Bytes};
use super::lane::Lane;
use super::script::{Passage, Script};

/// The number of bytes in a frame.
const FRAME_LENGTH: usize = FrameFormat::Bin.length();

/// The state of a station, for the views.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Report {
    pub(super) output: Output<u8, 3>,
    pub(super) tally: ReceiverTally,
    /// The number of frames whose setpoint was not committed with the frame's last byte.
    pub(super) lost: u64,
    /// The number of commits that do not happen with a frame's last byte, or whose setpoint differs from that frame's.
    pub(super) wrong: u64,
    /// The time since the receiver became deaf; `None` if the receiver is not deaf.
    pub(super) deaf: Option<Duration>,
    pub(super) longest_deafness: Duration,
}

/// A motion PC, a line, and two stations at the end of the line, one for each policy.
pub(super) struct Demonstration {
    pub(super) arguments: Arguments,
    /// The virtual time.
    pub(super) now: Duration,
    /// The last setpoint that was sent.
    pub(super) last_sent: Option<Setpoint>,
    pub(super) bytes: Bytes,
    /// The lanes of the lecture's machine and of framelock.
    pub(super) lanes: [Lane; 2],
    script: Script,
    motion: SmoothMotion,
    trial: Trial,
    slot: u64,
}

impl Demonstration {
    pub(super) fn new(arguments: Arguments) -> Result<Self> {
        let (baud, rate) = (arguments.baud, arguments.rate);
        check_rate(rate.into(), FRAME_LENGTH, 0, baud, 1.0)?;
        let period = 1_000.0 / f64::from(rate);
        let parameters = Parameters {
            baud,
            rate: rate.into(),
            idle_gap: arguments.idle_gap.unwrap_or(Parameters::DEFAULT.idle_gap),
            // Hold after five frame times without a commit, and ramp after twenty-five frame times.
            hold_after: 5.0 * period,
            ramp_after: 25.0 * period,
            // 160 units per second. This is faster than the motion, so that the failsafe catches up.
            full_travel: 255_000.0 / 160.0,
            ..Parameters::DEFAULT
        };
        let rates = FaultRates {
            drop: arguments.drop,
            flip: arguments.flip,
            ..FaultRates::default()
        };
        let (seed, trial) = (arguments.seed, 0);
        let seed = Seed { seed, trial };
        let stations = [Policy::Lecture, Policy::Framelock].map(|policy| StationKind {
            policy,
            has_idle_gap: arguments.idle_gap.is_some(),
        });
        let mut trial = Trial::new(&parameters, seed, rates, &stations)?;
        trial.events = Some(Vec::new());
        Ok(Self {
            script: Script {
                slots: u64::from(arguments.seconds) * u64::from(rate),
            },
            arguments,
            // The motion takes two seconds from one point to the next.
            motion: SmoothMotion::new(seed, 2 * u64::from(rate)),
            trial,
            now: Duration::ZERO,
            slot: 0,
            last_sent: None,
            bytes: Bytes::default(),
            lanes: Default::default(),
        })
    }

    /// Advances to `time`, or to the end. The results do not depend on the number of calls.
    pub(super) fn advance_to(&mut self, time: Duration) {
        let Arguments { baud, rate, .. } = self.arguments;
        self.now = self.now.max(time.min(self.end()));
        let bits = self.now.as_nanos() * u128::from(baud) / 1_000_000_000;
        // At the end, run for 30 more bits, so that the last byte on the line arrives.
        let until = u64::try_from(bits).unwrap_or(u64::MAX) + if self.is_over() { 30 } else { 0 };
        while self.slot < self.script.slots {
            let begin = self.slot * u64::from(baud) / u64::from(rate);
            if begin > until {
                break;
            }
            self.run_to(begin);
            self.begin_slot(self.slot);
            self.slot += 1;
        }
        self.run_to(until);
    }

    /// Advances to a bit, and stores the bytes and the fates of frames for the views.
    fn run_to(&mut self, bit: u64) {
        self.trial.advance_to(bit);
        for event in self.trial.events.replace(Vec::new()).unwrap_or_default() {
            match event {
                Event::Byte {
                    sent: Some((Origin { frame, place }, sent)),
                    received,
                    outcomes,
                } => {
                    let byte = ByteOnLine {
                        sent,
                        place,
                        received,
                        outcomes,
                    };
                    self.bytes.push(self.slot_begin(frame), byte);
                }
                Event::Frame { number, fates } => {
                    let due = self.slot_begin(number);
                    for (lane, fate) in self.lanes.iter_mut().zip(fates) {
                        lane.push(due, Some(fate));
                    }
                }
                Event::Byte { sent: None, .. } | Event::Look { .. } => {}
            }
        }
    }

    fn slot_begin(&self, slot: u64) -> Duration {
        Duration::from_nanos(slot * 1_000_000_000 / u64::from(self.arguments.rate))
    }

    /// Begins the next slot, and sends its frame unless the PC is silent.
    fn begin_slot(&mut self, slot: u64) {
        let setpoint = self.script.setpoint(slot, &mut self.motion);
        let passage = self.script.passage(slot).0;
        if passage == Passage::Silence {
            let due = self.slot_begin(slot);
            for lane in &mut self.lanes {
                lane.push(due, None);
            }
            return;
        }
        self.trial.is_faulty = passage != Passage::Still;
        if self.arguments.drop > 0.0 && self.script.loses_first_byte(slot) {
            let (frame, place) = (slot, 0);
            self.trial.lost = Some(Origin { frame, place });
        }
        let [pitch, roll, yaw] = setpoint.into();
        let frame = Transmission::new(FrameFormat::Bin, [0, pitch, roll, yaw]);
        self.trial.send(slot, frame);
        self.last_sent = Some(setpoint);
    }

    pub(super) fn end(&self) -> Duration {
        Duration::from_secs(self.arguments.seconds.into())
    }

    pub(super) fn is_over(&self) -> bool {
        self.now >= self.end()
    }

    /// Returns the part of the demonstration to which the latest slot belongs.
    pub(super) fn passage(&self) -> Passage {
        self.script.passage(self.slot.saturating_sub(1)).0
    }

    /// Returns the counts of the line, and the reports of the lecture's machine and of framelock.
    pub(super) fn report(&self) -> (LineTally, Vec<Report>) {
        let tally = self.trial.tally();
        let stations = self.trial.stations().zip(tally.receivers).zip(&self.lanes);
        let reports = stations.map(|(((_, output), receiver), lane)| Report {
            output,
            deaf: lane.deaf(self.now),
            longest_deafness: lane.longest_deafness(self.now),
            lost: tally.line.frames_sent - receiver.delivered,
            wrong: receiver.wrong_setpoints + receiver.false_frames,
            tally: receiver,
        });
        (tally.line, reports.collect())
    }
}

#[cfg(test)]
pub(super) mod tests;
