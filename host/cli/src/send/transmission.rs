//! The sending itself: frame after frame when it is due, and the parking behind the last.

use std::io::{self, Write};
use std::time::Duration;

use framelock::motion::Setpoint;
use framelock_receiving::Protocol;
use framelock_simulation::{ByteFaults, between};

use super::pacer::{Clock, Pacer, Rate};

/// How often the parking setpoint itself is sent: a line that loses frames must bring one.
const PARK_FRAMES: u32 = 5;

/// What is sent.
pub(super) struct Source {
    /// When each frame is due, counted from the first.
    pub(super) dues: Box<dyn Iterator<Item = Duration>>,
    /// Each frame, asked for when it is due; none if nothing is to be sent.
    pub(super) frame: Box<dyn FnMut(Duration) -> Option<Vec<u8>>>,
}

/// How it ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Parking {
    pub(super) at: Setpoint,
    /// How long the way there takes, in seconds; 0 for at once.
    pub(super) seconds: f64,
    pub(super) rate: Rate,
}

/// Sends frames of one format, and counts them.
pub(super) struct Transmission<'a, C, W> {
    pub(super) pacer: Pacer<C>,
    line: &'a mut W,
    frame: &'a Protocol,
    pub(super) faults: Option<ByteFaults>,
    last: Option<Setpoint>,
    /// Frames, without those that park.
    pub(super) frames: u64,
    /// Frames that were due while there was nothing to send.
    pub(super) silent: u64,
    pub(super) park_frames: u64,
}

impl<'a, C: Clock, W: Write> Transmission<'a, C, W> {
    pub(super) fn new(
        clock: C,
        line: &'a mut W,
        frame: &'a Protocol,
        faults: Option<ByteFaults>,
    ) -> Self {
        Self {
            pacer: Pacer::new(clock),
            line,
            frame,
            faults,
            last: None,
            frames: 0,
            silent: 0,
            park_frames: 0,
        }
    }

    /// Sends what `source` has, for `length` at most, until there is a reason to stop; then parks.
    pub(super) fn run(
        &mut self,
        mut source: Source,
        length: Option<Duration>,
        parking: Option<Parking>,
    ) -> io::Result<()> {
        for due in source.dues {
            if length.is_some_and(|length| due >= length) || !self.pacer.wait_until(due) {
                break;
            }
            let Some(mut bytes) = (source.frame)(due) else {
                self.silent += 1;
                continue;
            };
            self.last = self.frame.setpoint(&bytes);
            if let Some(faults) = &mut self.faults {
                bytes = bytes
                    .into_iter()
                    .flat_map(|byte| faults.carry(byte))
                    .flatten()
                    .collect();
            }
            self.line.write_all(&bytes)?;
            self.frames += 1;
        }
        if let Some(parking) = parking {
            self.park(parking)?;
        }
        self.line.flush()
    }

    /// In a straight line from where the axes are; without faults on purpose.
    fn park(&mut self, Parking { at, seconds, rate }: Parking) -> io::Result<()> {
        self.pacer.restart();
        let from = self.last.unwrap_or(at);
        let way = if from == at || seconds <= 0.0 {
            0
        } else {
            rate.frames_in(seconds)
        };
        for frame in 1..=way.saturating_add(PARK_FRAMES) {
            // The first is due a frame's time behind the last of the motion.
            self.pacer.wait_until(rate.due(frame.into()));
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
mod tests;
