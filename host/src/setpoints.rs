//! Setpoints from text: comma-separated values or JSON lines.

use std::io::{self, BufRead, BufReader, Read};
use std::time::Duration;

use anyhow::{Result, anyhow};
use clap::ValueEnum;
use csv::{ByteRecord, ReaderBuilder, StringRecord, Terminator, Trim};
use framelock::Setpoint;
use serde::Deserialize;
use serde_json::Value;

use crate::input::Input;

/// The fields of a setpoint, in the order of the frame.
const AXES: [&str; 3] = ["pitch", "roll", "yaw"];

const NOT_A_DEMAND: &str = "is not a whole number from 0 to 255";

/// How setpoints are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum InputFormat {
    /// JSON lines if the first thing in it is a brace, else comma-separated values
    Auto,
    /// Comma-separated values, with or without a header
    Csv,
    /// A JSON object per line
    Jsonl,
}

/// A setpoint as the text has it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Row {
    /// When it is due, if the text says so and times are read.
    pub(crate) time: Option<Duration>,
    /// Where each axis is to be.
    pub(crate) setpoint: Setpoint,
}

/// What a row says, of whatever type; further columns or fields mean nothing.
#[derive(Deserialize)]
struct Fields {
    time: Option<Value>,
    pitch: Value,
    roll: Value,
    yaw: Value,
}

/// The number of a row's line, and its fields or what is wrong with them.
type Line = (u64, Result<Fields, String>);

/// The rows of a text, each as soon as its line has come.
///
/// With `reads_times`, times in seconds are read too: a column or field `time`, or the first of four
/// columns without a header. They may not go back.
pub(crate) fn rows<'a>(
    input: Input<'a>,
    format: InputFormat,
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
    let lines: Box<dyn Iterator<Item = io::Result<Line>> + 'a> = if is_json {
        Box::new(json_lines(input))
    } else {
        Box::new(csv_lines(input, reads_times))
    };
    let mut before = None;
    Ok(lines.map(move |line| {
        let (number, fields) = line?;
        let row = fields.and_then(|fields| row(&fields, reads_times, before));
        before = row.as_ref().ok().copied();
        row.map_err(|problem| anyhow!("{name}: line {number}: {problem}"))
    }))
}

fn csv_lines(input: impl Read, reads_times: bool) -> impl Iterator<Item = io::Result<Line>> {
    // A line feed at the end of every line, so that a row's number follows from the reader's.
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .terminator(Terminator::Any(b'\n'))
        .from_reader(input.chain(&b"\n"[..]));
    let (mut columns, mut record) = (None, ByteRecord::new());
    let mut next = move || -> io::Result<Option<Line>> {
        while reader.read_byte_record(&mut record)? {
            // What a column that means nothing holds need not be UTF-8.
            let record = StringRecord::from_byte_record_lossy(record.clone());
            if let Some(fields) = csv_fields(&record, &mut columns, reads_times) {
                return Ok(Some((reader.position().line() - 1, fields)));
            }
        }
        Ok(None)
    };
    std::iter::from_fn(move || next().transpose())
}

/// The fields of a record; none if it is blank or the header.
fn csv_fields(
    record: &StringRecord,
    columns: &mut Option<StringRecord>,
    reads_times: bool,
) -> Option<Result<Fields, String>> {
    if record.iter().eq([""]) {
        return None;
    }
    if columns.is_none() {
        let names: StringRecord = record.iter().map(str::to_ascii_lowercase).collect();
        if names.iter().any(|name| AXES.contains(&name)) {
            *columns = Some(names);
            return None;
        }
    }
    let time = (reads_times && record.len() == 4).then_some("time");
    let columns = columns.get_or_insert_with(|| time.into_iter().chain(AXES).collect());
    if record.len() != columns.len() {
        return Some(Err(format!(
            "columns: {}, expected: {}; columns beside pitch,roll,yaw need a header that names all",
            record.len(),
            columns.len()
        )));
    }
    let fields = record.deserialize(Some(columns));
    Some(fields.map_err(|error| match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => err.to_string(),
        _ => error.to_string(),
    }))
}

fn json_lines(input: impl BufRead) -> impl Iterator<Item = io::Result<Line>> {
    let lines = (1..).zip(input.split(b'\n'));
    lines.filter_map(|(number, line)| match line {
        Ok(line) if line.trim_ascii().is_empty() => None,
        Ok(line) => Some(Ok((number, json_fields(line.trim_ascii())))),
        Err(error) => Some(Err(error)),
    })
}

fn json_fields(line: &[u8]) -> Result<Fields, String> {
    if !line.starts_with(b"{") {
        return Err(r#"not a JSON object such as {"pitch":127,"roll":200,"yaw":74}"#.into());
    }
    // To the library, this line is the first.
    let place = |error: serde_json::Error| {
        let problem = error.to_string();
        problem.replace(" at line 1 column ", ", at column ")
    };
    serde_json::from_slice(line).map_err(place)
}

fn row(fields: &Fields, reads_times: bool, before: Option<Row>) -> Result<Row, String> {
    // Something that was not meant to be a number may be long.
    let shortened = |value: &Value| value.to_string().chars().take(40).collect::<String>();
    let demand = |axis: &str, value: &Value| {
        let demand = value.as_u64().and_then(|demand| u8::try_from(demand).ok());
        demand.ok_or_else(|| format!("{axis} {} {NOT_A_DEMAND}", shortened(value)))
    };
    let time = |value: &Value| {
        let seconds = value.as_f64();
        let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        let value = shortened(value);
        time.ok_or(format!(
            "time {value} is not a number of seconds, 0 or more"
        ))
    };
    let read = fields.time.as_ref().filter(|_| reads_times);
    let row = Row {
        time: read.map(time).transpose()?,
        setpoint: Setpoint {
            pitch: demand("pitch", &fields.pitch)?,
            roll: demand("roll", &fields.roll)?,
            yaw: demand("yaw", &fields.yaw)?,
        },
    };
    match before.map(|before| (before.time, row.time)) {
        Some((Some(before), Some(time))) if time < before => Err(format!(
            "the time {} is before that of the row above, {}; times may not go back",
            time.as_secs_f64(),
            before.as_secs_f64()
        )),
        Some((Some(_), None)) => Err("no time, but the rows above have one".into()),
        Some((None, Some(_))) => Err("a time, but the rows above have none".into()),
        _ => Ok(row),
    }
}

/// Reads `pitch,roll,yaw`, each a whole number from 0 to 255.
pub(crate) fn parse(text: &str) -> Result<Setpoint, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let [pitch, roll, yaw] = *fields else {
        return Err(format!("{text:?} is not three numbers such as 127,200,74"));
    };
    let demand = |axis: &str, field: &str| {
        let demand = field.parse();
        demand.map_err(|_| format!("{axis} {field:?} {NOT_A_DEMAND}"))
    };
    Ok(Setpoint {
        pitch: demand("pitch", pitch)?,
        roll: demand("roll", roll)?,
        yaw: demand("yaw", yaw)?,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

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
        rows(input, InputFormat::Auto, reads_times)?.collect()
    }

    fn row(time: Option<u64>, setpoint: [u8; 3]) -> Row {
        Row {
            time: time.map(Duration::from_millis),
            setpoint: setpoint.into(),
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
