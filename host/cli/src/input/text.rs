//! Reads bytes from text, line by line: hex as loggers, terminals and dumps print it.
//!
//! ```text
//!  [12:34:56.789] RX: AA C0 2C     time, label, bytes
//!  00000010  7e 23 04 ab  |~#..|   offset, bytes, their characters
//!  1234-5678 UART: RX data: AA     an annotation of sigrok
//! ```

use std::io::BufRead;

use anyhow::{Context, Result, ensure};
use framelock::LineEvent;

use super::analyser::{Decoded, is_annotation};
use super::arrivals::{Arrival, each};
use super::dump::{Dump, bytes};
use super::time::Times;

/// The line events that a log may contain as words.
const EVENTS: [LineEvent; 3] = [LineEvent::Break, LineEvent::Framing, LineEvent::Parity];

/// The greatest length of a label before the bytes of a line.
const LONGEST_LABEL: usize = 80;

/// Returns whether the beginning of a text has only annotations of sigrok, or only hex with times or offsets. Hex must
/// contain a digit from A to F, because a device may send lines with decimal numbers.
pub(super) fn is_log_or_dump(text: &str) -> bool {
    let text = text.rsplit_once('\n').map_or(text, |(lines, _)| lines);
    let mut lines = text.lines().filter(|line| !is_ignored(line));
    let kind = Text::of(lines.next().unwrap_or_default(), lines.next());
    let arrivals: Result<Vec<Arrival>> = arrivals(String::new(), text.as_bytes()).collect();
    let has_letter = |byte: &u8| byte >> 4 > 9 || byte & 0x0F > 9;
    arrivals.is_ok_and(|arrivals| {
        let is_timed = arrivals.iter().any(|arrival| arrival.time.is_some());
        let mut bytes = arrivals.iter().flat_map(|arrival| &arrival.bytes);
        match kind {
            Text::Annotations(_) => true,
            Text::Log(_) if !is_timed => false,
            Text::Log(_) | Text::Dump(_) => bytes.any(has_letter),
        }
    })
}

/// Returns whether a line is blank or a comment.
fn is_ignored(line: &str) -> bool {
    line.trim().is_empty() || line.starts_with('#')
}

/// Returns the bytes of each line as soon as the line has arrived, with its time.
pub(super) fn arrivals(
    name: String,
    reader: impl BufRead,
) -> impl Iterator<Item = Result<Arrival>> {
    let lines = (1_u64..).zip(reader.split(b'\n'));
    let lines = lines.map(|(number, line)| {
        let line = String::from_utf8_lossy(&line?).into_owned();
        let line = line.trim_start_matches('\u{FEFF}').trim_end();
        Ok((number, line.to_owned()))
    });
    let is_read = |line: &Result<(u64, String)>| !matches!(line, Ok((_, line)) if is_ignored(line));
    let mut lines = lines.filter(is_read);
    let mut first: Vec<_> = lines.by_ref().take(1).collect();
    // Wait for the second line only if the first may begin with an offset.
    if let [Ok((_, line))] = &*first
        && Dump::may_begin(line)
    {
        first.extend(lines.next());
    }
    let mut opening = first.iter().flatten().map(|(_, line)| &**line);
    let mut text = Text::of(opening.next().unwrap_or_default(), opening.next());
    each(name, first.into_iter().chain(lines), move |line| {
        text.arrival(line.as_deref())
    })
}

/// The kind of a text, which its first lines show.
enum Text {
    Log(Log),
    Dump(Dump),
    Annotations(Decoded),
}

impl Text {
    /// Returns the kind of a text that begins with this line. Some dumps can be recognised only with the next line.
    fn of(line: &str, next: Option<&str>) -> Self {
        match Dump::begin(line, next) {
            Some(dump) => Self::Dump(dump),
            None if is_annotation(line) => Self::Annotations(Decoded::default()),
            None => Self::Log(Log::default()),
        }
    }

    /// Reads a line, or the end of the text.
    fn arrival(&mut self, line: Option<&str>) -> Result<Option<Arrival>> {
        match (self, line) {
            (Self::Annotations(decoded), None) => Ok(decoded.held.take()),
            (_, None) => Ok(None),
            (Self::Log(log), Some(line)) => log.arrival(line).map(Some),
            (Self::Dump(dump), Some(line)) => Ok(Some(Arrival::new(None, dump.line(line)?))),
            (Self::Annotations(decoded), Some(line)) => decoded.annotation(line),
        }
    }
}

/// The state of reading a log.
#[derive(Default)]
struct Log {
    times: Times,
    /// The label before the bytes of the first line, without its digits.
    label: Option<String>,
}

