//! Setpoints from text: comma-separated values or JSON lines.

use framelock::Setpoint;

use super::{InputFormat, csv_row::CsvRows, json_row};
use crate::stream::Failure;

/// More than any row of setpoints needs. Memory stays bounded whatever the input is.
pub(super) const LONGEST_LINE: usize = 64 * 1024;

/// Cuts text that arrives in pieces into lines, and lines into setpoints.
pub(super) struct Rows {
    format: InputFormat,
    csv: CsvRows,
    /// The beginning of a line whose end has not arrived yet.
    partial: Vec<u8>,
    lines: u64,
}

impl Rows {
    pub(super) fn new(format: InputFormat) -> Self {
        Self {
            format,
            csv: CsvRows::new(),
            partial: Vec::new(),
            lines: 0,
        }
    }

    /// Takes the next piece; gives `take` each setpoint that it completes.
    pub(super) fn feed(
        &mut self,
        mut text: &[u8],
        mut take: impl FnMut(Setpoint) -> Result<(), Failure>,
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
    pub(super) fn finish(
        &mut self,
        mut take: impl FnMut(Setpoint) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.partial_line(&mut take)?;
        match self.csv.finish() {
            Ok(None) => Ok(()),
            Ok(Some(setpoint)) => take(setpoint),
            Err(problem) => Err(self.problem(&problem)),
        }
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
        take: &mut impl FnMut(Setpoint) -> Result<(), Failure>,
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
        take: &mut impl FnMut(Setpoint) -> Result<(), Failure>,
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
        let setpoint = if self.format == InputFormat::Jsonl {
            json_row::parse(line)
        } else {
            self.csv.line(line)
        };
        match setpoint {
            Ok(None) => Ok(()),
            Ok(Some(setpoint)) => take(setpoint),
            Err(problem) => Err(self.problem(&problem)),
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
