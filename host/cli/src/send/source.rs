//! The frames to send: a built-in motion, the rows of a profile, or the setpoints of datagrams.

use std::time::Duration;

use anyhow::{Result, bail};
use framelock_receiving::Protocol;
use framelock_simulation::Motion;

use super::datagrams::Datagrams;
use super::pacer::Rate;
use crate::input::Input;
use crate::rows::{Row, rows};

/// A source of frames.
pub(super) enum Source {
    Motion(Motion),
    Profile(Profile),
    Datagrams(Datagrams),
}

/// One or more frames and, if the file has times, the due time of each frame, counted from the first frame.
pub(super) struct Profile {
    frames: Vec<Vec<u8>>,
    times: Option<Vec<Duration>>,
}

impl Source {
    /// Returns the due time of a frame, counted from the first, or `None` if the source has ended.
    pub(super) fn due(&self, number: u64, rate: Rate) -> Option<Duration> {
        let is_over = match self {
            Self::Motion(_) => false,
            Self::Datagrams(datagrams) => datagrams.received().failure.is_some(),
            Self::Profile(profile) => profile.frame(number).is_none(),
        };
        match self {
            _ if is_over => None,
            Self::Profile(Profile {
                times: Some(times), ..
            }) => times.get(usize::try_from(number).ok()?).copied(),
            _ => Some(rate.due(number)),
        }
    }

    /// Returns the frame that is due at this time, or `None` if nothing is to be sent.
    pub(super) fn frame(&self, number: u64, due: Duration, protocol: &Protocol) -> Option<Vec<u8>> {
        let setpoint = match self {
            Self::Motion(motion) => motion.at(due),
            Self::Profile(profile) => return profile.frame(number).cloned(),
            Self::Datagrams(datagrams) => datagrams.setpoint()?,
        };
        Some(protocol.encode_setpoint(setpoint))
    }
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

    fn frame(&self, number: u64) -> Option<&Vec<u8>> {
        self.frames.get(usize::try_from(number).ok()?)
    }
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use std::num::NonZeroU32;

    use super::*;

    const RATE: Rate = Rate(NonZeroU32::new(100).unwrap());

    pub(in super::super) fn profile(text: &str) -> Profile {
        let frame = Protocol::named("bin").unwrap();
        Profile::read(Input::new("moves", text.as_bytes()), &frame).unwrap()
    }

    #[test]
    fn each_setpoint_is_sent_at_its_time_or_at_a_rate() {
        let bin = Protocol::named("bin").unwrap();
        let timed = "time,yaw,pitch,roll\n1.00,3,1,2\n1.02,6,4,5\n1.02,7,7,7\n1.05,9,8,8\n";
        for (text, has_times, expected) in [
            (timed, true, &[(0, 1), (20, 4), (20, 7), (50, 8)][..]),
            ("1,2,3\n4,5,6", false, &[(0, 1), (10, 4)]),
        ] {
            let profile = profile(text);
            assert_eq!(profile.has_times(), has_times);
            let source = Source::Profile(profile);
            let dues = (0..).map_while(|number| source.due(number, RATE));
            let frames = dues.zip(0..).map(|(due, number)| {
                let frame = source.frame(number, due, &bin).unwrap();
                (due.as_millis(), frame[3])
            });
            assert_eq!(frames.collect::<Vec<_>>(), expected);
        }
    }
}