impl Log {
    /// Reads a line. A line without a time has the time of the line before.
    fn arrival(&mut self, line: &str) -> Result<Arrival> {
        ensure!(
            !line.starts_with(':'),
            "a line that begins with a colon is text, as of Modbus ASCII, or of an Intel HEX file: these are not bytes in hex"
        );
        let had_time = self.times.last.is_some();
        let rest = self.times.strip(line)?;
        ensure!(
            rest.is_none() || had_time || self.label.is_none(),
            "this line has a time, but the lines before have none"
        );
        let (time, rest) = (self.times.last, rest.unwrap_or(line).trim());
        let is_event = |event: &LineEvent| rest.eq_ignore_ascii_case(&event.to_string());
        let event = EVENTS.into_iter().find(is_event);
        let (label, bytes) = match event {
            Some(_) => ("", Vec::new()),
            None => labelled(rest)?,
        };
        let label = label.trim().replace(|c: char| c.is_ascii_digit(), "");
        let first = self.label.get_or_insert_with(|| label.clone());
        ensure!(
            *first == label || bytes.is_empty(),
            "this line begins with '{label}', but the lines before with '{first}': keep the lines of one direction"
        );
        Ok(Arrival { time, bytes, event })
    }
}

/// Returns the label and the bytes of a line whose time has been removed. A label ends with punctuation, as in `RX:`
/// and `->`, or is `RX` or `TX` and a blank.
fn labelled(line: &str) -> Result<(&str, Vec<u8>)> {
    let why = match bytes(line) {
        Ok(bytes) => return Ok(("", bytes)),
        Err(why) => why,
    };
    let ends = line.match_indices(|c| " :,;|>-=)]".contains(c));
    let mut ends = ends.take_while(|(at, _)| *at < LONGEST_LABEL);
    let labelled = ends.find_map(|(at, end)| {
        let (label, rest) = line.split_at(at + 1);
        let mut letters = label.chars().filter(char::is_ascii_alphanumeric).peekable();
        let is_label = letters.peek().is_none() || letters.any(|c| !c.is_ascii_hexdigit());
        let is_end = match end {
            " " => ["rx ", "tx "].contains(&&*label.to_ascii_lowercase()),
            "," | ";" => true,
            _ => rest.starts_with(' '),
        };
        let bytes = (is_label && is_end).then(|| bytes(rest).ok())??;
        (!bytes.is_empty()).then_some((label, bytes))
    });
    labelled.with_context(|| format!("{why}; expected bytes such as 41 42 00 7F"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use rand::seq::IndexedRandom;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Parts of lines that are times, offsets, labels, bytes, characters or none of these.
    const PARTS: [&str; 3] = [
        "/ /  /#/*/[12.5]/(0.25)/(-1.5)/[/)/12:34:56/23:59:59.9/00:00:00.1/99:99:99.99/1.5/12.34/->/RX:/[TX] -/",
        "2024-12-31T/2024-12-31 /00000000/00000004:/0000000/ffffffffffffffff:/41 42 00/4142/0xAA/AA-C0/7/é/|AB.|/",
        r"AB./b'\xaa'/uart-1: RX data: 41/uart-1: RX data: 42",
    ];

    /// Reading lines of random parts never panics. Errors and all kinds of texts occur.
    #[test]
    fn any_lines_are_read_without_a_panic() {
        let parts = PARTS.concat();
        let parts: Vec<&str> = parts.split('/').collect();
        let mut random = ChaCha8Rng::seed_from_u64(67);
        let (mut errors, mut timed, mut dumped, mut annotated) = (0, 0, 0, 0);
        for _ in 0..20_000 {
            let mut text = String::new();
            for _ in 0..random.random_range(1..4) {
                for _ in 0..random.random_range(1..6) {
                    text += parts.choose(&mut random).unwrap();
                    text += ["", " "].choose(&mut random).unwrap();
                }
                text.push('\n');
            }
            is_log_or_dump(&text);
            let mut lines = text.lines().filter(|line| !is_ignored(line));
            let kind = Text::of(lines.next().unwrap_or_default(), lines.next());
            match arrivals("x".into(), text.as_bytes()).collect::<Result<Vec<_>>>() {
                Err(_) => errors += 1,
                Ok(arrivals) => match kind {
                    Text::Dump(_) => dumped += 1,
                    Text::Annotations(_) => annotated += 1,
                    Text::Log(_) => {
                        timed += usize::from(arrivals.iter().any(|one| one.time.is_some()));
                    }
                },
            }
        }
        let counts = [errors, timed, dumped, annotated];
        assert!(counts.iter().all(|count| *count > 10), "{counts:?}");
    }
}
