//! Writes frames for people and programs: as JSON, comma-separated values, or columns of text. Each value is appended
//! to a row, digit by digit.

use std::collections::{HashMap, HashSet};
use std::io::Write as _;

use anyhow::{Result, bail};
use framelock_description::{Column, Field, KIND, Kind, UnknownName, Value};
use framelock_receiving::Protocol;

/// The offset of a frame's last byte in the stream and, if times are written, the time at which this byte arrived.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) offset: usize,
    /// In microseconds.
    pub(crate) time: Option<i64>,
}

/// The parts of the output that do not change between the frames of a kind or of a view.
#[derive(Clone)]
struct KindRow {
    kind: Kind,
    is_wanted: bool,
    /// The groups of columns that are written together: the index of a field, the number of its first value in them, and
    /// the number of columns. There is no field for columns that this kind lacks.
    cells: Vec<(Option<usize>, usize, usize)>,
    /// The text before the value of each varying field in a JSON object, such as `,"pitch":`.
    json_names: Vec<String>,
}

impl KindRow {
    fn new(kind: &Kind, columns: &[Column], is_wanted: bool) -> Self {
        let mut places = HashMap::new();
        for (index, field) in kind.fields.iter().enumerate() {
            let values = (0..field.values()).filter(|_| field.constant.is_none());
            places.extend(values.map(|number| (field.column(number), (index, number))));
        }
        let mut cells: Vec<(Option<usize>, usize, usize)> = Vec::new();
        for column in columns.iter().filter(|column| column.name != KIND) {
            let (field, number) = places.get(&column.name).copied().unzip();
            match cells.last_mut() {
                Some((before, first, columns))
                    if *before == field
                        && number.is_none_or(|number| *first + *columns == number) =>
                {
                    *columns += 1;
                }
                _ => cells.push((field, number.unwrap_or(0), 1)),
            }
        }
        let names = kind.varying_fields().map(|field| &field.name);
        Self {
            kind: kind.clone(),
            is_wanted,
            cells,
            json_names: names.map(|name| format!(",\"{name}\":")).collect(),
        }
    }
}

/// Writes the frames of a protocol.
#[derive(Clone)]
pub(crate) struct FrameWriter {
    pub(crate) protocol: Protocol,
    /// The parts of the output that do not change, for each kind and each view.
    kind_rows: Vec<KindRow>,
    /// The columns of the kinds that are written.
    columns: Vec<Column>,
    has_kinds: bool,
    /// The names of the selected messages, if not all are selected.
    only: Vec<String>,
}

impl FrameWriter {
    /// Creates a writer of all kinds.
    pub(crate) fn new(protocol: Protocol) -> Self {
        let mut new = Self {
            kind_rows: Vec::new(),
            columns: protocol.description.columns.clone(),
            has_kinds: protocol.description.has_kinds(),
            only: Vec::new(),
            protocol,
        };
        new.write_only(|_| true);
        new
    }

    /// Limits the output to the kinds of frames and the messages with these names. Only the columns of these kinds and
    /// messages remain.
    pub(crate) fn only(&mut self, names: &[String]) -> Result<()> {
        let description = &self.protocol.description;
        for name in names {
            let is_equal = |own: &str| own.eq_ignore_ascii_case(name);
            if !description
                .kinds_and_views()
                .any(|kind| kind.has_name(is_equal))
            {
                bail!(
                    "--only {name}: {}",
                    UnknownName::new(name, description.kind_names())
                );
            }
        }
        self.only = names.to_vec();
        self.write_only(|kind| names.iter().any(|name| kind.eq_ignore_ascii_case(name)));
        Ok(())
    }

    fn write_only(&mut self, is_wanted: impl Fn(&str) -> bool) {
        let description = &self.protocol.description;
        let kinds = description.kinds_and_views();
        let wanted = kinds.filter(|kind| kind.has_name(&is_wanted));
        let fields = wanted.flat_map(Kind::varying_fields);
        let names: HashSet<String> = fields
            .flat_map(|field| (0..field.values()).map(|number| field.column(number)))
            .collect();
        self.columns
            .retain(|column| column.name == KIND || names.contains(&column.name));
        let kinds = description.kinds_and_views();
        let rows = kinds.map(|kind| KindRow::new(kind, &self.columns, is_wanted(&kind.name)));
        self.kind_rows = rows.collect();
    }

