//! Reads rows of values that commas, semicolons or tabs separate.

use std::io::{self, Read};

use csv::{ByteRecord, ReaderBuilder, StringRecord, Terminator, Trim};
use framelock_description::text::{nearest, quoted};
use framelock_description::{Column, Description};
use serde_json::{Number, Value};

use super::{Fields, NumberedFields, fill};

/// Returns the delimiter: the comma, semicolon or tab, whichever is most frequent in the first line.
pub(super) fn delimiter(first: &[u8]) -> u8 {
    let count = |&delimiter: &u8| first.split(|&byte| byte == delimiter).count();
    // If counts are equal, `max_by_key` returns the last delimiter, the comma.
    b"\t;,".iter().copied().max_by_key(count).unwrap_or(b',')
}

pub(super) fn lines<'a>(
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
    let (mut header, mut record) = (None, ByteRecord::new());
    let mut next = move || -> io::Result<Option<NumberedFields<'a>>> {
        while reader.read_byte_record(&mut record)? {
            // An ignored column may contain bytes that are not UTF-8.
            let record = StringRecord::from_byte_record_lossy(record.clone());
            let to_value = |text: &str| inferred(text, delimiter != b',');
            if let Some(fields) = fields(&record, description, &mut header, reads_times, to_value) {
                return Ok(Some((reader.position().line() - 1, fields)));
            }
        }
        Ok(None)
    };
    std::iter::from_fn(move || next().transpose())
}

/// Returns the fields of a record, or `None` if the record is blank, a comment or the header.
fn fields<'a>(
    record: &StringRecord,
    description: &'a Description,
    header: &mut Option<StringRecord>,
    reads_times: bool,
    to_value: impl Fn(&str) -> Value,
) -> Option<Result<Fields<'a>, String>> {
    let columns = &*description.columns;
    let is_comment = record.get(0).is_some_and(|text| text.starts_with('#'));
    if is_comment || record.iter().all(str::is_empty) {
        return None;
    }
    // Names match without regard to case, unless two columns differ only in case.
    let own = |name: &str| {
        let all = || columns.iter().map(|column| &*column.name);
        let is_it = |column: &&str| column.eq_ignore_ascii_case(name);
        all().find(|column| *column == name).or(all().find(is_it))
    };
    if header.is_none() {
        let small = |name: &str| own(name).map_or(name.to_ascii_lowercase(), str::to_owned);
        let names: StringRecord = record.iter().map(small).collect();
        if record.iter().any(|name| own(name).is_some()) {
            *header = Some(names);
            return None;
        }
    }
    let is_first = header.is_none();
    let plain = description.plain_columns();
    let names = || plain.iter().map(|column| &*column.name);
    let time = (reads_times && record.len() == plain.len() + 1).then_some("time");
    let header = header.get_or_insert_with(|| time.into_iter().chain(names()).collect());
    if record.len() != header.len() {
        // The first row may be a header with misspelt names.
        let all: Vec<&str> = columns.iter().map(|column| &*column.name).collect();
        let misspelt = record
            .iter()
            .map(|name| (name, nearest(name, &all)))
            .find(|(_, nearest)| is_first && !nearest.is_empty())
            .map(|(name, nearest)| format!("there is no column {}{nearest}; ", quoted(name)));
        return Some(Err(format!(
            "{}columns: {}, expected: {}; columns other than {} need a header that names all columns",
            misspelt.unwrap_or_default(),
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
                if is_text { text.into() } else { to_value(text) },
            ),
        }
    };
    Some(header.iter().zip(record).try_for_each(set).map(|()| fields))
}

/// If the text is a number, returns the number, otherwise the text. A comma may be the decimal point if commas do not
/// separate values.
fn inferred(text: &str, may_have_comma: bool) -> Value {
    if may_have_comma && text.contains(',') {
        return inferred(&text.replace(',', "."), false);
    }
    let whole = text.parse::<u64>().map(Value::from);
    let signed = || text.parse::<i64>().map(Value::from);
    // As in JSON, NaN becomes null, and infinity becomes a number that exceeds the range of 32-bit floats.
    let number = || text.parse::<f64>();
    let number = || number().map(|number| number.clamp(-1e39, 1e39).into());
    let exact = || serde_json::from_str::<Number>(text).map(Value::from);
    whole
        .or_else(|_| signed())
        .or_else(|_| exact())
        .or_else(|_| number())
        .unwrap_or_else(|_| text.into())
}
