//! A motion profile: setpoints from a file, with their times or at a rate.

use std::time::Duration;

use anyhow::{Result, anyhow, bail};
use framelock::Setpoint;

use super::source::{Rate, Source};
use crate::input::Input;
use crate::setpoints::{InputFormat, Row, Rows};
use crate::stream::for_each_chunk;

/// The rows of a profile, and when each is due.
pub(super) struct Profile {
    rows: Vec<Row>,
    pace: Pace,
}

enum Pace {
    /// A frame for each row, at its own time.
    Times,
    /// A frame for each row, at a rate.
    Rows(Rate),
    /// At a rate, each with the last row whose time has come: that with this index, so far.
    Held(Rate, usize),
}

impl Profile {
    /// Reads `input` to its end, so that nothing is sent of a profile that has a mistake in it.
    ///
    /// A profile with times is sent at these, or at `rate` if there is one, and holds each setpoint
    /// until the next one's time. One without is sent at `rate`, or else at `usual_rate`.
    pub(super) fn read(input: Input, rate: Option<Rate>, usual_rate: Rate) -> Result<Self> {
        let name = input.name.clone();
        let mut rows = Vec::new();
        let mut reader = Rows::with_times(InputFormat::Auto);
        let mut keep = |row| {
            rows.push(row);
            Ok(())
        };
        for_each_chunk(&mut input.into_reader(), |chunk| {
            reader.feed(chunk, &mut keep)
        })
        .and_then(|()| reader.finish(&mut keep))
        .or_else(|failure| failure.told(&name, ""))?;
        let first = rows
            .first()
            .ok_or_else(|| anyhow!("{name}: no setpoint in it"))?;
        let pace = match (first.time, rate) {
            (None, rate) => Pace::Rows(rate.unwrap_or(usual_rate)),
            (Some(_), None) => Pace::Times,
            (Some(_), Some(rate)) => Pace::Held(rate, 0),
        };
        Ok(Self { rows, pace })
    }

    /// The rate it is sent at, unless its rows' times are.
    pub(super) fn rate(&self) -> Option<Rate> {
        match self.pace {
            Pace::Times => None,
            Pace::Rows(rate) | Pace::Held(rate, _) => Some(rate),
        }
    }

    /// That no two rows are due sooner one behind the other than a frame takes on the line.
    pub(super) fn check_line_carries(&self, frame_time: Duration) -> Result<()> {
        if !matches!(self.pace, Pace::Times) {
            return Ok(());
        }
        for (index, pair) in self.rows.windows(2).enumerate() {
            let [before, after] = pair else { continue };
            let apart = self.time(after).saturating_sub(self.time(before));
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

    /// Counted from the first row's.
    fn time(&self, row: &Row) -> Duration {
        let of = |row: &Row| row.time.unwrap_or_default();
        of(row).saturating_sub(self.rows.first().map(of).unwrap_or_default())
    }

    fn row(&self, number: u64) -> Option<&Row> {
        self.rows.get(usize::try_from(number).ok()?)
    }
}

impl Source for Profile {
    fn due(&mut self, number: u64) -> Option<Duration> {
        match self.pace {
            Pace::Times => self.row(number).map(|row| self.time(row)),
            Pace::Rows(rate) => self.row(number).map(|_| rate.due(number)),
            Pace::Held(rate, _) => {
                let end = self.rows.last().map(|row| self.time(row));
                Some(rate.due(number)).filter(|due| Some(*due) <= end)
            }
        }
    }

    fn setpoint(&mut self, number: u64, due: Duration) -> Option<Setpoint> {
        if let Pace::Held(rate, mut index) = self.pace {
            while self
                .rows
                .get(index + 1)
                .is_some_and(|next| self.time(next) <= due)
            {
                index += 1;
            }
            self.pace = Pace::Held(rate, index);
            return self.rows.get(index).map(|row| row.setpoint);
        }
        self.row(number).map(|row| row.setpoint)
    }
}