    /// Returns whether a frame's kind is written.
    pub(crate) fn is_wanted(&self, frame: &[u8]) -> bool {
        let KindRow {
            kind, is_wanted, ..
        } = self.kind_row(frame);
        let is_named = |name: &String| name.eq_ignore_ascii_case(kind.name_of(frame));
        *is_wanted || self.only.iter().any(is_named)
    }

    /// Returns the name of a frame's kind.
    pub(crate) fn kind_name<'f>(&'f self, frame: &'f [u8]) -> &'f str {
        self.kind_row(frame).kind.name_of(frame)
    }

    /// Appends the header of comma-separated values. With units, a column's name is followed by its unit in parentheses.
    pub(crate) fn append_csv_header(&self, row: &mut Vec<u8>, has_time: bool, has_units: bool) {
        row.extend(if has_time {
            &b"time,offset"[..]
        } else {
            b"offset"
        });
        if !self.protocol.has_setpoints() {
            row.extend(b",length");
        }
        for column in &self.columns {
            row.push(b',');
            row.extend(column.name.as_bytes());
            if let Some(unit) = self.unit(column).filter(|_| has_units) {
                row.extend(format!(" ({unit})").as_bytes());
            }
        }
        row.push(b'\n');
    }

    /// Returns the unit of a column, if all its fields have the same.
    fn unit(&self, column: &Column) -> Option<&str> {
        let is_in = |field: &&Field| (0..field.values()).any(|it| field.column(it) == column.name);
        let rows = self.kind_rows.iter();
        let fields = rows.flat_map(|row| row.kind.varying_fields().filter(is_in));
        let mut units = fields.map(|field| field.unit.as_deref());
        let unit = units.next()?;
        units.all(|other| other == unit).then_some(unit)?
    }

    /// Returns how to write this frame.
    #[inline]
    fn kind_row(&self, frame: &[u8]) -> &KindRow {
        match &*self.kind_rows {
            [only] => only,
            rows => &rows[self.protocol.description.view_number(frame)],
        }
    }

    /// Appends a frame as comma-separated values.
    pub(crate) fn append_csv(&self, row: &mut Vec<u8>, place: &Place, frame: &[u8]) {
        if let Some(time) = place.time {
            append_time(row, time, 0);
            row.push(b',');
        }
        append_number(row, place.offset);
        if !self.protocol.has_setpoints() {
            row.push(b',');
            append_number(row, frame.len());
        }
        let row_parts = self.kind_row(frame);
        let kind = &row_parts.kind;
        if self.has_kinds {
            row.push(b',');
            append_cell(row, &Value::Text(kind.name_of(frame).as_bytes()));
        }
        let contents = kind.contents(frame);
        for &(number, first, columns) in &row_parts.cells {
            match number.and_then(|number| contents.of(&kind.fields[number])) {
                Some(content) if first + columns == 1 => {
                    row.push(b',');
                    append_cell(row, &content.value());
                }
                Some(content) => {
                    let mut values = content.values();
                    if first > 0 {
                        values.nth(first - 1);
                    }
                    for value in values.take(columns) {
                        row.push(b',');
                        append_cell(row, &value);
                    }
                    let written = content.count().saturating_sub(first).min(columns);
                    row.resize(row.len() + columns - written, b',');
                }
                None => row.resize(row.len() + columns, b','),
            }
        }
        row.push(b'\n');
    }

