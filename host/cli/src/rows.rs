//! Makes frames from rows of separated values or JSON, one frame per row.

use std::io::{self, BufRead, BufReader, Read};
use std::time::Duration;

use anyhow::{Error, Result, anyhow, bail, ensure};
use clap::ValueEnum;
use csv::{ByteRecord, ReaderBuilder, StringRecord, Terminator, Trim};
use framelock_description::text::quote;
use framelock_description::{Column, Description};
use framelock_receiving::Protocol;
use serde_json::value::RawValue;
use serde_json::{Map, Number, Value};

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

/// The line number of a row, and its fields or an error.
type NumberedFields<'a> = (u64, Result<Fields<'a>>);

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
        Box::new(separated(
            input,
            &frame.description,
            delimiter(&first),
            reads_times,
        ))
    } else if first.starts_with(b"[") {
        let mut text = String::new();
        input.read_to_string(&mut text)?;
        Box::new(json_array(&text, columns).into_iter().map(Ok))
    } else {
        Box::new(json_lines(input, columns))
    };
    let mut before = None;
    Ok(lines.map(move |line| {
        let (number, fields) = line?;
        let row = fields.and_then(|fields| {
            let time_value = fields.time.as_ref().filter(|_| reads_times);
            let time = time_value.map(seconds).transpose()?;
            let bytes = frame
                .description
                .encode(&fields.values)
                .map_err(Error::msg)?;
            check_order(before.as_ref(), time)?;
            Ok(Row { time, frame: bytes })
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
        let line = beginning[from.min(beginning.len())..].trim_ascii();
        if is_end || !(line.is_empty() || line.starts_with(b"#")) {
            let line = line.to_vec();
            return Ok((beginning, line));
        }
    }
}

/// The values of a row, each of any type. Unknown columns or fields are ignored.
struct Fields<'a> {
    columns: &'a [Column],
    time: Option<Value>,
    /// The values, in the order of the columns.
    values: Vec<Option<Value>>,
}

impl<'a> Fields<'a> {
    fn new(columns: &'a [Column]) -> Self {
        Self {
            columns,
            time: None,
            values: vec![None; columns.len()],
        }
    }

    /// Stores a value, or the values of an array.
    fn set(&mut self, name: &str, value: Value) -> Result<()> {
        let is_named =
            |column: &Column| column.name == name || column.array.as_deref() == Some(name);
        let slots = if name == "time" {
            std::slice::from_mut(&mut self.time)
        } else if let Some(from) = self.columns.iter().position(is_named) {
            let count = self.columns[from..]
                .iter()
                .take_while(|column| is_named(column))
                .count();
            &mut self.values[from..from + count]
        } else {
            return Ok(());
        };
        ensure!(
            slots.iter().all(Option::is_none),
            "duplicate field `{name}`"
        );
        let values = match value {
            Value::Array(values) => values,
            value => vec![value],
        };
        let (given, wanted) = (values.len(), slots.len());
        ensure!(
            given == wanted,
            "{name} has {given} values, but needs {wanted}"
        );
        for (slot, value) in slots.iter_mut().zip(values) {
            *slot = Some(value);
        }
        Ok(())
    }
}

fn seconds(value: &Value) -> Result<Duration> {
    let seconds = value.as_f64();
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| {
        let value = quote(value);
        anyhow!("time {value} is not a number of seconds, 0 or more")
    })
}

/// Checks that a time is not earlier than the time of the row before.
fn check_order(before: Option<&Row>, time: Option<Duration>) -> Result<()> {
    match before.map(|before| (before.time, time)) {
        Some((Some(before), Some(time))) if time < before => bail!(
            "the time {time:?} is earlier than {before:?}, the time of the row above; times may not decrease"
        ),
        Some((Some(_), None)) => bail!("this row has no time, but the rows above have times"),
        Some((None, Some(_))) => bail!("this row has a time, but the rows above have none"),
        _ => Ok(()),
    }
}

/// Reads a text with one JSON object per line.
fn json_lines<'a>(
    input: impl BufRead + 'a,
    columns: &'a [Column],
) -> impl Iterator<Item = io::Result<NumberedFields<'a>>> {
    let lines = (1..).zip(input.split(b'\n'));
    lines.filter_map(move |(number, line)| match line {
        Ok(line) => match line.trim_ascii() {
            [] | [b'#', ..] => None,
            line => Some(Ok((number, json_fields(line, columns)))),
        },
        Err(error) => Some(Err(error)),
    })
}

