//! When something came: seconds beside frames, and the time of day in messages.

use std::time::{Duration, Instant, SystemTime};

use clap::ValueEnum;

/// What the times of frames count from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Timestamps {
    /// The start of the program
    Start,
    /// The beginning of 1970, UTC
    Unix,
}

impl Timestamps {
    /// The time now, of a program that was started then.
    pub(crate) fn now(self, start: Instant) -> Duration {
        match self {
            Self::Start => start.elapsed(),
            Self::Unix => since_1970(),
        }
    }
}

fn since_1970() -> Duration {
    SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default()
}

/// The time of day, for messages: `09:30:05 UTC`.
pub(crate) fn time_of_day() -> String {
    let seconds = since_1970().as_secs();
    let [hours, minutes] = [seconds / 3600 % 24, seconds / 60 % 60];
    format!("{hours:02}:{minutes:02}:{:02} UTC", seconds % 60)
}
