//! Runs the demonstration in virtual time. Nothing in this module waits, draws or prints.

use std::time::Duration;

use anyhow::{Error, Result};
use framelock::motion::{FailsafeParameters, Output, Setpoint};
use framelock_simulation::{
    Event, Fate, LineTally, Origin, Parameters, Policy, Protocol, ReceiverTally, Seed,
    SmoothMotion, StationKind, Transmission, Trial,
};

use super::bytes::{ByteOnLine, Bytes};
use super::script::{self, LOSS, Passage, RATE, SECONDS};

const BAUD: u32 = 115_200;

/// The number of the line's bits from the beginning of one slot to the next.
const SLOT: u64 = BAUD as u64 / RATE;

/// The seed of the motion and of the line's faults.
const SEED: Seed = Seed { seed: 1, trial: 0 };

/// A line that loses a byte, or inverts one of its bits, with these probabilities while the seat moves. A failsafe for
/// frames that are 100 ms apart, whose clock counts microseconds.
pub(super) const PARAMETERS: Parameters = Parameters {
    seed: SEED.seed,
    baud: BAUD,
    lose: 0.02,
    flip: 0.002,
    failsafe: FailsafeParameters {
        hold_after: 500_000,
        ramp_after: 2_500_000,
        // 160 units per second, and 800 when live.
        approach_travel: 1_593_750,
        live_travel: 318_750,
        ..Parameters::DEFAULT.failsafe
    },
    ..Parameters::DEFAULT
};

/// The time at which the demonstration is over.
const END: Duration = Duration::from_secs(SECONDS);

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
    /// The virtual time.
    pub(super) now: Duration,
    /// The last setpoint that was sent.
    pub(super) last_sent: Option<Setpoint>,
    pub(super) bytes: Bytes,
    /// The lanes of the lecture's machine and of framelock.
    pub(super) lanes: [Lane; 2],
    protocol: Protocol,
    motion: SmoothMotion,
    trial: Trial,
    slot: u64,
}

impl Demonstration {
    pub(super) fn new() -> Result<Self> {
        let stations = [Policy::Lecture, Policy::Framelock].map(|policy| StationKind {
            policy,
            has_idle_gap: false,
        });
        let protocol = Protocol::named("bin").map_err(Error::msg)?;
        let mut trial = Trial::new(&protocol, &PARAMETERS, SEED.trial, &stations)?;
        trial.events = Some(Vec::new());
        trial.lost = Some(Origin {
            frame: LOSS,
            place: 0,
        });
        Ok(Self {
            // The motion takes two seconds from one point to the next.
            protocol,
            motion: SmoothMotion::new(SEED, 2 * RATE),
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
        self.now = self.now.max(time.min(END));
        let bits = self.now.as_nanos() * u128::from(BAUD) / 1_000_000_000;
        // At the end, run for 30 more bits, so that the last byte on the line arrives.
        let until = u64::try_from(bits).unwrap_or(u64::MAX) + if self.is_over() { 30 } else { 0 };
        while self.slot < SECONDS * RATE && self.slot * SLOT <= until {
            self.run_to(self.slot * SLOT);
            self.begin_slot(self.slot);
            self.slot += 1;
        }
        self.run_to(until);
    }

    /// Advances to a bit, and stores the bytes and the fates of frames for the views.
    fn run_to(&mut self, bit: u64) {
        self.trial.advance_to(bit);
        for event in self
            .trial
            .events
            .replace(Vec::new())
            .expect("the trial is watched")
        {
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
                    self.bytes.push(slot_begin(frame), byte);
                }
                Event::Frame { number, fates } => {
                    let due = slot_begin(number);
                    for (lane, fate) in self.lanes.iter_mut().zip(fates) {
                        lane.push(due, Some(fate));
                    }
                }
                Event::Byte { sent: None, .. } => {}
            }
        }
    }

    /// Begins the next slot, and sends its frame unless the PC is silent.
    fn begin_slot(&mut self, slot: u64) {
        let setpoint = script::setpoint(slot, &mut self.motion);
        let passage = script::passage(slot);
        if passage == Passage::Silence {
            let due = slot_begin(slot);
            for lane in &mut self.lanes {
                lane.push(due, None);
            }
            return;
        }
        self.trial.is_faulty = passage != Passage::Still;
        let [pitch, roll, yaw] = setpoint.into();
        let frame = Transmission::new(&self.protocol, [0, pitch, roll, yaw]);
        self.trial.send(slot, frame);
        self.last_sent = Some(setpoint);
    }

    pub(super) fn is_over(&self) -> bool {
        self.now >= END
    }

    /// Returns the part of the demonstration to which the latest slot belongs.
    pub(super) fn passage(&self) -> Passage {
        script::passage(self.slot.saturating_sub(1))
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

fn slot_begin(slot: u64) -> Duration {
    Duration::from_millis(slot * 1_000 / RATE)
}

/// The fates of the frames at one receiver, in the order in which the frames were due.
#[derive(Debug, Default)]
pub(super) struct Lane {
    /// The fates; `None` for a slot in which no frame was sent.
    fates: Vec<Option<Fate>>,
    /// The time of the first frame that the receiver has missed since its last delivery.
    deaf_since: Option<Duration>,
    longest_deafness: Duration,
}

impl Lane {
    /// Appends the fate of the frame that was due at this time, or `None` if no frame was sent.
    pub(super) fn push(&mut self, due: Duration, fate: Option<Fate>) {
        self.fates.push(fate);
        match fate {
            Some(Fate::Missed) => self.deaf_since = self.deaf_since.or(Some(due)),
            // While nothing is sent, no frame can be missed.
            Some(Fate::Delivered) | None => {
                self.longest_deafness = self.longest_deafness(due);
                self.deaf_since = None;
            }
            Some(Fate::Broken | Fate::Wrong) => {}
        }
    }

    /// Returns the last `count` fates, oldest first.
    pub(super) fn last(&self, count: usize) -> impl Iterator<Item = Option<Fate>> {
        let before = self.fates.len().saturating_sub(count);
        self.fates.iter().skip(before).copied()
    }

    /// Returns the time since the receiver became deaf, or `None` if the receiver is not deaf.
    pub(super) fn deaf(&self, now: Duration) -> Option<Duration> {
        self.deaf_since.map(|since| now.saturating_sub(since))
    }

    /// Returns the longest time during which the receiver was deaf.
    pub(super) fn longest_deafness(&self, now: Duration) -> Duration {
        let current = self.deaf(now).unwrap_or(Duration::ZERO);
        current.max(self.longest_deafness)
    }
}

#[cfg(test)]
mod tests;