/// Reads a text that is an array of JSON objects.
fn json_array<'a>(text: &str, columns: &'a [Column]) -> Vec<NumberedFields<'a>> {
    let values = match serde_json::from_str::<Vec<&RawValue>>(text) {
        Ok(values) => values,
        Err(error) => return vec![(error.line() as u64, Err(invalid_json(&error)))],
    };
    let (mut number, mut counted) = (1, 0);
    let rows = values.into_iter().map(|value| {
        let offset = value.get().as_ptr().addr() - text.as_ptr().addr();
        number += text[counted..offset].matches('\n').count() as u64;
        counted = offset;
        (number, json_fields(value.get().as_bytes(), columns))
    });
    rows.collect()
}

fn json_fields<'a>(text: &[u8], columns: &'a [Column]) -> Result<Fields<'a>> {
    if !text.starts_with(b"{") {
        let pairs = columns.iter().zip(["127", "200", "74"]);
        let example = pairs.map(|(column, value)| format!("\"{}\":{value}", column.name));
        bail!(
            "not a JSON object such as {{{}}}",
            example.collect::<Vec<_>>().join(",")
        );
    }
    let object: Map<String, Value> =
        serde_json::from_slice(text).map_err(|error| invalid_json(&error))?;
    let mut fields = Fields::new(columns);
    for (name, value) in object {
        fields.set(&name, value)?;
    }
    Ok(fields)
}

fn invalid_json(error: &serde_json::Error) -> Error {
    let what = if error.is_eof() {
        "incomplete"
    } else {
        "invalid"
    };
    anyhow!("{what} JSON, at column {}", error.column())
}

/// Returns the delimiter: the comma, semicolon or tab, whichever is most frequent in the first line.
fn delimiter(first: &[u8]) -> u8 {
    let count = |delimiter: &u8| first.split(|byte| byte == delimiter).count();
    // If counts are equal, `max_by_key` returns the last delimiter, the comma.
    *b"\t;,"
        .iter()
        .max_by_key(|delimiter| count(delimiter))
        .expect("there are delimiters")
}

/// Reads rows of values that a delimiter separates.
fn separated<'a>(
    input: impl Read + 'a,
    description: &'a Description,
    delimiter: u8,
    reads_times: bool,
) -> impl Iterator<Item = io::Result<NumberedFields<'a>>> {
    // Only a line feed ends a line, and a line feed is added after the last line. A row's line number therefore follows
    // from the reader's position.
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .terminator(Terminator::Any(b'\n'))
        .from_reader(input.chain(&b"\n"[..]));
    let (mut header, mut bytes) = (None, ByteRecord::new());
    let mut next = move || -> io::Result<Option<NumberedFields<'a>>> {
        while reader.read_byte_record(&mut bytes)? {
            // An ignored column may contain bytes that are not UTF-8.
            let record = StringRecord::from_byte_record_lossy(bytes.clone());
            let is_comment = record.get(0).is_some_and(|text| text.starts_with('#'));
            if is_comment || record.iter().all(str::is_empty) {
                continue;
            }
            if header.is_none() {
                let (names, is_header) = column_names(&record, description, reads_times);
                header = Some(names);
                if is_header {
                    continue;
                }
            }
            let names = header.as_ref().expect("the names are known");
            let fields = separated_fields(&record, names, description);
            return Ok(Some((reader.position().line() - 1, fields)));
        }
        Ok(None)
    };
    std::iter::from_fn(move || next().transpose())
}

