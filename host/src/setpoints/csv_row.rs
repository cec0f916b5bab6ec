//! Setpoints from comma-separated values.

use std::time::Duration;

use csv_core::ReadRecordResult;
use framelock::Setpoint;

use super::{AXES, LONGEST_LINE, NOT_A_DEMAND, NOT_A_TIME, Row, TIME, seconds};

/// More than any table of setpoints has.
const MOST_COLUMNS: usize = 1024;

/// Reads lines of comma-separated values. A field in quotes may span several.
pub(super) struct CsvRows {
    reader: csv_core::Reader,
    columns: Option<Columns>,
    reads_times: bool,
    /// The fields of the record under way, one behind the other, and where each ends.
    text: Box<[u8]>,
    ends: Box<[usize]>,
    text_length: usize,
    field_count: usize,
}

/// Where pitch, roll and yaw stand, and the time if there is one to read.
#[derive(Clone, Copy)]
struct Columns {
    count: usize,
    axes: [usize; 3],
    time: Option<usize>,
}

impl Columns {
    /// Where there is no header.
    const UNNAMED: Self = Self {
        count: 3,
        axes: [0, 1, 2],
        time: None,
    };

    /// Where there is no header, and a time in front.
    const UNNAMED_WITH_TIME: Self = Self {
        count: 4,
        axes: [1, 2, 3],
        time: Some(0),
    };
}

impl CsvRows {
    pub(super) fn new(reads_times: bool) -> Self {
        Self {
            reader: csv_core::Reader::new(),
            columns: None,
            reads_times,
            text: vec![0; LONGEST_LINE].into(),
            ends: vec![0; MOST_COLUMNS].into(),
            text_length: 0,
            field_count: 0,
        }
    }

    /// Takes one line with its end; gives the row if the line completes one.
    pub(super) fn line(&mut self, mut line: &[u8]) -> Result<Option<Row>, String> {
        let mut row = None;
        while !line.is_empty() {
            let (taken, found) = self.step(line)?;
            line = line.get(taken..).unwrap_or_default();
            if found.is_some() && row.is_some() {
                return Err(
                    "a second row, behind a carriage return; end rows with a line feed".into(),
                );
            }
            row = row.or(found);
        }
        Ok(row)
    }

    /// The text has ended.
    pub(super) fn finish(&mut self) -> Result<Option<Row>, String> {
        self.step(&[]).map(|(_, row)| row)
    }

    fn step(&mut self, input: &[u8]) -> Result<(usize, Option<Row>), String> {
        let text = self.text.get_mut(self.text_length..).unwrap_or_default();
        let ends = self.ends.get_mut(self.field_count..).unwrap_or_default();
        let (result, taken, text_length, field_count) = self.reader.read_record(input, text, ends);
        self.text_length += text_length;
        self.field_count += field_count;
        match result {
            ReadRecordResult::InputEmpty | ReadRecordResult::End => Ok((taken, None)),
            ReadRecordResult::OutputFull => Err(format!(
                "a row longer than {LONGEST_LINE} bytes: is a quote not closed?"
            )),
            ReadRecordResult::OutputEndsFull => Err(format!("more than {MOST_COLUMNS} columns")),
            ReadRecordResult::Record => {
                let row = self.record();
                self.text_length = 0;
                self.field_count = 0;
                Ok((taken, row?))
            }
        }
    }

    fn field(&self, index: usize) -> &[u8] {
        let end_of = |index| self.ends.get(index).copied().unwrap_or_default();
        let start = index.checked_sub(1).map_or(0, end_of);
        let field = self.text.get(start..end_of(index)).unwrap_or_default();
        field.trim_ascii()
    }

    fn record(&mut self) -> Result<Option<Row>, String> {
        let Some(columns) = self.columns else {
            let header = self.header()?;
            let has_time = self.reads_times && self.field_count == Columns::UNNAMED_WITH_TIME.count;
            self.columns = Some(header.unwrap_or(if has_time {
                Columns::UNNAMED_WITH_TIME
            } else {
                Columns::UNNAMED
            }));
            return if header.is_some() {
                Ok(None)
            } else {
                self.record()
            };
        };
        if self.field_count != columns.count {
            return Err(format!(
                "columns: {}, expected: {}; columns beside pitch,roll,yaw need a header that names all",
                self.field_count, columns.count
            ));
        }
        let mut demands = [0; 3];
        for ((demand, column), axis) in demands.iter_mut().zip(columns.axes).zip(AXES) {
            let field = String::from_utf8_lossy(self.field(column));
            *demand = field
                .parse()
                .map_err(|_| format!("column {} ({axis}): {field:?} {NOT_A_DEMAND}", column + 1))?;
        }
        let time = columns.time.map(|column| self.time(column)).transpose()?;
        Ok(Some(Row {
            time,
            setpoint: Setpoint::from(demands),
        }))
    }

    fn time(&self, column: usize) -> Result<Duration, String> {
        let field = String::from_utf8_lossy(self.field(column));
        let time = field.parse().ok().and_then(seconds);
        time.ok_or_else(|| format!("column {} ({TIME}): {field:?} {NOT_A_TIME}", column + 1))
    }

    /// The columns by the first row's names, if it names any.
    fn header(&self) -> Result<Option<Columns>, String> {
        let place = |axis: &str| {
            let mut places = (0..self.field_count)
                .filter(|&index| self.field(index).eq_ignore_ascii_case(axis.as_bytes()));
            (places.next(), places.next())
        };
        let [(pitch, _), (roll, _), (yaw, _)] = AXES.map(place);
        if pitch.or(roll).or(yaw).is_none() {
            return Ok(None);
        }
        let time = self.reads_times.then_some(TIME);
        let mut names = AXES.into_iter().chain(time);
        if let Some(name) = names.find(|name| place(name).1.is_some()) {
            return Err(format!("the header names {name} twice"));
        }
        let (Some(pitch), Some(roll), Some(yaw)) = (pitch, roll, yaw) else {
            return Err("the header does not name all of pitch, roll and yaw".into());
        };
        Ok(Some(Columns {
            count: self.field_count,
            axes: [pitch, roll, yaw],
            time: time.and_then(|time| place(time).0),
        }))
    }
}
