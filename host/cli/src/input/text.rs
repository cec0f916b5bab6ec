//! Reads bytes from text, line by line: hex as loggers, terminals and dumps print it.
//!
//! ```text
//!  [12:34:56.789] RX: AA C0 2C     time, label, bytes
//!  00000010  7e 23 04 ab  |~#..|   offset, bytes, their characters
//!  1234-5678 UART: RX data: AA     an annotation of sigrok
//! ```

use std::io::BufRead;
use std::iter::from_fn;

use anyhow::{Result, anyhow};
use framelock::LineEvent;
use framelock_description::HexError;
use framelock_description::hex::parse_printed;

use super::analyser::{Decoded, EVENTS};
use super::arrivals::Arrival;
use super::dump::{Dump, without_characters};
use super::time::Times;

/// The number of characters of a line in messages.
const SHOWN: usize = 40;

/// Returns whether the beginning of a text is annotations of sigrok, or hex with times or offsets. All its lines must be,
/// and some byte must have a digit from A to F, because a device may send lines with decimal numbers.
pub(super) fn is_log_or_dump(text: &str) -> bool {
    let text = text.rsplit_once('\n').map_or(text, |(lines, _)| lines);
    let mut lines = text.lines().filter(|line| !is_ignored(line));
    let (first, second) = (lines.next().unwrap_or_default(), lines.next());
    let kind = Text::of(first, second);
    let arrivals: Result<Vec<Arrival>> = arrivals(String::new(), text.as_bytes()).collect();
    let has_letter = |byte: &u8| byte >> 4 > 9 || byte & 0x0F > 9;
    match (kind, arrivals) {
        (Ok(Text::Annotations(_)), Ok(_)) => true,
        (Ok(kind), Ok(arrivals)) => {
            let is_dump = matches!(kind, Text::Dump(_));
            let mut bytes = arrivals.iter().flat_map(|arrival| &arrival.bytes);
            (is_dump || arrivals.iter().any(|arrival| arrival.time.is_some()))
                && bytes.any(has_letter)
        }
        _ => false,
    }
}

/// Returns whether a line is blank or a comment.
fn is_ignored(line: &str) -> bool {
    line.trim_end().is_empty() || line.starts_with('#')
}

/// The kind of a text, which its first lines show.
enum Text {
    Log(Log),
    Dump(Dump),
    Annotations(Decoded),
}

/// The parts of a log that all lines must have in common.
#[derive(Default)]
struct Log {
    times: Times,
    /// The label before the bytes of the first line, without its digits.
    label: Option<String>,
}

/// Returns the bytes of each line as soon as the line has arrived, with its time.
pub(super) fn arrivals(
    name: String,
    reader: impl BufRead,
) -> impl Iterator<Item = Result<Arrival>> {
    let mut lines = (1_u64..).zip(reader.split(b'\n')).peekable();
    let mut text = None;
    from_fn(move || {
        loop {
            let Some((number, line)) = lines.next() else {
                let Some(Text::Annotations(annotations)) = &mut text else {
                    return None;
                };
                return annotations.rest().map(Ok);
            };
            let line = match line {
                Ok(line) => line,
                Err(error) => return Some(Err(error.into())),
            };
            let line = String::from_utf8_lossy(&line);
            let line = line.trim_start_matches('\u{FEFF}').trim_end();
            if is_ignored(line) {
                continue;
            }
            let mut arrival = || {
                if text.is_none() {
                    // Wait for the second line only if the first may begin with an offset.
                    let next = Dump::may_begin(line).then(|| lines.peek()).flatten();
                    let next = next.and_then(|(_, next)| next.as_ref().ok());
                    let next = next.map(|next| String::from_utf8_lossy(next));
                    text = Some(Text::of(line, next.as_deref())?);
                }
                text.as_mut().map_or(Ok(None), |text| text.arrival(line))
            };
            match arrival() {
                Ok(None) => {}
                Ok(Some(arrival)) => return Some(Ok(arrival)),
                Err(why) => return Some(Err(anyhow!("{name}: line {number}: {why}"))),
            }
        }
    })
}

impl Text {
    /// Returns the kind of a text with this first line. The next line shows whether both begin with offsets.
    fn of(line: &str, next: Option<&str>) -> Result<Self, String> {
        Ok(match Dump::begins(line, next)? {
            Some(dump) => Self::Dump(dump),
            None if Decoded::has(line) => Self::Annotations(Decoded::default()),
            None => Self::Log(Log::default()),
        })
    }

    /// Reads a line.
    fn arrival(&mut self, line: &str) -> Result<Option<Arrival>, String> {
        match self {
            Self::Log(log) => log.arrival(line).map(Some),
            Self::Dump(dump) => {
                let (bytes, time, event) = (dump.line(line)?, None, None);
                Ok(Some(Arrival { time, bytes, event }))
            }
            Self::Annotations(annotations) => {
                annotations.annotation(line).map_err(|why| why.to_string())
            }
        }
    }
}

impl Log {
    /// Reads a line. A line without a time has that of the line before.
    fn arrival(&mut self, line: &str) -> Result<Arrival, String> {
        let is_timed = self.times.last.is_some();
        let rest = self.times.strip(line)?;
        if rest.is_some() && !is_timed && self.label.is_some() {
            return Err("this line has a time, but the lines before have none".into());
        }
        let rest = rest.unwrap_or(line).trim();
        let is_event = |event: &LineEvent| rest.eq_ignore_ascii_case(&event.to_string());
        let event = EVENTS.into_iter().find(is_event);
        let (label, bytes) = match event {
            Some(_) => ("", Vec::new()),
            None => {
                parse(rest).map_err(|why| format!("{why}; expected bytes such as 41 42 00 7F"))?
            }
        };
        let label = label.replace(|c: char| c.is_ascii_digit(), "");
        let first = self.label.get_or_insert_with(|| label.clone());
        if *first != label && !bytes.is_empty() {
            let shown = |label: &str| label.trim().chars().take(SHOWN).collect::<String>();
            let (first, label) = (shown(first), shown(&label));
            return Err(format!(
                "this line begins with '{label}', but the lines before with '{first}': keep the lines of one direction"
            ));
        }
        let time = self.times.last;
        Ok(Arrival { time, bytes, event })
    }
}

/// Returns the label and the bytes of a line without its time. A label, such as `RX:` or `->`, ends with punctuation.
fn parse(line: &str) -> Result<(&str, Vec<u8>), HexError> {
    let bytes = |text: &str| without_characters(text).map_or_else(|| parse_printed(text), Ok);
    let why = match bytes(line) {
        Ok(bytes) => return Ok(("", bytes)),
        Err(why) => why,
    };
    let labels = line
        .char_indices()
        .filter(|(_, c)| " :,;|>-=)]".contains(*c));
    let mut labelled = labels.filter_map(|(at, c)| {
        let (label, rest) = line.split_at(at + 1);
        let mut letters = label.chars().filter(char::is_ascii_alphanumeric).peekable();
        let is_label = letters.peek().is_none() || letters.any(|c| !c.is_ascii_hexdigit());
        let is_direction = ["rx ", "tx "].contains(&&*label.to_ascii_lowercase());
        let ends = is_direction || c != ' ' && (rest.starts_with(' ') || ",;".contains(c));
        let rest = (is_label && ends).then(|| bytes(rest).ok())?;
        Some((label, rest.filter(|bytes| !bytes.is_empty())?))
    });
    labelled.next().ok_or(why)
}
