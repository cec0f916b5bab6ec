//! Reads the bytes that a logic analyser decoded: tables in CSV of Saleae, Kingst and `DSView`, and annotations of sigrok.
//! A byte with a parity or framing error is not delivered: the error takes its place, as in a UART's driver.

use std::io::BufRead;
use std::iter::from_fn;
use std::sync::LazyLock;

use anyhow::{Context, Result, bail, ensure};
use csv::{ReaderBuilder, StringRecord, Trim};
use framelock::LineEvent;
use regex::Regex;

use super::arrivals::Arrival;
use super::time::{Times, from_seconds};

/// The line events that recordings can have.
pub(super) const EVENTS: [LineEvent; 5] = [
    LineEvent::Break,
    LineEvent::Framing,
    LineEvent::Parity,
    LineEvent::Overrun,
    LineEvent::Idle,
];

/// The columns of a table.
struct Columns {
    time: usize,
    /// The length of the time's unit, in seconds.
    unit: f64,
    value: usize,
    /// Whether two digits without `0x` are hex.
    is_plain_hex: bool,
    /// The columns of errors, with their names.
    errors: Vec<(usize, String)>,
    /// The column that names the analyser.
    name: Option<usize>,
}

impl Columns {
    /// Returns the columns that a header names.
    fn of(header: &StringRecord) -> Option<Self> {
        let names: Vec<String> = header.iter().map(str::to_ascii_lowercase).collect();
        let column = |is_it: &dyn Fn(&str) -> bool| names.iter().position(|name| is_it(name));
        let time = column(&|name| name.starts_with("time") || name == "start_time")?;
        let is_uart = |name: &str| name.contains(":uart");
        let is_value = |name: &str| {
            ["value", "data", "decoded protocol result"].contains(&name) || is_uart(name)
        };
        let value = column(&is_value)?;
        let units = [("[ns]", 1e-9), ("[us]", 1e-6), ("[ms]", 1e-3)];
        let unit = units.iter().find(|(unit, _)| names[time].ends_with(unit));
        let errors = names
            .iter()
            .enumerate()
            .filter(|(_, name)| name.contains("error"));
        (names.iter().filter(|name| is_value(name)).count() == 1).then(|| Self {
            time,
            unit: unit.map_or(1.0, |(_, seconds)| *seconds),
            value,
            is_plain_hex: is_uart(&names[value]),
            errors: errors.map(|(at, name)| (at, name.clone())).collect(),
            name: column(&|name| ["name", "analyzer name"].contains(&name)),
        })
    }
}

/// Returns whether a text begins with the header of an analyser's table. No text on a serial line begins like this.
pub(super) fn is_header(text: &str) -> bool {
    let line = text.lines().next().unwrap_or_default();
    let line = line.trim_start_matches('\u{FEFF}').replace('"', "");
    let cells = StringRecord::from(line.split(',').map(str::trim).collect::<Vec<_>>());
    (line.contains('[') || line.contains("start_time")) && Columns::of(&cells).is_some()
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
    let columns = Columns::of(reader.headers()?).with_context(|| {
        format!(
            "{name} is no table of a logic analyser: it needs a header with a time and a value, such as Time [s],Value"
        )
    })?;
    let mut rows = reader.into_records();
    let mut decoded = Decoded::default();
    Ok(from_fn(move || {
        loop {
            let Some(row) = rows.next() else {
                return decoded.held.take().map(Ok);
            };
            let row = row.map_err(Into::into).and_then(|row| {
                let line = row.position().map_or(0, csv::Position::line);
                let arrival = decoded.row(&columns, &row);
                arrival.with_context(|| format!("{name}: line {line}"))
            });
            if let Some(arrival) = row.transpose() {
                return Some(arrival);
            }
        }
    }))
}

/// The bytes that an analyser decoded on one line.
#[derive(Default)]
pub(super) struct Decoded {
    /// The last byte. A row after it may say that the byte has an error.
    held: Option<Arrival>,
    times: Times,
    /// The name of the line in the first row.
    line: Option<String>,
}

impl Decoded {
    /// Reads a row of a table. Returns the arrival before the row's byte.
    fn row(&mut self, columns: &Columns, row: &StringRecord) -> Result<Option<Arrival>> {
        let cell = |at: usize| row.get(at).unwrap_or_default();
        if let Some(name) = columns.name {
            self.check_line(cell(name))?;
        }
        let time = match cell(columns.time) {
            clock if clock.contains(':') => {
                self.times.strip(clock).ok().flatten().and(self.times.last)
            }
            number => number
                .parse()
                .ok()
                .map(|number: f64| from_seconds(number * columns.unit)),
        };
        let is_error =
            |cell: &str| !["", "0", "false", "no"].contains(&&*cell.to_ascii_lowercase());
        let errors = columns.errors.iter().find(|(at, _)| is_error(cell(*at)));
        let error = errors.map(|(at, name)| event(&format!("{name} {}", cell(*at))));
        ensure!(
            time.is_some(),
            "{:?} is no time in seconds",
            cell(columns.time)
        );
        let (byte, event) = decoded(cell(columns.value), columns.is_plain_hex)?;
        Ok(self.push(time, byte, error.or(event)))
    }

