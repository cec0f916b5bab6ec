//! Sends each frame when it is due, and parks after the last frame.

use std::io::{self, Write};
use std::time::Duration;

use framelock::motion::Setpoint;
use framelock_receiving::Protocol;
use framelock_simulation::between;

use super::pacer::{Clock, Pacer, Rate};

/// The number of frames with the park setpoint. Repetitions help if the line loses frames.
const PARK_FRAMES: u32 = 5;

/// A source of frames.
pub(super) struct Source {
    /// The due time of each frame, counted from the first.
    pub(super) dues: Box<dyn Iterator<Item = Duration>>,
    /// Returns the frame that is due at this time, or `None` if nothing is to be sent.
    pub(super) frame: Box<dyn FnMut(Duration) -> Option<Vec<u8>>>,
}

/// The parking at the end of a transmission.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Parking {
    pub(super) at: Setpoint,
    /// The duration of the way to the park setpoint, in seconds. With 0, the first parking frame already has the park
    /// setpoint.
    pub(super) seconds: f64,
    pub(super) rate: Rate,
}

/// Sends frames of one format, and counts them.
pub(super) struct Transmission<'a, C, W> {
    pub(super) pacer: Pacer<C>,
    line: &'a mut W,
    frame: &'a Protocol,
    last: Option<Setpoint>,
    /// The number of frames, without the parking frames.
    pub(super) frames: u64,
    /// The number of due times at which there was nothing to send.
    pub(super) silent: u64,
    pub(super) park_frames: u64,
}

impl<'a, C: Clock, W: Write> Transmission<'a, C, W> {
    pub(super) fn new(clock: C, line: &'a mut W, frame: &'a Protocol) -> Self {
        Self {
            pacer: Pacer::new(clock),
            line,
            frame,
            last: None,
            frames: 0,
            silent: 0,
            park_frames: 0,
        }
    }

    /// Sends the frames of `source` for at most `length`, or until there is a reason to stop, and then parks.
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
            let Some(bytes) = (source.frame)(due) else {
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
    fn park(&mut self, Parking { at, seconds, rate }: Parking) -> io::Result<()> {
        self.pacer.restart();
        let from = self.last.unwrap_or(at);
        let way = if from == at || seconds <= 0.0 {
            0
        } else {
            rate.frames_in(seconds)
        };
        for frame in 1..=way.saturating_add(PARK_FRAMES) {
            // The first parking frame is due one frame time after the last frame of the motion.
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