/// Returns the names of the columns, and whether the first record is a header, which contains them.
fn column_names(
    first: &StringRecord,
    description: &Description,
    reads_times: bool,
) -> (StringRecord, bool) {
    // Names match without regard to case, unless two columns differ only in case.
    let own_name = |name: &str| {
        let names = || description.columns.iter().map(|column| &*column.name);
        let exact = names().find(|column| *column == name);
        exact.or_else(|| names().find(|column| column.eq_ignore_ascii_case(name)))
    };
    if first.iter().any(|name| own_name(name).is_some()) {
        let names = first
            .iter()
            .map(|name| own_name(name).map_or(name.to_ascii_lowercase(), str::to_owned));
        return (names.collect(), true);
    }
    let plain = description.plain_columns();
    let time = (reads_times && first.len() == plain.len() + 1).then_some("time");
    let names = plain.iter().map(|column| &*column.name);
    (time.into_iter().chain(names).collect(), false)
}

fn separated_fields<'a>(
    record: &StringRecord,
    names: &StringRecord,
    description: &'a Description,
) -> Result<Fields<'a>> {
    if record.len() != names.len() {
        let plain: Vec<&str> = description
            .plain_columns()
            .iter()
            .map(|column| &*column.name)
            .collect();
        bail!(
            "columns: {}, expected: {}; columns other than {} need a header that names all columns",
            record.len(),
            names.len(),
            plain.join(",")
        );
    }
    let mut fields = Fields::new(&description.columns);
    for (name, text) in names.iter().zip(record) {
        let is_text = description
            .columns
            .iter()
            .any(|column| column.name == name && column.is_text);
        fields.set(
            name,
            if is_text {
                text.into()
            } else {
                number_or_text(text)
            },
        )?;
    }
    Ok(fields)
}

