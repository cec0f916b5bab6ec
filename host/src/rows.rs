//! Frames from text: comma-separated values or JSON lines, a row for each.

use std::fmt;
use std::io::{self, BufRead, BufReader, Read};
use std::time::Duration;

use anyhow::{Result, anyhow};
use clap::ValueEnum;
use csv::{ByteRecord, ReaderBuilder, StringRecord, Terminator, Trim};
use serde::de::{DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, Visitor};
use serde_json::Value;

use crate::frame::{Column, Frame};
use crate::input::Input;

/// How rows are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum InputFormat {
    /// JSON lines if the first thing in it is a brace, else comma-separated values
    Auto,
    /// Comma-separated values, with or without a header
    Csv,
    /// A JSON object per line
    Jsonl,
}

/// A row of a text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Row {
    /// When it is due, if the text says so and times are read.
    pub(crate) time: Option<Duration>,
    /// The frame with its values.
    pub(crate) frame: Vec<u8>,
}

/// What a row says, of whatever type; further columns or fields mean nothing.
struct Fields<'a> {
    columns: &'a [Column],
    time: Option<Value>,
    /// In the order of the columns.
    values: Vec<Option<Value>>,
}

/// The number of a row's line, and its fields or what is wrong with them.
type Line<'a> = (u64, Result<Fields<'a>, String>);

/// The rows of a text, each as soon as its line has come.
///
/// With `reads_times`, times in seconds are read too: a column or field `time`, or the first of one
/// column more than there are values without a header. They may not go back.
pub(crate) fn rows<'a>(
    input: Input<'a>,
    format: InputFormat,
    frame: &'a Frame,
    reads_times: bool,
) -> Result<impl Iterator<Item = Result<Row>> + 'a> {
    let name = input.name.clone();
    let mut input = BufReader::new(input);
    let mut beginning = Vec::new();
    while beginning.trim_ascii().is_empty() && input.read_until(b'\n', &mut beginning)? > 0 {}
    // Some spreadsheets put it in front.
    let byte_order_mark = "\u{FEFF}".as_bytes();
    let beginning = beginning
        .strip_prefix(byte_order_mark)
        .unwrap_or(&beginning);
    let is_json = match format {
        InputFormat::Auto => beginning.trim_ascii_start().starts_with(b"{"),
        InputFormat::Csv => false,
        InputFormat::Jsonl => true,
    };
    let input = io::Cursor::new(beginning.to_vec()).chain(input);
    let columns = frame.columns.as_slice();
    let lines: Box<dyn Iterator<Item = io::Result<Line<'a>>> + 'a> = if is_json {
        Box::new(json_lines(input, columns))
    } else {
        Box::new(csv_lines(input, columns, reads_times))
    };
    let mut before = None;
    Ok(lines.map(move |line| {
        let (number, fields) = line?;
        let row = fields.and_then(|fields| {
            let time = fields.time.as_ref().filter(|_| reads_times);
            let time = time.map(seconds).transpose()?;
            let frame = frame.described.encode(&fields.values)?;
            check_order(before.as_ref(), time)?;
            Ok(Row { time, frame })
        });
        before = row.as_ref().ok().cloned();
        row.map_err(|problem| anyhow!("{name}: line {number}: {problem}"))
    }))
}

fn csv_lines<'a>(
    input: impl Read + 'a,
    columns: &'a [Column],
    reads_times: bool,
) -> impl Iterator<Item = io::Result<Line<'a>>> {
    // A line feed at the end of every line, so that a row's number follows from the reader's.
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .terminator(Terminator::Any(b'\n'))
        .from_reader(input.chain(&b"\n"[..]));
    let (mut header, mut record) = (None, ByteRecord::new());
    let mut next = move || -> io::Result<Option<Line<'a>>> {
        while reader.read_byte_record(&mut record)? {
            // What a column that means nothing holds need not be UTF-8.
            let record = StringRecord::from_byte_record_lossy(record.clone());
            if let Some(fields) = csv_fields(&record, columns, &mut header, reads_times) {
                return Ok(Some((reader.position().line() - 1, fields)));
            }
        }
        Ok(None)
    };
    std::iter::from_fn(move || next().transpose())
}