    /// Appends a frame as a JSON object.
    pub(crate) fn append_json(&self, row: &mut Vec<u8>, place: &Place, frame: &[u8]) {
        match place.time {
            Some(time) => {
                row.extend(b"{\"time\":");
                append_time(row, time, 0);
                row.extend(b",\"offset\":");
            }
            None => row.extend(b"{\"offset\":"),
        }
        append_number(row, place.offset);
        if !self.protocol.has_setpoints() {
            row.extend(b",\"length\":");
            append_number(row, frame.len());
        }
        let KindRow {
            kind, json_names, ..
        } = self.kind_row(frame);
        if self.has_kinds {
            row.extend(b",\"kind\":");
            Value::Text(kind.name_of(frame).as_bytes()).append_json_to(row);
        }
        let contents = kind.contents(frame);
        for (field, name) in kind.varying_fields().zip(json_names) {
            let Some(content) = contents.of(field) else {
                continue;
            };
            if !field.is_array() {
                let value = content.value();
                if value != Value::Missing {
                    row.extend(name.as_bytes());
                    value.append_json_to(row);
                }
                continue;
            }
            row.extend(name.as_bytes());
            row.push(b'[');
            for (number, value) in content.values().enumerate() {
                if number > 0 {
                    row.push(b',');
                }
                value.append_json_to(row);
            }
            row.push(b']');
        }
        row.push(b'}');
    }

    /// Appends a frame as columns for people to read.
    pub(crate) fn append_columns(&self, row: &mut Vec<u8>, place: &Place, frame: &[u8]) {
        if let Some(time) = place.time {
            append_time(row, time, 13);
            row.extend(b" s  ");
        }
        row.extend(b"byte ");
        append_aligned(row, 10, |row| append_number(row, place.offset));
        self.append_text(row, frame);
    }

    /// Appends a frame's length, its kind and its fields: the name, the values and the unit. Numbers are padded to three
    /// characters, so that they form columns.
    pub(crate) fn append_text(&self, row: &mut Vec<u8>, frame: &[u8]) {
        if !self.protocol.has_setpoints() {
            row.extend(b"   length ");
            append_aligned(row, 3, |row| append_number(row, frame.len()));
        }
        let between = b"   ";
        let KindRow { kind, .. } = self.kind_row(frame);
        if self.has_kinds {
            row.extend(b"   kind ");
            row.extend(kind.name_of(frame).as_bytes());
        }
        for (field, content) in kind.values(frame) {
            row.extend(between);
            row.extend(field.name.as_bytes());
            for value in content.values() {
                row.push(b' ');
                append_aligned(row, 3, |row| value.append_to(row));
            }
            if let Some(unit) = &field.unit {
                row.push(b' ');
                row.extend(unit.as_bytes());
            }
        }
    }
}

fn append_number(row: &mut Vec<u8>, number: usize) {
    Value::Unsigned(number as u64).append_to(row);
}

/// Appends a time in microseconds as seconds.
#[allow(
    clippy::cast_precision_loss,
    reason = "times until the year 2255 are exact"
)]
fn append_time(row: &mut Vec<u8>, time: i64, width: usize) {
    // Writing to memory cannot fail.
    let _ = write!(row, "{:>width$.6}", time as f64 / 1e6);
}

/// Appends the text that `append` writes, right-aligned in a column of this width.
fn append_aligned(row: &mut Vec<u8>, width: usize, append: impl FnOnce(&mut Vec<u8>)) {
    let from = row.len();
    append(row);
    let missing = (from + width).saturating_sub(row.len());
    row.extend(std::iter::repeat_n(b' ', missing));
    row[from..].rotate_right(missing);
}

/// Appends a cell of comma-separated values, in quotation marks if necessary.
#[inline]
fn append_cell(row: &mut Vec<u8>, value: &Value) {
    if value.is_text() {
        append_text_cell(row, value);
    } else {
        value.append_to(row);
    }
}

#[inline(never)]
fn append_text_cell(row: &mut Vec<u8>, value: &Value) {
    let from = row.len();
    value.append_to(row);
    // Some readers drop the blanks at the ends of a cell without quotation marks.
    let text = &row[from..];
    let has_end_blank = text.first() == Some(&b' ') || text.last() == Some(&b' ');
    if has_end_blank || text.iter().any(|byte| matches!(byte, b',' | b'"')) {
        let text = row.split_off(from);
        let quoted = from + 1..from + 1 + 2 * text.len();
        row.resize(quoted.end, 0);
        let (_, _, length) = csv_core::quote(&text, &mut row[quoted.clone()], b'"', b'"', true);
        row[from] = b'"';
        row.truncate(quoted.start + length);
        row.push(b'"');
    }
}