/// If the text is a number, returns the number, otherwise the text.
fn number_or_text(text: &str) -> Value {
    let whole = text.parse::<u64>().map(Value::from);
    let signed = || text.parse::<i64>().map(Value::from);
    let exact = || serde_json::from_str::<Number>(text).map(Value::from);
    // As in JSON, NaN becomes null, and infinity becomes a number that exceeds the range of 32-bit floats.
    let float = || {
        text.parse::<f64>()
            .map(|number| number.clamp(-1e39, 1e39).into())
    };
    whole
        .or_else(|_| signed())
        .or_else(|_| exact())
        .or_else(|_| float())
        .unwrap_or_else(|_| text.into())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use framelock::Encode;
    use framelock::motion::Bin;

    use super::*;

    /// A reader that returns a few bytes at a time.
    struct Pieces<'a>(&'a [u8], usize);

    impl Read for Pieces<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let length = buffer.len().min(self.1);
            self.0.read(&mut buffer[..length])
        }
    }

    fn read(text: impl AsRef<[u8]>, piece: usize, reads_times: bool) -> Result<Vec<Row>> {
        let input = Input::new("moves", Pieces(text.as_ref(), piece));
        let frame = Protocol::named("bin").unwrap();
        rows(input, InputFormat::Auto, &frame, reads_times)?.collect()
    }

    fn row(time: Option<u64>, setpoint: [u8; 3]) -> Row {
        Row {
            time: time.map(Duration::from_millis),
            frame: Bin::encode(setpoint.into()).to_vec(),
        }
    }

    #[test]
    fn setpoints_may_have_many_notations_and_arrive_in_pieces() {
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
            "pitch;roll;yaw\n1;2;3\n4;5;6\n",
            "1\t2\t3\n\t\t\n4\t5\t6\n",
            "\u{FEFF}# a motion; by hand\n\npitch;roll;yaw\n# begin\n1;2;3\n \n  # \"go on\n4;5;6\n;;\n",
            "time,Yaw,ROLL,pitch,note\n6,3,2,1,\"a, b\"\n5,6,5,4,\"over\ntwo lines\"\n",
            "{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6}\n",
            "# two\n{\"pitch\":1,\"roll\":2,\"yaw\":3}\n# and\n{\"pitch\":4,\"roll\":5,\"yaw\":6}",
            "[{\"pitch\":1,\"roll\":2,\"yaw\":3},{\"pitch\":4,\"roll\":5,\"yaw\":6}]",
            "\n[\n  {\n \"pitch\": 1, \"roll\": 2,\n \"yaw\": 3 },\n{\"pitch\":4,\"roll\":5,\"yaw\":6}\n]\n",
            "\n \n{ \"yaw\": 3, \"roll\": 2, \"pitch\": 1, \"time\": \"x\" }\r\n\n{\"pitch\":4,\"roll\":5,\"yaw\":6}",
            "\u{FEFF}{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6,\"more\":[{}]}\n",
        ] {
            for length in [1, 2, 3, 5, 8, 1000] {
                assert_eq!(read(text, length, false).unwrap(), two, "{length}: {text}");
            }
        }
        // An ignored column may contain bytes that are not UTF-8.
        let latin_1 = b"pitch,roll,yaw,note\n1,2,3,H\xF6he\n4,5,6,\n";
        assert_eq!(read(latin_1, 9, false).unwrap(), two);
        for nothing in [
            "[]",
            "# nothing",
            "",
            "\n\n",
            "pitch,roll,yaw\n",
            "pitch,roll,yaw",
        ] {
            assert_eq!(read(nothing, 9, false).unwrap(), []);
        }
    }

    #[test]
    fn times_are_read_on_request() {
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

    /// Each line has a text, in which `\n` and `\r` stand for line ends, and the error that the text causes.
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
        1,2 => line 1: columns: 2, expected: 3; columns other than pitch,roll,yaw need a header that names all columns
        1,2,3\n1,2,3,"a\nb"\n => line 3: columns: 4, expected: 3; columns other than
        1,2,3\r4,5,6\n => line 1: columns: 5, expected: 3; columns other than
        pitch,roll\n1,2 => line 2: missing field `yaw`
        pitch,roll,yaw,roll\n1,2,3,4 => line 2: duplicate field `roll`
        \n{"pitch":1,"roll":2}\n => line 2: missing field `yaw`
        {"pitch":1,\n => line 1: incomplete JSON, at column 11
        # one\n1,2,3\n# two\n\n1,2,256 => line 5: yaw 256
        [{"pitch":1,"roll":2,"yaw":3},\n\n{"pitch":1,"roll":2}] => line 3: missing field `yaw`
        [{"pitch":1,"roll":2,"yaw":3},\n{"pitch":1,\n"roll":2}] => line 2: missing field `yaw`
        [\n{"pitch":1,"roll":2,"yaw":3}\n{} => line 3: invalid JSON, at column 1
        [\n{"pitch":1,"roll":2,"yaw":3},\n{"pitch":1,"roll":2,"yaw":3},\n{"pitch":1,"roll":2,"yaw":300}] => line 4: yaw 300 is
        [1,2,3] => line 1: not a JSON object such as {"pitch":127
        {"pitch":1,"roll":2,"yaw":3}\n1,2,3 => line 2: not a JSON object such as {"pitch":127,"roll":200
    "#;

    /// A table like [`WRONG`], whose texts are read with times.
    const WRONG_TIMES: &str = r#"
        0,1,2,3\n-1,1,2,3 => line 2: time -1 is not a number of seconds, 0 or more
        0,1,2,3\nsoon,1,2,3 => line 2: time "soon" is not a number of seconds, 0 or more
        0,1,2,3\nNaN,1,2,3 => line 2: time null is not a number of seconds, 0 or more
        {"time":-1,"pitch":1,"roll":2,"yaw":3} => line 1: time -1 is not a number of seconds, 0 or more
        2.1701381,1,2,3\n2.170138,1,2,3 => line 2: the time 2.170138s is earlier than 2.1701381s, the time of the row above; times may not decrease
        time,pitch,roll,yaw,time\n1,1,2,3,1 => line 2: duplicate field `time`
        {"pitch":1,"roll":2,"yaw":3}\n{"time":1,"pitch":1,"roll":2,"yaw":3} => line 2: this row has a time, but the rows above have none
        {"time":1,"pitch":1,"roll":2,"yaw":3}\n{"pitch":1,"roll":2,"yaw":3} => line 2: this row has no time, but the rows above have times
    "#;

    #[test]
    fn an_error_names_its_line_and_the_expected_value() {
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