/// The fields of a record; none if it is blank or the header.
fn csv_fields<'a>(
    record: &StringRecord,
    columns: &'a [Column],
    header: &mut Option<StringRecord>,
    reads_times: bool,
) -> Option<Result<Fields<'a>, String>> {
    if record.iter().eq([""]) {
        return None;
    }
    let is_column = |name: &str| columns.iter().any(|column| column.name == name);
    if header.is_none() {
        let names: StringRecord = record.iter().map(str::to_ascii_lowercase).collect();
        if names.iter().any(is_column) {
            *header = Some(names);
            return None;
        }
    }
    let names = || columns.iter().map(|column| &*column.name);
    let time = (reads_times && record.len() == columns.len() + 1).then_some("time");
    let header = header.get_or_insert_with(|| time.into_iter().chain(names()).collect());
    if record.len() != header.len() {
        return Some(Err(format!(
            "columns: {}, expected: {}; columns beside {} need a header that names all",
            record.len(),
            header.len(),
            names().collect::<Vec<_>>().join(",")
        )));
    }
    let mut fields = Fields::new(columns);
    let set = |(name, text): (&str, &str)| {
        let is_text = |column: &Column| column.name == name && column.is_text;
        let is_text = columns.iter().any(is_text);
        match fields.places(name)? {
            [] => Ok(()),
            places => fill(
                places,
                name,
                if is_text { text.into() } else { inferred(text) },
            ),
        }
    };
    Some(header.iter().zip(record).try_for_each(set).map(|()| fields))
}

/// A number, if it is one.
fn inferred(text: &str) -> Value {
    let whole = text.parse::<u64>().map(Value::from);
    let signed = || text.parse::<i64>().map(Value::from);
    let number = || text.parse::<f64>().map(Value::from);
    whole
        .or_else(|_| signed())
        .or_else(|_| number())
        .unwrap_or_else(|_| text.into())
}

fn json_lines<'a>(
    input: impl BufRead + 'a,
    columns: &'a [Column],
) -> impl Iterator<Item = io::Result<Line<'a>>> {
    let lines = (1..).zip(input.split(b'\n'));
    lines.filter_map(move |(number, line)| match line {
        Ok(line) if line.trim_ascii().is_empty() => None,
        Ok(line) => Some(Ok((number, json_fields(line.trim_ascii(), columns)))),
        Err(error) => Some(Err(error)),
    })
}

fn json_fields<'a>(line: &[u8], columns: &'a [Column]) -> Result<Fields<'a>, String> {
    if !line.starts_with(b"{") {
        let fields = columns.iter().take(3).zip(["127", "200", "74"]);
        let fields = fields.map(|(column, value)| format!("\"{}\":{value}", column.name));
        let example = fields.collect::<Vec<_>>().join(",");
        return Err(format!("not a JSON object such as {{{example}}}"));
    }
    let mut deserializer = serde_json::Deserializer::from_slice(line);
    let fields = Object(columns).deserialize(&mut deserializer);
    let fields = fields.and_then(|fields| deserializer.end().map(|()| fields));
    // To the library, this line is the first.
    fields.map_err(|error| {
        error
            .to_string()
            .replace(" at line 1 column ", ", at column ")
    })
}

/// A JSON object with these columns.
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

impl<'a> Fields<'a> {
    fn new(columns: &'a [Column]) -> Self {
        Self {
            columns,
            time: None,
            values: vec![None; columns.len()],
        }
    }

    /// Where the values of that name go, an array's all; nowhere if it means nothing.
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
        if places.iter().any(Option::is_some) {
            return Err(format!("duplicate field `{name}`"));
        }
        Ok(places)
    }
}

/// Puts a value, or those of an array, in its places.
fn fill(places: &mut [Option<Value>], name: &str, value: Value) -> Result<(), String> {
    let values = match value {
        Value::Array(values) => values,
        value => vec![value],
    };
    let (given, wanted) = (values.len(), places.len());
    if given != wanted {
        return Err(format!(
            "{name} has {given} values, and {wanted} are wanted"
        ));
    }
    for (place, value) in places.iter_mut().zip(values) {
        *place = Some(value);
    }
    Ok(())
}

