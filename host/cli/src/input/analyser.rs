//! Reads the bytes that a logic analyser decoded: tables of Saleae Logic, Kingst VIS and `DSView`, and annotations of
//! sigrok. A byte with a parity or framing error is not delivered: the error takes its place, as in a UART's driver.

use std::io::BufRead;
use std::sync::LazyLock;

use anyhow::{Context, Result, ensure};
use csv::{ReaderBuilder, StringRecord, Trim};
use framelock::LineEvent;
use regex::Regex;
use serde::Deserialize;

use super::arrivals::{Arrival, each};
use super::time::{Times, from_seconds};

/// The beginnings of the tables' headers, without blanks. Text on a serial line does not begin in this way.
const HEADERS: [&str; 4] = [
    "time[s],value",
    "time[s],analyzername,decoded",
    "name,type,start_time,",
    "id,time[ns],",
];

/// A row of a table. Other columns are ignored.
#[derive(Deserialize)]
struct Row {
    #[serde(default, alias = "time[s]", alias = "start_time")]
    time: String,
    #[serde(rename = "time[ns]")]
    nanoseconds: Option<f64>,
    #[serde(alias = "data", alias = "decodedprotocolresult")]
    value: String,
    #[serde(default, rename = "parityerror")]
    parity: String,
    #[serde(default, rename = "framingerror")]
    framing: String,
    #[serde(default)]
    error: String,
    #[serde(default, alias = "analyzername")]
    name: String,
}

/// Returns whether a text begins with the header of a table.
pub(super) fn is_table(text: &str) -> bool {
    let header = text.lines().next().unwrap_or_default();
    let header = plain(&header.replace(['"', '\u{FEFF}'], ""));
    HEADERS.iter().any(|begin| header.starts_with(begin))
}

/// Returns the name of a column in lower case, without blanks.
fn plain(name: &str) -> String {
    name.to_ascii_lowercase().replace(' ', "")
}

/// Returns the bytes of a table with their times.
pub(super) fn arrivals(
    name: String,
    reader: impl BufRead,
) -> Result<impl Iterator<Item = Result<Arrival>>> {
    let mut reader = ReaderBuilder::new()
        .flexible(true)
        .trim(Trim::All)
        .from_reader(reader);
    let names = reader.headers()?.iter().map(plain);
    // In tables of DSView, the column of the bytes has the decoder's name, such as `0:UART: RX/TX`.
    let is_own = |name: &str| name.contains(":uart");
    let names = names.map(|name| if is_own(&name) { "value".into() } else { name });
    let header: StringRecord = names.collect();
    let records = reader.into_records().map(|record| {
        let record = record?;
        Ok((record.position().map_or(0, csv::Position::line), record))
    });
    let mut decoded = Decoded::default();
    Ok(each(name, records, move |record| {
        let Some(record) = record else {
            return Ok(decoded.held.take());
        };
        let row = record.deserialize(Some(&header)).ok();
        decoded.row(&row.context("the columns are not such as Time [s],Value")?)
    }))
}

/// Annotations of sigrok, such as `uart-1: RX data: 41`: optional sample numbers, a decoder, an optional class and a
/// text.
static ANNOTATION: LazyLock<Regex> = LazyLock::new(|| {
    let pattern = r#"(?ix) ^ (?: \d+-\d+ \s+ )? (uart [-\d]*) : \s+ (?: ([^:"]*) : \s+ )?
        "? ( [0-9a-f]{1,2} | [^"]* (?: bit | error | condition ) ) "? $"#;
    Regex::new(pattern).expect("the pattern is valid")
});

/// Returns whether a line is an annotation of sigrok's UART decoder.
pub(super) fn is_annotation(line: &str) -> bool {
    ANNOTATION.is_match(line)
}

/// The state of reading the bytes of one serial line.
#[derive(Default)]
pub(super) struct Decoded {
    /// The last byte. It is held back, because the next row may say that this byte has an error.
    pub(super) held: Option<Arrival>,
    times: Times,
    /// The name of the serial line in the first row.
    line: Option<String>,
}

