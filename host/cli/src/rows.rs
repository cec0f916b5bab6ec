//! Makes frames from rows of separated values or JSON, one frame per row.

mod json;
mod separated;

use std::io::{self, BufRead, BufReader, Read};
use std::time::Duration;

use anyhow::{Result, anyhow, bail};
use clap::ValueEnum;
use framelock_description::Column;
use framelock_description::text::{nearest, quote};
use framelock_receiving::Protocol;
use serde_json::Value;

use crate::input::Input;

/// The format of the rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum InputFormat {
    /// JSON if the text begins with a brace or a bracket, otherwise separated values
    Auto,
    /// Values separated by commas, semicolons or tabs, with or without a header
    Csv,
    /// A JSON object per line, or an array of objects
    Jsonl,
}

/// A row of the input.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Row {
    /// The due time, if the text has times and times are read.
    pub(crate) time: Option<Duration>,
    /// The frame with its values.
    pub(crate) frame: Vec<u8>,
}

/// The values of a row, each of any type. Unknown columns or fields are ignored.
struct Fields<'a> {
    columns: &'a [Column],
    /// The unknown names in the row.
    others: Vec<String>,
    time: Option<Value>,
    /// The values, in the order of the columns.
    values: Vec<Option<Value>>,
}

/// The line number of a row, and its fields or an error.
type NumberedFields<'a> = (u64, Result<Fields<'a>, String>);

/// Returns the rows of a text, each as soon as its line has arrived.
///
/// With `reads_times`, also reads times in seconds from a column or field `time`. If a table without a header has one
/// more column than a frame has values, the first column contains the times. Times must not decrease.
pub(crate) fn rows<'a>(
    input: Input<'a>,
    format: InputFormat,
    frame: &'a Protocol,
    reads_times: bool,
) -> Result<impl Iterator<Item = Result<Row>> + 'a> {
    let name = input.name.clone();
    let mut input = BufReader::new(input);
    let (beginning, first) = beginning(&mut input)?;
    if beginning.starts_with(b"\xFF\xFE") || beginning.starts_with(b"\xFE\xFF") {
        bail!(
            "{name} is UTF-16 text: save it as UTF-8 or as plain CSV, or convert it, for example by \
             iconv -f UTF-16 -t UTF-8"
        );
    }
    let is_json = match format {
        InputFormat::Auto => first.starts_with(b"{") || first.starts_with(b"["),
        InputFormat::Csv => false,
        InputFormat::Jsonl => true,
    };
    let mut input = io::Cursor::new(beginning).chain(input);
    let columns = frame.description.columns.as_slice();
    let lines: Box<dyn Iterator<Item = io::Result<NumberedFields<'a>>> + 'a> = if !is_json {
        let delimiter = separated::delimiter(&first);
        Box::new(separated::lines(
            input,
            &frame.description,
            delimiter,
            reads_times,
        ))
    } else if first.starts_with(b"[") {
        let mut text = String::new();
        input.read_to_string(&mut text)?;
        Box::new(json::array(&text, columns).into_iter().map(Ok))
    } else {
        Box::new(json::lines(input, columns))
    };
    let mut before = None;
    Ok(lines.map(move |line| {
        let (number, fields) = line?;
        let row = fields.and_then(|fields| {
            let time = fields.time.as_ref().filter(|_| reads_times);
            let time = time.map(seconds).transpose()?;
            let frame = frame.description.encode(&fields.values);
            let frame = frame.map_err(|why| fields.told(why))?;
            check_order(before.as_ref(), time)?;
            Ok(Row { time, frame })
        });
        before = row.as_ref().ok().cloned();
        row.map_err(|problem| anyhow!("{name}: line {number}: {problem}"))
    }))
}

/// Reads a text up to the first line that is neither blank nor a comment. Returns all lines that were read, and a copy
/// of the last line.
fn beginning(input: &mut impl BufRead) -> io::Result<(Vec<u8>, Vec<u8>)> {
    let mut beginning = Vec::new();
    loop {
        let from = beginning.len();
        let is_end = input.read_until(b'\n', &mut beginning)? == 0;
        // Some spreadsheets begin a file with a byte order mark.
        if let Some(text) = beginning.strip_prefix("\u{FEFF}".as_bytes()) {
            beginning = text.to_vec();
        }
        let line = beginning.get(from..).unwrap_or_default().trim_ascii();
        if is_end || !(line.is_empty() || line.starts_with(b"#")) {
            let line = line.to_vec();
            return Ok((beginning, line));
        }
    }
}

impl<'a> Fields<'a> {
    fn new(columns: &'a [Column]) -> Self {
        Self {
            columns,
            others: Vec::new(),
            time: None,
            values: vec![None; columns.len()],
        }
    }

    /// Returns the slots for the values with this name: several slots for an array, none for an unknown name.
    fn places(&mut self, name: &str) -> Result<&mut [Option<Value>], String> {
        let is_it = |column: &Column| column.name == name || column.array.as_deref() == Some(name);
        let from = self.columns.iter().position(is_it).unwrap_or_default();
        let last = self.columns.iter().rposition(is_it);
        let places = match name {
            "time" => std::slice::from_mut(&mut self.time),
            _ => self
                .values
                .get_mut(from..last.map_or(from, |last| last + 1))
                .unwrap_or_default(),
        };
        if places.is_empty() {
            self.others.push(name.to_owned());
        }
        if places.iter().any(Option::is_some) {
            return Err(format!("duplicate field `{name}`"));
        }
        Ok(places)
    }

    /// Returns the error message `why`. If `why` reports a missing field, appends the unknown name in this row that is
    /// most similar to the field's name.
    fn told(&self, why: String) -> String {
        let missing = why.strip_prefix("missing field `");
        let missing = missing.and_then(|name| name.strip_suffix('`'));
        let others: Vec<&str> = self.others.iter().map(String::as_str).collect();
        let nearest = missing.map(|name| nearest(name, &others));
        why + &nearest.unwrap_or_default()
    }
}

/// Stores a value, or the values of an array, in their slots.
fn fill(places: &mut [Option<Value>], name: &str, value: Value) -> Result<(), String> {
    let values = match value {
        Value::Array(values) => values,
        value => vec![value],
    };
    let (given, wanted) = (values.len(), places.len());
    if given != wanted {
        return Err(format!("{name} has {given} values, but needs {wanted}"));
    }
    for (place, value) in places.iter_mut().zip(values) {
        *place = Some(value);
    }
    Ok(())
}

fn seconds(value: &Value) -> Result<Duration, String> {
    let seconds = value.as_f64();
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| {
        let value = quote(value);
        format!("time {value} is not a number of seconds, 0 or more")
    })
}

/// Checks that a time is not earlier than the time of the row before.
fn check_order(before: Option<&Row>, time: Option<Duration>) -> Result<(), String> {
    match before.map(|before| (before.time, time)) {
        Some((Some(before), Some(time))) if time < before => Err(format!(
            "the time {time:?} is earlier than {before:?}, the time of the row above; times may not decrease"
        )),
        Some((Some(_), None)) => Err("this row has no time, but the rows above have times".into()),
        Some((None, Some(_))) => Err("this row has a time, but the rows above have none".into()),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
