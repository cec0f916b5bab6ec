//! Makes frames from rows of comma-separated values or JSON, one frame per row.

use std::io::{self, BufRead, BufReader, Read};

use anyhow::{Context, Result, anyhow, bail, ensure};
use csv::{ByteRecord, ReaderBuilder, StringRecord, Terminator, Trim};
use framelock_description::{Column, Description};
use framelock_receiving::Protocol;
use serde_json::{Map, Number, Value};

use crate::input::Input;
use crate::options::check_has_no_breaks;

/// The values of a row, by the names of their columns or fields.
type Fields = Map<String, Value>;

/// The line number of a row, and its fields or an error.
type NumberedFields = (u64, Result<Fields>);

/// Returns the frame of each row of a text, as soon as the row's line has arrived.
pub(crate) fn rows<'a>(
    input: Input<'a>,
    frame: &'a Protocol,
) -> Result<impl Iterator<Item = Result<Vec<u8>>> + 'a> {
    let name = input.name.clone();
    check_has_no_breaks(frame)?;
    let mut input = BufReader::new(input);
    let (beginning, is_json) = beginning(&mut input)?;
    if beginning.starts_with(b"\xFF\xFE") || beginning.starts_with(b"\xFE\xFF") {
        bail!(
            "{name} is UTF-16 text: save it as UTF-8 or as plain CSV, or convert it, for example by \
             iconv -f UTF-16 -t UTF-8"
        );
    }
    let input = io::Cursor::new(beginning).chain(input);
    let description = &frame.description;
    let lines: Box<dyn Iterator<Item = io::Result<NumberedFields>> + 'a> = if is_json {
        Box::new(json_lines(input))
    } else {
        Box::new(separated(input, description))
    };
    Ok(lines.map(move |line| {
        let (number, fields) = line?;
        let row = fields.and_then(|fields| {
            let frame = description.encode(&values(&description.columns, &fields)?)?;
            let sent = description.sent(&frame);
            sent.context("no packet has these values")
        });
        row.with_context(|| format!("{name}: line {number}"))
    }))
}

/// Reads a text up to the first line that is neither blank nor a comment. Returns all lines that were read, and whether
/// the last line is JSON.
fn beginning(input: &mut impl BufRead) -> io::Result<(Vec<u8>, bool)> {
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
            let is_json = line.starts_with(b"{");
            return Ok((beginning, is_json));
        }
    }
}

/// Returns the values in the order of the columns. A field may have all values of an array. Unknown fields are ignored.
fn values(columns: &[Column], fields: &Fields) -> Result<Vec<Option<Value>>> {
    let mut values = Vec::with_capacity(columns.len());
    for group in columns.chunk_by(|one, next| one.array.is_some() && one.array == next.array) {
        let name = group[0].array.as_ref().unwrap_or(&group[0].name);
        if let Some(Value::Array(array)) = fields.get(name) {
            let (given, needed) = (array.len(), group.len());
            ensure!(
                given == needed,
                "{name} has {given} values, but needs {needed}"
            );
            values.extend(array.iter().cloned().map(Some));
        } else {
            values.extend(group.iter().map(|column| fields.get(&column.name).cloned()));
        }
    }
    Ok(values)
}

/// Reads a text with one JSON object per line.
fn json_lines(input: impl BufRead) -> impl Iterator<Item = io::Result<NumberedFields>> {
    let lines = (1..).zip(input.split(b'\n'));
    lines.filter_map(|(number, line)| match line {
        Ok(line) if line.starts_with(b"#") || line.trim_ascii().is_empty() => None,
        Ok(line) => {
            let fields = serde_json::from_slice(&line);
            let invalid = |error: serde_json::Error| {
                anyhow!("not a JSON object: see column {}", error.column())
            };
            Some(Ok((number, fields.map_err(invalid))))
        }
        Err(error) => Some(Err(error)),
    })
}

/// Reads rows of values that commas separate.
fn separated<'a>(
    input: impl Read + 'a,
    description: &'a Description,
) -> impl Iterator<Item = io::Result<NumberedFields>> {
    // Only a line feed ends a line, and a line feed is added after the last line. A row's line number therefore follows
    // from the reader's position.
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .comment(Some(b'#'))
        .terminator(Terminator::Any(b'\n'))
        .from_reader(input.chain(&b"\n"[..]));
    let (mut header, mut bytes) = (None, ByteRecord::new());
    let mut next = move || -> io::Result<Option<NumberedFields>> {
        while reader.read_byte_record(&mut bytes)? {
            // An ignored column may contain bytes that are not UTF-8.
            let record = StringRecord::from_byte_record_lossy(bytes.clone());
            if record.iter().all(str::is_empty) {
                continue;
            }
            let own_names = record.iter().map(|name| without_unit(description, name));
            let own_names: StringRecord = own_names.collect();
            let names = match &header {
                Some(names) => names,
                None if own_names
                    .iter()
                    .any(|name| column(description, name).is_some()) =>
                {
                    header = Some(own_names);
                    continue;
                }
                None => header.insert(plain_names(description)),
            };
            let fields = separated_fields(&record, names, description);
            return Ok(Some((reader.position().line() - 1, fields)));
        }
        Ok(None)
    };
    std::iter::from_fn(move || next().transpose())
}

/// Returns the name of a column in a header. A unit may follow the name, as in `altitude (m)`.
fn without_unit<'n>(description: &Description, name: &'n str) -> &'n str {
    match name.rsplit_once(" (") {
        Some((own, unit)) if unit.ends_with(')') && column(description, name).is_none() => own,
        _ => name,
    }
}

/// Returns the names of the columns of a table without a header.
fn plain_names(description: &Description) -> StringRecord {
    let plain = description.plain_columns();
    plain.iter().map(|column| &*column.name).collect()
}

fn column<'a>(description: &'a Description, name: &str) -> Option<&'a Column> {
    let mut columns = description.columns.iter();
    columns.find(|column| column.name == name)
}

fn separated_fields(
    record: &StringRecord,
    names: &StringRecord,
    description: &Description,
) -> Result<Fields> {
    if record.len() != names.len() {
        let plain = plain_names(description);
        bail!(
            "columns: {}, expected: {}; columns other than {} need a header that names all columns",
            record.len(),
            names.len(),
            plain.iter().collect::<Vec<_>>().join(",")
        );
    }
    let mut fields = Fields::new();
    for (name, text) in names.iter().zip(record) {
        let value = match column(description, name) {
            Some(column) if column.is_text => text.into(),
            Some(_) => number_or_text(text),
            None => continue,
        };
        ensure!(
            fields.insert(name.to_owned(), value).is_none(),
            "duplicate field `{name}`"
        );
    }
    Ok(fields)
}

/// If the text is a number, returns the number, otherwise the text.
fn number_or_text(text: &str) -> Value {
    let whole = text.parse::<u64>().map(Value::from);
    let exact = || serde_json::from_str::<Number>(text).map(Value::from);
    // As in JSON, NaN becomes null, and infinity becomes a number that exceeds the range of 32-bit floats.
    let float = || {
        text.parse::<f64>()
            .map(|number| number.clamp(-1e39, 1e39).into())
    };
    whole
        .or_else(|_| exact())
        .or_else(|_| float())
        .unwrap_or_else(|_| text.into())
}
