//! Makes frames from rows of comma-separated values or JSON, one frame per row.

use std::collections::HashMap;
use std::io::{self, BufRead, BufReader, Read};

use anyhow::{Context, Result, anyhow, bail, ensure};
use csv::{ByteRecord, ReaderBuilder, StringRecord, Terminator};
use framelock_description::{Column, Description, KIND};
use framelock_receiving::Protocol;
use serde_json::{Map, Value};

use crate::input::Input;
use crate::options::check_has_no_breaks;

/// The values of a row, by the names of their columns or fields.
type Fields = Map<String, Value>;

/// The columns of a description, by their names.
type ByName<'a> = HashMap<&'a str, &'a Column>;

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
    let by_name = columns_by_name(description);
    let lines: Box<dyn Iterator<Item = io::Result<NumberedFields>> + 'a> = if is_json {
        Box::new(json_lines(input))
    } else {
        Box::new(separated(input, description))
    };
    Ok(lines.map(move |line| {
        let (number, fields) = line?;
        let row = fields.and_then(|fields| {
            let frame = description.encode(&values(&description.columns, &by_name, &fields)?)?;
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

/// Returns the values in the order of the columns. An array fills the columns of its field. Unknown fields are ignored.
fn values(columns: &[Column], by_name: &ByName, fields: &Fields) -> Result<Vec<Option<Value>>> {
    let mut cells = HashMap::new();
    for (name, value) in fields {
        let Value::Array(array) = value else {
            cells.insert(name.clone(), value);
            continue;
        };
        let columns = (1..).map(|number| format!("{name}{number}"));
        let is_of_array = |column: &&Column| column.array.as_ref() == Some(name);
        let columns = columns.take_while(|column| by_name.get(&**column).is_some_and(is_of_array));
        let columns: Vec<String> = columns.collect();
        let (given, most) = (array.len(), columns.len());
        ensure!(
            given <= most || most == 0,
            "{name} has {given} values, but at most {most} fit"
        );
        cells.extend(columns.into_iter().zip(array));
    }
    let value = |column: &Column| cells.get(&column.name).copied().cloned();
    Ok(columns.iter().map(value).collect())
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

/// Reads rows of comma-separated values.
fn separated<'a>(
    input: impl Read + 'a,
    description: &'a Description,
) -> impl Iterator<Item = io::Result<NumberedFields>> {
    // Only a line feed ends a line, and a line feed is added after the last line. A row's line number therefore follows
    // from the reader's position.
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .terminator(Terminator::Any(b'\n'))
        .from_reader(input.chain(&b"\n"[..]));
    let (mut header, mut bytes) = (None, ByteRecord::new());
    let by_name = columns_by_name(description);
    let mut next = move || -> io::Result<Option<NumberedFields>> {
        while reader.read_byte_record(&mut bytes)? {
            // An ignored column may contain bytes that are not UTF-8.
            let record = StringRecord::from_byte_record_lossy(bytes.clone());
            if record.iter().all(|cell| cell.trim().is_empty()) {
                continue;
            }
            let names = match &header {
                Some(names) => names,
                None if names_in(&record).any(|name| by_name.contains_key(name)) => {
                    header = Some(names_in(&record).collect());
                    continue;
                }
                None => header.insert(plain_names(description)),
            };
            let fields = separated_fields(&record, names, &by_name, description);
            return Ok(Some((reader.position().line() - 1, fields)));
        }
        Ok(None)
    };
    std::iter::from_fn(move || next().transpose())
}

/// Returns the names in a header. A unit may follow a name, as in `altitude (m)`.
fn names_in(header: &StringRecord) -> impl Iterator<Item = &str> {
    let names = header.iter().map(|name| name.split(" (").next());
    names.map(|name| name.unwrap_or_default().trim())
}

/// Returns the names of the columns of a table without a header.
fn plain_names(description: &Description) -> StringRecord {
    let plain = description.plain_columns();
    plain.into_iter().map(|column| &*column.name).collect()
}

fn columns_by_name(description: &Description) -> ByName<'_> {
    let columns = description.columns.iter();
    columns.map(|column| (&*column.name, column)).collect()
}

fn separated_fields(
    record: &StringRecord,
    names: &StringRecord,
    by_name: &ByName,
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
        // The blanks of a text belong to the text. Some spreadsheets end a line with CR LF.
        let text = match by_name.get(name) {
            Some(column) if column.is_text && column.name != KIND => {
                text.strip_suffix('\r').unwrap_or(text)
            }
            Some(_) => text.trim(),
            None => continue,
        };
        ensure!(
            fields.insert(name.to_owned(), text.into()).is_none(),
            "duplicate field `{name}`"
        );
    }
    Ok(fields)
}