    /// Checks that all rows belong to one line.
    fn check_line(&mut self, line: &str) -> Result<()> {
        let first = self.line.get_or_insert_with(|| line.to_owned());
        ensure!(
            first == line,
            "this row is of {line}, the first row of {first}: keep the rows of one"
        );
        Ok(())
    }

    /// Takes a byte, or an error of the last byte. Returns the arrival before the byte.
    fn push(
        &mut self,
        time: Option<i64>,
        byte: Option<u8>,
        event: Option<LineEvent>,
    ) -> Option<Arrival> {
        let before = byte.and_then(|byte| {
            let bytes = vec![byte];
            self.held.replace(Arrival {
                time,
                bytes,
                event: None,
            })
        });
        if let Some(event) = event {
            let held = self.held.get_or_insert(Arrival {
                time,
                ..Arrival::default()
            });
            // During a break, a UART sees zeros without a stop bit.
            let is_break = event == LineEvent::Framing && held.bytes == [0];
            held.event = Some(if is_break { LineEvent::Break } else { event });
            held.bytes.clear();
        }
        before
    }
}

/// Returns the byte in an analyser's text, and its error. A start or stop bit is neither.
fn decoded(text: &str, is_plain_hex: bool) -> Result<(Option<u8>, Option<LineEvent>)> {
    let lower = text.to_ascii_lowercase();
    let byte = match (lower.split_once("0x"), lower.strip_prefix("0b")) {
        (Some((_, digits)), _) => {
            let end = digits.find(|c: char| !c.is_ascii_hexdigit());
            u8::from_str_radix(&digits[..end.unwrap_or(digits.len())], 16).ok()
        }
        (None, Some(bits)) => u8::from_str_radix(&bits.replace(' ', ""), 2).ok(),
        _ if is_plain_hex && lower.len() == 2 => u8::from_str_radix(&lower, 16).ok(),
        _ => None,
    };
    let has_error = lower.contains("error") || lower.contains("break");
    let event = has_error.then(|| event(&lower));
    if byte.or(event.map(|_| 0)).is_none() && !lower.is_empty() && !lower.contains("bit") {
        bail!("{text:?} is no byte in hex such as 0x41: export the bytes, in hexadecimal");
    }
    Ok((byte, event))
}

/// Returns the event that an analyser's words for an error mean.
fn event(words: &str) -> LineEvent {
    let known = [
        ("break", LineEvent::Break),
        ("fram", LineEvent::Framing),
        ("parity", LineEvent::Parity),
    ];
    let known = known
        .iter()
        .find(|(word, _)| words.to_ascii_lowercase().contains(word));
    known.map_or(LineEvent::Framing, |(_, event)| *event)
}

/// Annotations of sigrok: perhaps samples, a decoder, perhaps a class, and a text, such as `uart-1: RX data: 41`.
static ANNOTATION: LazyLock<Regex> = LazyLock::new(|| {
    let pattern = r#"(?ix) ^ (?: \d+-\d+ \s+ )? (uart [-\d]*) : \s+ (?: ([^:"]*) : \s+ )?
        "? ( [0-9a-f]{1,2} | [^"]* (?: bit | error | condition ) ) "? $"#;
    Regex::new(pattern).expect("the pattern is valid")
});

impl Decoded {
    /// Returns whether a line is an annotation of sigrok's UART decoder.
    pub(super) fn has(line: &str) -> bool {
        ANNOTATION.is_match(line)
    }

    /// Reads an annotation. Returns the arrival before its byte. Samples are no times, because the rate is unknown.
    pub(super) fn annotation(&mut self, line: &str) -> Result<Option<Arrival>> {
        let found = ANNOTATION
            .captures(line)
            .context("this line is no annotation of a UART")?;
        let class = found.get(2).map_or("", |class| class.as_str());
        let class_words = class.to_ascii_lowercase();
        if class_words.contains("bit") && !class_words.contains("err") {
            return Ok(None);
        }
        let (byte, event) = decoded(&found[3], true)?;
        if byte.is_some() {
            self.check_line(&format!("{} {class}", &found[1]))?;
        }
        Ok(self.push(None, byte, event))
    }

    /// Returns the last arrival.
    pub(super) fn rest(&mut self) -> Option<Arrival> {
        self.held.take()
    }
}
