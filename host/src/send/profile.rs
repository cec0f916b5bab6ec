//! A profile: frames from the rows of a file, with their times or at a rate.

use std::time::Duration;

use anyhow::{Result, bail};

use super::pacer::Rate;
use super::session::Source;
use crate::frame::Frame;
use crate::input::Input;
use crate::rows::{InputFormat, Row, rows};

/// Frames, at least one, and if the file says so when each is due, counted from the first.
pub(super) struct Profile {
    frames: Vec<Vec<u8>>,
    times: Option<Vec<Duration>>,
}

impl Profile {
    /// Reads `input` to its end, so that nothing is sent of a profile that has a mistake in it.
    pub(super) fn read(input: Input, frame: &Frame) -> Result<Self> {
        let name = input.name.clone();
        let rows: Vec<Row> = rows(input, InputFormat::Auto, frame, true)?.collect::<Result<_>>()?;
        let Some(first) = rows.first() else {
            bail!("{name}: no setpoint in it");
        };
        let first = first.time.unwrap_or_default();
        let times = rows.iter().map(|row| Some(row.time?.saturating_sub(first)));
        Ok(Self {
            times: times.collect(),
            frames: rows.into_iter().map(|row| row.frame).collect(),
        })
    }

    /// Bytes in its longest frame.
    pub(super) fn longest(&self) -> usize {
        self.frames.iter().map(Vec::len).max().unwrap_or_default()
    }

    /// Whether it says when each frame is due.
    pub(super) fn has_times(&self) -> bool {
        self.times.is_some()
    }

    /// That no two frames are due sooner one behind the other than a frame takes on the line.
    pub(super) fn check_line_carries(&self, frame_time: Duration) -> Result<()> {
        let times = self.times.as_deref().unwrap_or_default();
        for (index, pair) in times.windows(2).enumerate() {
            let [before, after] = pair else { continue };
            let apart = after.saturating_sub(*before);
            if apart < frame_time {
                bail!(
                    "setpoints {} and {} of the profile are {} ms apart, and a frame takes {} ms \
                     on the line: raise --baud, or give a --rate at which the profile is held",
                    index + 1,
                    index + 2,
                    apart.as_secs_f64() * 1e3,
                    frame_time.as_secs_f64() * 1e3,
                );
            }
        }
        Ok(())
    }

    /// Each frame at its time; without times, at `rate`.
    pub(super) fn in_turn(self, rate: Rate) -> Source {
        let mut frames = self.frames.into_iter();
        Source {
            dues: match self.times {
                Some(times) => Box::new(times.into_iter()),
                None => Box::new(rate.dues().take(frames.len())),
            },
            frame: Box::new(move |_| frames.next()),
        }
    }

    /// At `rate`, each time the last frame whose time has come; without times, each in turn.
    pub(super) fn held(self, rate: Rate) -> Source {
        let Some(times) = self.times else {
            return self.in_turn(rate);
        };
        let end = times.last().copied().unwrap_or_default();
        Source {
            dues: Box::new(rate.dues().take_while(move |&due| due <= end)),
            frame: Box::new(move |due| {
                let come = times.partition_point(|&time| time <= due);
                self.frames.get(come.checked_sub(1)?).cloned()
            }),
        }
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

    use super::*;

    const RATE: Rate = Rate(NonZeroU32::new(100).unwrap());

    /// When frames are due, in milliseconds, and their pitches.
    fn frames(mut source: Source) -> Vec<(u128, u8)> {
        source
            .dues
            .map(|due| (due.as_millis(), (source.frame)(due).unwrap()[3]))
            .collect()
    }

    #[test]
    fn each_setpoint_is_sent_at_its_time_or_held_at_a_rate() {
        let frame = Frame::named("bin").unwrap();
        let read = |text: &'static str| {
            Profile::read(Input::new("moves", text.as_bytes()), &frame).unwrap()
        };
        let timed = "time,yaw,pitch,roll\n1.00,3,1,2\n1.02,6,4,5\n1.02,7,7,7\n1.05,9,8,8\n";
        assert_eq!(
            frames(read(timed).in_turn(RATE)),
            [(0, 1), (20, 4), (20, 7), (50, 8)]
        );
        assert_eq!(
            frames(read(timed).held(RATE)),
            [(0, 1), (10, 1), (20, 7), (30, 7), (40, 7), (50, 8)]
        );
        assert!(read(timed).has_times() && !read("1,2,3").has_times());
        for source in [
            read("1,2,3\n4,5,6").in_turn(RATE),
            read("1,2,3\n4,5,6").held(RATE),
        ] {
            assert_eq!(frames(source), [(0, 1), (10, 4)]);
        }
    }
}
