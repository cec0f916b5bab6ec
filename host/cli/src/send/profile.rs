//! A profile: a file with one row per frame. The frames are sent at the rows' times, or at a fixed rate.

use std::time::Duration;

use anyhow::{Result, bail};
use framelock_receiving::Protocol;

use super::pacer::{MOST_MADE_UP, Rate};
use super::transmission::Source;
use crate::input::Input;
use crate::rows::{InputFormat, Row, rows};

/// One or more frames and, if the file has times, the due time of each frame, counted from the first frame.
pub(super) struct Profile {
    frames: Vec<Vec<u8>>,
    times: Option<Vec<Duration>>,
}

impl Profile {
    /// Reads `input` to its end, so that no frame of an invalid profile is sent.
    pub(super) fn read(input: Input, frame: &Protocol) -> Result<Self> {
        let name = input.name.clone();
        let rows: Vec<Row> = rows(input, InputFormat::Auto, frame, true)?.collect::<Result<_>>()?;
        let Some(first) = rows.first() else {
            bail!("{name} has no rows: give a row for each frame, such as 127,200,74");
        };
        let first = first.time.unwrap_or_default();
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

    /// Checks that the line is fast enough for the frames, at their times or, without times, at `rate`. If `is_held`,
    /// each frame is repeated until the next one is due. `time_of` returns the time that the line needs for a number of
    /// bytes. Several frames may be due at the same time, for example in a recording from a USB adapter. The check
    /// accepts this if no frame would be more than [`MOST_MADE_UP`] late.
    pub(super) fn check_line_carries(
        &self,
        rate: Rate,
        is_held: bool,
        time_of: impl Fn(usize) -> Duration,
    ) -> Result<()> {
        let times = self.times.iter().flatten().copied();
        let made_up = self.times.is_none().then(|| rate.dues());
        let mut dues = times.chain(made_up.into_iter().flatten()).peekable();
        let mut free_at = Duration::ZERO;
        for (index, frame) in self.frames.iter().enumerate() {
            let due = dues.next().unwrap_or_default();
            let late = free_at.saturating_sub(due);
            if late > MOST_MADE_UP {
                bail!(
                    "row {} of the profile would be {:.0} ms late, because the line would still be busy with the rows \
                     before it: raise --baud, or hold the profile at a lower --rate",
                    index + 1,
                    late.as_secs_f64() * 1e3,
                );
            }
            let until_next = dues
                .peek()
                .map_or(Duration::ZERO, |next| next.saturating_sub(due));
            let count = if is_held {
                rate.frames_in(until_next.as_secs_f64())
            } else {
                1
            };
            free_at = free_at
                .max(due)
                .saturating_add(time_of(frame.len()).saturating_mul(count));
        }
        Ok(())
    }

    /// Returns a source that sends each frame at its time or, without times, at `rate`.
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

    /// Returns a source that sends, at `rate`, the latest frame whose time has come. Without times, it sends each frame
    /// once.
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
            let told = profile
                .check_line_carries(RATE, false, time_of)
                .err()
                .map(|error| error.to_string());
            assert_eq!(told.is_none(), is_carried, "{told:?}");
            let expected = "row 37 of the profile would be 252 ms late";
            assert!(told.is_none_or(|told| told.starts_with(expected)));
        }
    }

    #[test]
    fn a_held_frame_takes_the_time_of_all_its_repetitions() {
        // A long frame is held for 50 ms in the first case, and for one second in the second case. Then a short frame
        // is held until 2 s have passed.
        let frame = Protocol::named("ubx").unwrap();
        let time_of = |bytes: usize| Duration::from_millis(bytes as u64);
        for (until, is_carried) in [("0.05", true), ("1", false)] {
            let rows = format!(
                "time,class,id,payload\n0,1,1,{}\n{until},1,1,\n2,1,1,\n",
                "00".repeat(40)
            );
            let profile = Profile::read(Input::new("moves", rows.as_bytes()), &frame).unwrap();
            // On the line, the long frame takes 48 ms and each short frame 8 ms. A held frame is due every 10 ms.
            let outcome = profile.check_line_carries(RATE, true, time_of);
            assert_eq!(outcome.is_ok(), is_carried, "{outcome:?}");
        }
    }

    #[test]
    fn each_setpoint_is_sent_at_its_time_or_held_at_a_rate() {
        let frame = Protocol::named("bin").unwrap();
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
