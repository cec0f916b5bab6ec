//! A profile: a file with one row per frame. The frames are sent at the rows' times, or at a fixed rate.

use std::time::Duration;

use anyhow::{Result, bail};
use framelock_receiving::Protocol;

use super::pacer::{MOST_MADE_UP, Rate};
use super::transmission::Source;
use crate::input::Input;
use crate::rows::{Row, rows};

/// One or more frames and, if the file has times, the due time of each frame, counted from the first frame.
pub(super) struct Profile {
    frames: Vec<Vec<u8>>,
    times: Option<Vec<Duration>>,
}

impl Profile {
    /// Reads `input` to its end, so that no frame of an invalid profile is sent.
    pub(super) fn read(input: Input, frame: &Protocol) -> Result<Self> {
        let name = input.name.clone();
        let rows: Vec<Row> = rows(input, frame, true)?.collect::<Result<_>>()?;
        let Some(first) = rows.first() else {
            bail!("{name} has no rows: give a row for each frame, such as 127,200,74");
        };
        let first = first.time.unwrap_or(Duration::ZERO);
        let times = rows.iter().map(|row| Some(row.time?.saturating_sub(first)));
        Ok(Self {
            times: times.collect(),
            frames: rows.into_iter().map(|row| row.frame).collect(),
        })
    }

    /// Returns whether the profile has times.
    pub(super) fn has_times(&self) -> bool {
        self.times.is_some()
    }

    /// Checks that the line is fast enough for the frames, at their times or, without times, at `rate`. `time_of`
    /// returns the time that the line needs for a number of bytes. Several frames may be due at the same time, for
    /// example in a recording from a USB adapter. The check accepts this if no frame would be more than
    /// [`MOST_MADE_UP`] late.
    pub(super) fn check_line_carries(
        &self,
        rate: Rate,
        time_of: impl Fn(usize) -> Duration,
    ) -> Result<()> {
        let mut free_at = Duration::ZERO;
        for (index, frame) in self.frames.iter().enumerate() {
            let due = match &self.times {
                Some(times) => times[index],
                None => rate.due(index as u64),
            };
            let late = free_at.saturating_sub(due);
            if late > MOST_MADE_UP {
                bail!(
                    "row {} of the profile would be {:.0} ms late, because the line would still be busy with the rows \
                     before it: raise --baud, or send the rows further apart",
                    index + 1,
                    late.as_secs_f64() * 1e3,
                );
            }
            free_at = free_at.max(due) + time_of(frame.len());
        }
        Ok(())
    }

    /// Returns a source that sends each frame at its time or, without times, at `rate`.
    pub(super) fn source(self, rate: Rate) -> Source {
        let mut frames = self.frames.into_iter();
        Source {
            dues: match self.times {
                Some(times) => Box::new(times.into_iter()),
                None => Box::new(rate.dues().take(frames.len())),
            },
            frame: Box::new(move |_| frames.next()),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use std::num::NonZeroU32;

    use super::*;

    const RATE: Rate = Rate(NonZeroU32::new(100).unwrap());

    /// Returns for each frame the due time in milliseconds, and the pitch.
    fn frames(mut source: Source) -> Vec<(u128, u8)> {
        source
            .dues
            .map(|due| (due.as_millis(), (source.frame)(due).unwrap()[3]))
            .collect()
    }

    #[test]
    fn a_line_makes_up_for_frames_that_are_due_at_once() {
        let frame = Protocol::named("bin").unwrap();
        let time_of = |bytes| Duration::from_millis(bytes as u64);
        // Each frame takes 7 ms. If 37 frames are due at the same time, the last one is 252 ms late. The limit is
        // 250 ms.
        for (count, is_carried) in [(36, true), (37, false)] {
            let rows = (0..2 * count).map(|row| format!("{},1,2,3\n", row / count));
            let rows = rows.collect::<Vec<_>>().concat();
            let profile = Profile::read(Input::new("moves", rows.as_bytes()), &frame).unwrap();
            let outcome = profile.check_line_carries(RATE, time_of);
            let error = outcome.map_err(|error| error.to_string()).err();
            assert_eq!(error.is_none(), is_carried, "{error:?}");
            let expected = "row 37 of the profile would be 252 ms late";
            assert!(error.is_none_or(|error| error.starts_with(expected)));
        }
    }

    #[test]
    fn each_setpoint_is_sent_at_its_time_or_at_a_rate() {
        let frame = Protocol::named("bin").unwrap();
        let read = |text: &'static str| {
            Profile::read(Input::new("moves", text.as_bytes()), &frame).unwrap()
        };
        let timed = "time,yaw,pitch,roll\n1.00,3,1,2\n1.02,6,4,5\n1.02,7,7,7\n1.05,9,8,8\n";
        let expected = [(0, 1), (20, 4), (20, 7), (50, 8)];
        assert_eq!(frames(read(timed).source(RATE)), expected);
        assert!(read(timed).has_times() && !read("1,2,3").has_times());
        assert_eq!(frames(read("1,2,3\n4,5,6").source(RATE)), [(0, 1), (10, 4)]);
    }
}
