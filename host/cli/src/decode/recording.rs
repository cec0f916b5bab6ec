//! Records an input: its bytes alone, or hex with the times of the bytes. `decode` reads both kinds of recordings.

use std::io::Write;
use std::path::Path;

use anyhow::Result;
use framelock_description::hex;

use crate::input::Arrival;
use crate::output::Output;

pub(super) struct Recording {
    output: Output,
    has_times: bool,
}

impl Recording {
    /// Returns whether a recording with this name has times.
    pub(super) fn has_times(path: &Path) -> bool {
        path.extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("hex"))
    }

    /// Creates the file, which must not exist.
    pub(super) fn new(path: &Path) -> Result<Self> {
        Ok(Self {
            output: Output::create_new(path)?,
            has_times: Self::has_times(path),
        })
    }

    /// Records an arrival at this time, in microseconds. In a recording with times, the bytes become a line such as
    /// `(12.345678) 414200`, and the line event becomes a line such as `(12.345678) parity error`.
    #[allow(
        clippy::cast_precision_loss,
        reason = "times until the year 2255 are exact"
    )]
    pub(super) fn write(&mut self, time: i64, arrival: &Arrival) -> Result<()> {
        if !self.has_times {
            return Ok(self.output.write_all(&arrival.bytes)?);
        }
        let seconds = time as f64 / 1e6;
        if !arrival.bytes.is_empty() || arrival.event.is_none() {
            let bytes = hex::glued(&arrival.bytes);
            writeln!(self.output, "({seconds:.6}) {bytes}")?;
        }
        if let Some(event) = arrival.event {
            writeln!(self.output, "({seconds:.6}) {event}")?;
        }
        Ok(())
    }
}
