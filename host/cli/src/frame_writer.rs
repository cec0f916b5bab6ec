//! Writes frames for people and programs: as JSON, comma-separated values, or columns of text.

use std::collections::{HashMap, HashSet};
use std::io::Write as _;

use anyhow::{Result, ensure};
use framelock_description::{Column, Field, KIND, Kind, UnknownName, Value};
use framelock_receiving::Protocol;

/// The offset of a frame's last byte in the stream and, if times are written, the time at which this byte arrived.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) offset: usize,
    /// In microseconds.
    pub(crate) time: Option<i64>,
}

/// The parts of the output that do not change between the frames of a kind, or of a message's view.
#[derive(Clone)]
struct KindRow {
    kind: Kind,
    /// The groups of columns that are written together. A group has three parts: the index of a field (`None` if this
    /// kind lacks the columns), the number of the first value that the group shows, and the number of columns.
    cells: Vec<(Option<usize>, usize, usize)>,
    /// The text before the value of each varying field in a JSON object, such as `,"pitch":`.
    json_names: Vec<String>,
}

impl KindRow {
    fn new(kind: &Kind, columns: &[Column]) -> Self {
        let mut places = HashMap::new();
        for (index, field) in kind.fields.iter().enumerate() {
            let values = (0..field.values()).filter(|_| field.constant.is_none());
            places.extend(values.map(|number| (field.column(number), (index, number))));
        }
        let columns = columns.iter().filter(|column| column.name != KIND);
        let found = columns.map(|column| places.get(&column.name).copied());
        let found: Vec<Option<(usize, usize)>> = found.collect();
        // Columns that this kind lacks form groups, too.
        let follows = |one: &Option<(usize, usize)>, next: &Option<(usize, usize)>| {
            one.map(|(index, number)| (index, number + 1)) == *next
        };
        let cells = found.chunk_by(follows).map(|group| {
            let (index, first) = group[0].unzip();
            (index, first.unwrap_or(0), group.len())
        });
        let names = kind.varying_fields().map(|field| &field.name);
        Self {
            kind: kind.clone(),
            cells: cells.collect(),
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
    /// The names of the kinds and messages that are written; empty if all are written.
    only: Vec<String>,
}

impl FrameWriter {
    /// Creates a writer of the kinds of frames and the messages in `only`, or of all kinds if `only` is empty. The
    /// output has only the columns of these kinds and messages.
    pub(crate) fn new(protocol: Protocol, only: &[String]) -> Result<Self> {
        let description = &protocol.description;
        let names = description.kind_names();
        for name in only {
            let is_known = names.iter().any(|own| own.eq_ignore_ascii_case(name));
            ensure!(is_known, "--only {name}: {}", UnknownName::new(name, names));
        }
        let kinds = || description.kinds_and_views();
        let is_wanted = |kind: &&Kind| kind.has_name(|name| is_among(name, only));
        let fields = kinds().filter(is_wanted).flat_map(Kind::varying_fields);
        let written: HashSet<String> = fields.flat_map(columns_of).collect();
        let mut columns = description.columns.clone();
        columns.retain(|column| column.name == KIND || written.contains(&column.name));
        Ok(Self {
            kind_rows: kinds().map(|kind| KindRow::new(kind, &columns)).collect(),
            columns,
            has_kinds: description.has_kinds(),
            only: only.to_vec(),
            protocol,
        })
    }

    /// Returns whether a frame's kind is written.
    pub(crate) fn is_wanted(&self, frame: &[u8]) -> bool {
        let kind = &self.kind_row(frame).kind;
        is_among(&kind.name, &self.only) || is_among(kind.name_of(frame), &self.only)
    }

    /// Returns the name of a frame's kind.
    pub(crate) fn kind_name<'f>(&'f self, frame: &'f [u8]) -> &'f str {
        self.kind_row(frame).kind.name_of(frame)
    }

    /// Appends the header of comma-separated values. With units, a column's name is followed by its unit in
    /// parentheses.
    pub(crate) fn append_csv_header(&self, row: &mut Vec<u8>, has_time: bool, has_units: bool) {
        if has_time {
            row.extend(b"time,");
        }
        row.extend(b"offset");
        if !self.protocol.has_setpoints() {
            row.extend(b",length");
        }
        let units = if has_units {
            self.units()
        } else {
            HashMap::new()
        };
        for column in &self.columns {
            row.push(b',');
            row.extend(column.name.as_bytes());
            if let Some(Some(unit)) = units.get(&column.name) {
                row.extend(format!(" ({unit})").as_bytes());
            }
        }
        row.push(b'\n');
    }

    /// Returns the unit of each column; `None` if the fields in the column have different units, or no unit.
    fn units(&self) -> HashMap<String, Option<&str>> {
        let mut units = HashMap::new();
        let kinds = self.kind_rows.iter().map(|row| &row.kind);
        for field in kinds.flat_map(Kind::varying_fields) {
            let unit = field.unit.as_deref();
            for name in columns_of(field) {
                let shared = units.entry(name).or_insert(unit);
                *shared = shared.filter(|other| Some(*other) == unit);
            }
        }
        units
    }

    /// Returns the parts of this frame's output that do not change.
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
        let KindRow { kind, cells, .. } = self.kind_row(frame);
        if self.has_kinds {
            row.push(b',');
            append_cell(row, &Value::Text(kind.name_of(frame).as_bytes()));
        }
        let contents = kind.contents(frame);
        for &(number, first, columns) in cells {
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
            for value in content.values() {
                value.append_json_to(row);
                row.push(b',');
            }
            // A bracket replaces the last comma. No array is empty, so there is a comma.
            row.pop();
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

    /// Appends a frame's length, its kind and its fields: the name, the values and the unit. Values are padded to
    /// at least three characters, so that they form columns.
    pub(crate) fn append_text(&self, row: &mut Vec<u8>, frame: &[u8]) {
        if !self.protocol.has_setpoints() {
            row.extend(b"   length ");
            append_aligned(row, 3, |row| append_number(row, frame.len()));
        }
        let KindRow { kind, .. } = self.kind_row(frame);
        if self.has_kinds {
            row.extend(b"   kind ");
            row.extend(kind.name_of(frame).as_bytes());
        }
        for (field, content) in kind.values(frame) {
            row.extend(b"   ");
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

/// Returns whether `name` is one of `names`. If `names` is empty, returns true for every name.
fn is_among(name: &str, names: &[String]) -> bool {
    names.is_empty() || names.iter().any(|one| one.eq_ignore_ascii_case(name))
}

/// Returns the names of a field's columns.
fn columns_of(field: &Field) -> impl Iterator<Item = String> {
    (0..field.values()).map(|number| field.column(number))
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
        row.insert(from, b'"');
        if row[from + 1..].contains(&b'"') {
            let text = row.split_off(from + 1);
            for part in text.split_inclusive(|byte| *byte == b'"') {
                row.extend(part);
                row.extend(part.ends_with(b"\"").then_some(b'"'));
            }
        }
        row.push(b'"');
    }
}
