//! The sending itself: frame after frame when it is due, and the parking behind the last.

use std::io::{self, Write};
use std::time::Duration;

use framelock::{Format, Setpoint};

use super::faults::{FaultTally, Faults};
use super::motion::demand;
use super::pacer::{Clock, Pacer, Punctuality};
use super::source::{Rate, Source};

/// How often the parking setpoint itself is sent: a line that loses frames must bring one.
const PARK_FRAMES: u32 = 5;

/// How it ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Parking {
    pub(super) at: Setpoint,
    /// How long the way there takes, in seconds; 0 for at once.
    pub(super) seconds: f64,
    pub(super) rate: Rate,
}

/// What was sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Report {
    /// Frames, without those that park.
    pub(super) frames: u64,
    /// Frames that were due while there was nothing to send.
    pub(super) silent: u64,
    pub(super) park_frames: u64,
    /// From the beginning to the end.
    pub(super) time: Duration,
    pub(super) punctuality: Punctuality,
    pub(super) faults: Option<FaultTally>,
}

/// Sends frames of one format.
pub(super) struct Session<'a, C, W> {
    pacer: Pacer<C>,
    line: &'a mut W,
    encode: fn(Setpoint) -> Vec<u8>,
    faults: Faults,
    bytes: Vec<u8>,
    last: Option<Setpoint>,
    report: Report,
}

impl<'a, C: Clock, W: Write> Session<'a, C, W> {
    pub(super) fn new<F>(clock: C, line: &'a mut W, faults: Faults) -> Self
    where
        F: Format<Message = Setpoint, Frame: AsRef<[u8]>>,
    {
        Self {
            pacer: Pacer::new(clock),
            line,
            encode: |setpoint| F::encode(setpoint).as_ref().to_vec(),
            faults,
            bytes: Vec::new(),
            last: None,
            report: Report::default(),
        }
    }

    /// Sends what `source` has, for `length` at most, until there is a reason to stop; then parks.
    ///
    /// # Errors
    /// The line takes no more.
    pub(super) fn run(
        &mut self,
        source: &mut dyn Source,
        length: Option<Duration>,
        parking: Option<Parking>,
    ) -> io::Result<()> {
        let mut number = 0;
        let is_within = |due: &Duration| length.is_none_or(|length| *due < length);
        while let Some(due) = source.due(number).filter(is_within) {
            if !self.pacer.wait_until(due) {
                break;
            }
            match source.setpoint(number, due) {
                Some(setpoint) => {
                    self.send(setpoint, true)?;
                    self.report.frames += 1;
                }
                None => self.report.silent += 1,
            }
            number += 1;
        }
        if let Some(parking) = parking {
            self.park(parking)?;
        }
        self.line.flush()
    }

    /// In a straight line from where the axes are; without faults, since this is in earnest.
    fn park(&mut self, parking: Parking) -> io::Result<()> {
        self.pacer.restart();
        let from = self.last.unwrap_or(parking.at);
        let way = if from == parking.at || parking.seconds <= 0.0 {
            0
        } else {
            parking.rate.frames_in(parking.seconds)
        };
        for frame in 1..=way.saturating_add(PARK_FRAMES) {
            // The first is due a frame's time behind the last of the motion.
            self.pacer.wait_until(parking.rate.due(frame.into()));
            let part = if frame < way {
                f64::from(frame) / f64::from(way)
            } else {
                1.0
            };
            self.send(between(from, parking.at, part), false)?;
            self.report.park_frames += 1;
        }
        Ok(())
    }

    fn send(&mut self, setpoint: Setpoint, with_faults: bool) -> io::Result<()> {
        let frame = (self.encode)(setpoint);
        self.bytes.clear();
        if with_faults {
            self.faults.apply(&frame, &mut self.bytes);
        } else {
            self.bytes.extend_from_slice(&frame);
        }
        self.line.write_all(&self.bytes)?;
        self.last = Some(setpoint);
        Ok(())
    }

    /// What was sent so far.
    pub(super) fn report(&self) -> Report {
        Report {
            time: self.pacer.elapsed(),
            punctuality: self.pacer.punctuality(),
            faults: self.faults.tally(),
            ..self.report
        }
    }
}

/// The setpoint at a part, 0 to 1, of the way.
fn between(from: Setpoint, to: Setpoint, part: f64) -> Setpoint {
    let mut axes = <[u8; 3]>::from(from);
    for (axis, to) in axes.iter_mut().zip(<[u8; 3]>::from(to)) {
        let from = f64::from(*axis);
        *axis = demand(from + (f64::from(to) - from) * part);
    }
    axes.into()
}

#[cfg(test)]
mod tests;
