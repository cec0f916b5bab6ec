//! Setpoints from text: comma-separated values or JSON lines.

mod csv_row;
mod json_row;

use std::time::Duration;

use clap::ValueEnum;
use framelock::Setpoint;

use crate::stream::Failure;
use csv_row::CsvRows;

/// The middle of every axis.
pub const LEVEL: Setpoint = Setpoint {
    pitch: 0x80,
    roll: 0x80,
    yaw: 0x80,
};

/// The fields of a setpoint, in the order of the frame.
const AXES: [&str; 3] = ["pitch", "roll", "yaw"];

/// The field that says when a setpoint is due.
const TIME: &str = "time";

const NOT_A_DEMAND: &str = "is not a whole number from 0 to 255";

const NOT_A_TIME: &str = "is not a number of seconds, 0 or more";

/// More than any row of setpoints needs. Memory stays bounded whatever the input is.
const LONGEST_LINE: usize = 64 * 1024;

/// How setpoints are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum InputFormat {
    /// JSON lines if the first thing in it is a brace, else comma-separated values
    Auto,
    /// Comma-separated values, with or without a header
    Csv,
    /// A JSON object per line
    Jsonl,
}

/// A setpoint as the text has it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Row {
    /// When it is due, if the text says so and [`Rows::with_times`] reads it.
    pub time: Option<Duration>,
    /// Where each axis is to be.
    pub setpoint: Setpoint,
}

/// Cuts text that arrives in pieces into lines, and lines into setpoints.
pub struct Rows {
    format: InputFormat,
    csv: CsvRows,
    reads_times: bool,
    /// How many rows there were, and the time of the last: all have a time, or none has.
    row_count: u64,
    time_before: Option<Duration>,
    /// The beginning of a line whose end has not arrived yet.
    partial: Vec<u8>,
    lines: u64,
}

impl Rows {
    /// Reads setpoints; a column or field `time` is one of those that mean nothing.
    #[must_use]
    pub fn new(format: InputFormat) -> Self {
        Self::reading(format, false)
    }

    /// Also reads times in seconds: a column or field `time`, or the first of four columns without
    /// a header. They may not go back.
    #[must_use]
    pub fn with_times(format: InputFormat) -> Self {
        Self::reading(format, true)
    }

    fn reading(format: InputFormat, reads_times: bool) -> Self {
        Self {
            format,
            csv: CsvRows::new(reads_times),
            reads_times,
            row_count: 0,
            time_before: None,
            partial: Vec::new(),
            lines: 0,
        }
    }

    /// Takes the next piece; gives `take` each row that it completes.
    ///
    /// # Errors
    /// A line is no row, and what `take` fails with.
    pub fn feed(
        &mut self,
        mut text: &[u8],
        mut take: impl FnMut(Row) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        while let Some(end) = text.iter().position(|&byte| byte == b'\n') {
            let (line, behind) = text.split_at(end + 1);
            text = behind;
            if self.partial.is_empty() {
                self.line(line, &mut take)?;
            } else {
                self.keep(line)?;
                self.partial_line(&mut take)?;
            }
        }
        self.keep(text)
    }

    /// The text has ended: its last line may lack its end.
    ///
    /// # Errors
    /// As [`feed`](Self::feed).
    pub fn finish(
        &mut self,
        mut take: impl FnMut(Row) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.partial_line(&mut take)?;
        let row = self.csv.finish();
        self.give(row, &mut take)
    }

    fn keep(&mut self, part: &[u8]) -> Result<(), Failure> {
        if self.partial.len() + part.len() > LONGEST_LINE {
            self.lines += 1;
            return Err(self.too_long());
        }
        self.partial.extend_from_slice(part);
        Ok(())
    }

    fn partial_line(
        &mut self,
        take: &mut impl FnMut(Row) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut line = std::mem::take(&mut self.partial);
        self.line(&line, take)?;
        // Its memory serves the next.
        line.clear();
        self.partial = line;
        Ok(())
    }

    fn line(
        &mut self,
        mut line: &[u8],
        take: &mut impl FnMut(Row) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.lines += 1;
        if line.len() > LONGEST_LINE {
            return Err(self.too_long());
        }
        if self.lines == 1 {
            // The mark that some spreadsheets put in front.
            line = line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(line);
        }
        if self.format == InputFormat::Auto {
            match line.trim_ascii_start().first() {
                None => return Ok(()),
                Some(b'{') => self.format = InputFormat::Jsonl,
                Some(_) => self.format = InputFormat::Csv,
            }
        }
        let row = if self.format == InputFormat::Jsonl {
            json_row::parse(line, self.reads_times)
        } else {
            self.csv.line(line)
        };
        self.give(row, take)
    }

    fn give(
        &mut self,
        row: Result<Option<Row>, String>,
        take: &mut impl FnMut(Row) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Some(row) = row.map_err(|problem| self.problem(&problem))? else {
            return Ok(());
        };
        if self.reads_times {
            self.check_time(row.time)
                .map_err(|problem| self.problem(&problem))?;
        }
        take(row)
    }

    fn check_time(&mut self, time: Option<Duration>) -> Result<(), String> {
        let before = std::mem::replace(&mut self.time_before, time);
        self.row_count += 1;
        match (before, time) {
            (Some(before), Some(time)) if time < before => Err(format!(
                "the time {} is before that of the row above, {}; times may not go back",
                time.as_secs_f64(),
                before.as_secs_f64()
            )),
            (Some(_), None) => Err("no time, but the rows above have one".into()),
            (None, Some(_)) if self.row_count > 1 => {
                Err("a time, but the rows above have none".into())
            }
            _ => Ok(()),
        }
    }

    fn problem(&self, problem: &str) -> Failure {
        Failure::Content(format!("line {}: {problem}", self.lines))
    }

    fn too_long(&self) -> Failure {
        self.problem(&format!(
            "longer than {LONGEST_LINE} bytes, so this is no list of setpoints; \
             frames are read by `framelock decode`"
        ))
    }
}

/// Reads `pitch,roll,yaw`, each a whole number from 0 to 255.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn parse(text: &str) -> Result<Setpoint, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let Ok(fields) = <[&str; 3]>::try_from(fields) else {
        return Err(format!("{text:?} is not three numbers such as 127,200,74"));
    };
    let mut demands = [0; 3];
    for ((demand, field), axis) in demands.iter_mut().zip(fields).zip(AXES) {
        *demand = field
            .parse()
            .map_err(|_| format!("{axis} {field:?} {NOT_A_DEMAND}"))?;
    }
    Ok(demands.into())
}

/// A time in seconds, 0 or more.
fn seconds(number: f64) -> Option<Duration> {
    Duration::try_from_secs_f64(number).ok()
}