impl Decoded {
    /// Reads a row of a table. If the row has a byte, holds this byte and returns the arrival that was held before.
    fn row(&mut self, row: &Row) -> Result<Option<Arrival>> {
        let time = match (&row.time, row.nanoseconds) {
            (_, Some(nanoseconds)) => Some(from_seconds(nanoseconds * 1e-9)),
            (time, None) if time.contains(':') => self.times.strip(time)?.and(self.times.last),
            (time, None) => time.parse().ok().map(from_seconds),
        };
        ensure!(time.is_some(), "{:?} is no time in seconds", row.time);
        let event = match (&*row.framing, &*row.parity) {
            ("", "") => event(&row.error).or(event(&row.value)),
            ("", _) => Some(LineEvent::Parity),
            _ => Some(LineEvent::Framing),
        };
        let byte = byte(&row.value, row.nanoseconds.is_some())?;
        self.push(&row.name, time, byte, event)
    }

    /// Reads an annotation. If it has a byte, holds this byte and returns the arrival that was held before. Annotations
    /// have no times, because the sample rate is unknown.
    pub(super) fn annotation(&mut self, line: &str) -> Result<Option<Arrival>> {
        let found = ANNOTATION.captures(line);
        let found = found.context("this line is no annotation of a UART")?;
        let class = found.get(2).map_or("", |class| class.as_str());
        let event = event(&found[3]);
        if event.is_none() && class.contains("bit") {
            return Ok(None);
        }
        let byte = byte(&found[3], true)?;
        self.push(&format!("{} {class}", &found[1]), None, byte, event)
    }

    /// Holds the row's byte, if any, and returns the byte that was held before. An error in the row belongs to the byte
    /// that is held afterwards.
    fn push(
        &mut self,
        line: &str,
        time: Option<i64>,
        byte: Option<u8>,
        event: Option<LineEvent>,
    ) -> Result<Option<Arrival>> {
        let mut before = None;
        if let Some(byte) = byte {
            let first = self.line.get_or_insert_with(|| line.to_owned());
            ensure!(
                first == line,
                "this row is of {line}, the first row of {first}: keep the rows of one"
            );
            before = self.held.replace(Arrival::new(time, vec![byte]));
        }
        if let (Some(held), Some(event)) = (&mut self.held, event) {
            // During a break, a UART sees zeros without a stop bit.
            let is_break = event == LineEvent::Framing && held.bytes == [0];
            held.event = Some(if is_break { LineEvent::Break } else { event });
            held.bytes.clear();
        }
        Ok(before)
    }
}

/// Returns the byte in an analyser's text, such as `0x41` or `A (0x41)`. Returns `None` if the text is empty, or names
/// a bit or an error.
fn byte(text: &str, is_plain_hex: bool) -> Result<Option<u8>> {
    let digits = match text.split_once("0x") {
        Some((_, digits)) => digits.trim_end_matches(|c: char| !c.is_ascii_hexdigit()),
        None if is_plain_hex && text.len() == 2 => text,
        None if text.is_empty() || text.contains("bit") || event(text).is_some() => {
            return Ok(None);
        }
        None => "",
    };
    let digits = digits.split([' ', ')']).next().unwrap_or_default();
    let byte = u8::from_str_radix(digits, 16).ok();
    ensure!(
        byte.is_some(),
        "{text:?} is no byte in hex such as 0x41: export the bytes, in hexadecimal"
    );
    Ok(byte)
}

/// Returns the event that an analyser's words for an error mean.
fn event(words: &str) -> Option<LineEvent> {
    let words = words.to_ascii_lowercase();
    let known = [
        ("break", LineEvent::Break),
        ("fram", LineEvent::Framing),
        ("parity err", LineEvent::Parity),
    ];
    let event = known.iter().find(|(word, _)| words.contains(word));
    event.map(|(_, event)| *event)
}
