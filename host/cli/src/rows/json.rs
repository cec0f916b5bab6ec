//! Reads rows from JSON objects.

use std::fmt;
use std::io::{self, BufRead};

use framelock_description::Column;
use serde::de::{DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, Visitor};
use serde_json::value::RawValue;

use super::{Fields, NumberedFields, fill};

/// Reads a text with one object per line.
pub(super) fn lines<'a>(
    input: impl BufRead + 'a,
    columns: &'a [Column],
) -> impl Iterator<Item = io::Result<NumberedFields<'a>>> {
    let lines = (1..).zip(input.split(b'\n'));
    lines.filter_map(move |(number, line)| match line {
        Ok(line) => match line.trim_ascii() {
            [] | [b'#', ..] => None,
            line => Some(Ok((number, fields(line, columns)))),
        },
        Err(error) => Some(Err(error)),
    })
}

/// Reads a text that is an array of objects.
pub(super) fn array<'a>(text: &str, columns: &'a [Column]) -> Vec<NumberedFields<'a>> {
    let values = match serde_json::from_str::<Vec<&RawValue>>(text) {
        Ok(values) => values,
        Err(error) => return vec![(error.line() as u64, Err(told(&error)))],
    };
    let (mut number, mut counted) = (1, 0);
    let rows = values.into_iter().map(|value| {
        let from = value.get().as_ptr().addr() - text.as_ptr().addr();
        let before = text.get(counted..from).unwrap_or_default();
        number += before.matches('\n').count() as u64;
        counted = from;
        (number, fields(value.get().as_bytes(), columns))
    });
    rows.collect()
}

/// Returns the message of an error without its line number, because the caller adds the row's line. Keeps the column if
/// the error is in the row's first line.
fn told(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let what = text
        .rsplit_once(" at line ")
        .map_or(&*text, |(what, _)| what);
    match error.line() {
        1 => format!("{what}, at column {}", error.column()),
        _ => what.to_owned(),
    }
}

fn fields<'a>(line: &[u8], columns: &'a [Column]) -> Result<Fields<'a>, String> {
    if !line.starts_with(b"{") {
        let fields = columns.iter().take(3).zip(["127", "200", "74"]);
        let fields = fields.map(|(column, value)| format!("\"{}\":{value}", column.name));
        let example = fields.collect::<Vec<_>>().join(",");
        return Err(format!("not a JSON object such as {{{example}}}"));
    }
    let mut deserializer = serde_json::Deserializer::from_slice(line);
    let fields = Object(columns).deserialize(&mut deserializer);
    let fields = fields.and_then(|fields| deserializer.end().map(|()| fields));
    fields.map_err(|error| told(&error))
}

/// Deserializes a JSON object that has these columns.
struct Object<'a>(&'a [Column]);

impl<'de, 'a> DeserializeSeed<'de> for Object<'a> {
    type Value = Fields<'a>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Fields<'a>, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de, 'a> Visitor<'de> for Object<'a> {
    type Value = Fields<'a>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Fields<'a>, M::Error> {
        let mut fields = Fields::new(self.0);
        while let Some(name) = map.next_key::<String>()? {
            let places = fields.places(&name).map_err(M::Error::custom)?;
            if places.is_empty() {
                map.next_value::<IgnoredAny>()?;
            } else {
                fill(places, &name, map.next_value()?).map_err(M::Error::custom)?;
            }
        }
        Ok(fields)
    }
}