fn seconds(value: &Value) -> Result<Duration, String> {
    let seconds = value.as_f64();
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    // Something that was not meant to be a number may be long.
    let value: String = value.to_string().chars().take(40).collect();
    time.ok_or(format!(
        "time {value} is not a number of seconds, 0 or more"
    ))
}

/// That a time is not before that of the row above, if there is one.
fn check_order(before: Option<&Row>, time: Option<Duration>) -> Result<(), String> {
    match before.map(|before| (before.time, time)) {
        Some((Some(before), Some(time))) if time < before => Err(format!(
            "the time {} is before that of the row above, {}; times may not go back",
            time.as_secs_f64(),
            before.as_secs_f64()
        )),
        Some((Some(_), None)) => Err("no time, but the rows above have one".into()),
        Some((None, Some(_))) => Err("a time, but the rows above have none".into()),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use framelock::{Bin, Format};

    use super::*;

    /// Gives a few bytes at a time.
    struct Pieces<'a>(&'a [u8], usize);

    impl Read for Pieces<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let length = buffer.len().min(self.1);
            self.0.read(buffer.get_mut(..length).unwrap())
        }
    }

    fn read(text: impl AsRef<[u8]>, piece: usize, reads_times: bool) -> Result<Vec<Row>> {
        let input = Input::new("moves", Pieces(text.as_ref(), piece));
        let frame = Frame::named("bin").unwrap();
        rows(input, InputFormat::Auto, &frame, reads_times)?.collect()
    }

    fn row(time: Option<u64>, setpoint: [u8; 3]) -> Row {
        Row {
            time: time.map(Duration::from_millis),
            frame: Bin::encode(setpoint.into()).to_vec(),
        }
    }

    #[test]
    fn setpoints_are_spelled_in_many_ways_and_come_in_pieces() {
        let two = [row(None, [1, 2, 3]), row(None, [4, 5, 6])];
        for text in [
            "1,2,3\n4,5,6\n",
            "1,2,3\r\n4,5,6\r\n",
            "1,2,3\n4,5,6",
            " 1 , 2 , 3 \n\n\"4\",5,6\n",
            "\n \n1,2,3\n  \t\n4,5,6\n \n",
            "pitch,roll,yaw\n1,2,3\n4,5,6\n",
            "\u{FEFF}pitch,roll,yaw\n1,2,3\n4,5,6\n",
            "\u{FEFF}1,2,3\n4,5,6\n",
            "time,Yaw,ROLL,pitch,note\n6,3,2,1,\"a, b\"\n5,6,5,4,\"over\ntwo lines\"\n",
            "{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6}\n",
            "\n \n{ \"yaw\": 3, \"roll\": 2, \"pitch\": 1, \"time\": \"x\" }\r\n\n{\"pitch\":4,\"roll\":5,\"yaw\":6}",
            "\u{FEFF}{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6,\"more\":[{}]}\n",
        ] {
            for length in [1, 2, 3, 5, 8, 1000] {
                assert_eq!(read(text, length, false).unwrap(), two, "{length}: {text}");
            }
        }
        // What a column that means nothing holds need not be UTF-8.
        let latin_1 = b"pitch,roll,yaw,note\n1,2,3,H\xF6he\n4,5,6,\n";
        assert_eq!(read(latin_1, 9, false).unwrap(), two);
        for nothing in ["", "\n\n", "pitch,roll,yaw\n", "pitch,roll,yaw"] {
            assert_eq!(read(nothing, 9, false).unwrap(), []);
        }
    }

    #[test]
    fn times_are_read_where_they_are_wanted() {
        let two = [row(Some(0), [1, 2, 3]), row(Some(50), [4, 5, 6])];
        for text in [
            "0,1,2,3\n5e-2,4,5,6\n",
            "time,yaw,pitch,roll\n0.000,3,1,2\n0.05,6,4,5\n",
            "{\"time\":0,\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6,\"time\":0.05}\n",
        ] {
            assert_eq!(read(text, 9, true).unwrap(), two, "{text}");
        }
        assert_eq!(read("1,2,3\n", 9, true).unwrap(), [row(None, [1, 2, 3])]);
    }

    /// A text, in which `\n` and `\r` are what they are called, and what is wrong with it.
    const WRONG: &str = r#"
        1,2,256 => line 1: yaw 256 is not a whole number from 0 to 255
        1,2,3\n1,-2,3\n => line 2: roll -2 is not a whole number from 0 to 255
        roll,pitch,yaw\n1,2.5,3\n => line 2: pitch 2.5 is not a whole number from 0 to 255
        1,2,3\n\n1,,3 => line 3: roll "" is not a whole number from 0 to 255
        up,2,3 => line 1: pitch "up" is not a whole number from 0 to 255
        {"pitch":1,"roll":-1,"yaw":3} => line 1: roll -1 is not a whole number from 0 to 255
        {"pitch":"1","roll":2,"yaw":3} => line 1: pitch "1" is not a whole number from 0 to 255
        {"pitch":1,"roll":2,"yaw":2.5} => line 1: yaw 2.5 is not a whole number from 0 to 255
        {"pitch":1,"roll":2,"yaw":null} => line 1: yaw null is not a whole number from 0 to 255
        1,2 => line 1: columns: 2, expected: 3; columns beside pitch,roll,yaw need a header that names all
        1,2,3\n1,2,3,"a\nb"\n => line 3: columns: 4, expected: 3; columns beside
        1,2,3\r4,5,6\n => line 1: columns: 5, expected: 3; columns beside
        pitch,roll\n1,2 => line 2: missing field `yaw`
        pitch,roll,yaw,roll\n1,2,3,4 => line 2: duplicate field `roll`
        \n{"pitch":1,"roll":2}\n => line 2: missing field `yaw`
        {"pitch":1,"pitch":1,"roll":2,"yaw":3} => line 1: duplicate field `pitch`, at column 18
        {"pitch":1,\n => line 1: EOF while parsing a value, at column 11
        {"pitch":1,"roll":2,"yaw":3}\n1,2,3 => line 2: not a JSON object such as {"pitch":127,"roll":200
    "#;

    /// The same where times are read.
    const WRONG_TIMES: &str = r#"
        0,1,2,3\n-1,1,2,3 => line 2: time -1 is not a number of seconds, 0 or more
        0,1,2,3\nsoon,1,2,3 => line 2: time "soon" is not a number of seconds, 0 or more
        0,1,2,3\nNaN,1,2,3 => line 2: time null is not a number of seconds, 0 or more
        {"time":-1,"pitch":1,"roll":2,"yaw":3} => line 1: time -1 is not a number of seconds, 0 or more
        1,1,2,3\n0.5,1,2,3 => line 2: the time 0.5 is before that of the row above, 1; times may not go back
        time,pitch,roll,yaw,time\n1,1,2,3,1 => line 2: duplicate field `time`
        {"pitch":1,"roll":2,"yaw":3}\n{"time":1,"pitch":1,"roll":2,"yaw":3} => line 2: a time, but the rows above have none
        {"time":1,"pitch":1,"roll":2,"yaw":3}\n{"pitch":1,"roll":2,"yaw":3} => line 2: no time, but the rows above have one
    "#;

    #[test]
    fn what_is_wrong_is_told_with_its_place_and_what_is_right() {
        for (table, reads_times) in [(WRONG, false), (WRONG_TIMES, true)] {
            for case in table.lines().filter(|line| !line.trim().is_empty()) {
                let (text, told) = case.trim().split_once(" => ").unwrap();
                let text = text.replace("\\n", "\n").replace("\\r", "\r");
                let problem = read(&text, 9, reads_times).unwrap_err().to_string();
                assert!(
                    problem.starts_with(&format!("moves: {told}")),
                    "{text}: {problem}"
                );
            }
        }
    }
}
