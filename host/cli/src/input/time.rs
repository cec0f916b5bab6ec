//! Time stamps in logs.

use std::sync::LazyLock;

use regex::{Captures, Regex};

/// A time at the beginning of a line: a clock or seconds, perhaps in brackets, with a date or with an arrow behind it.
static STAMP: LazyLock<Regex> = LazyLock::new(|| {
    let pattern = r"(?x) ^ \s* (?<open> [\[(] \s* )?
        (?<date> \d{1,4} [-/.] \d{1,2} [-/.] \d{1,4} (?: T | [\s,;_]+ ) )?
        (?: (?<hours> \d{1,2} ) : (?<minutes> \d\d ) : )?
        (?<seconds> -? \d+ (?: [.,] \d+ | :\d{3} )? )
        (?: Z | [+-] \d\d :? \d\d )?
        (?: (?<close> \s* [\])] [:,;|]? ) | (?<arrow> \s* -> ) | (?<comma> \s* [,;|>] ) | :?\s | $ ) \s*";
    Regex::new(pattern).expect("the pattern is valid")
});

/// Reads the times at the beginnings of a log's lines.
#[derive(Default)]
pub(super) struct Times {
    /// The time of the last line, in microseconds. `None` if no line had a time.
    pub(super) last: Option<i64>,
    /// Midnights since the first line, in microseconds, for clocks without a date.
    midnights: i64,
}

const DAY: i64 = 86_400_000_000;

impl Times {
    /// Returns the rest of a line without its time, and stores the time. Returns `None` if the line has no time.
    ///
    /// # Errors
    /// Returns an error if the line's beginning may be a time or bytes.
    pub(super) fn strip<'l>(&mut self, line: &'l str) -> Result<Option<&'l str>, String> {
        let Some(found) = STAMP.captures(line) else {
            return Ok(None);
        };
        let has = |name| found.name(name).is_some();
        let (seconds, rest) = (&found["seconds"], &line[found[0].len()..]);
        let has_fraction = seconds.contains(['.', ',', ':']);
        let is_pair_of_bytes = matches!(seconds.as_bytes(), [_, _, b'.', _, _]);
        let is_time = match (has("hours"), has("date") || has("open") && has("close")) {
            _ if has("open") != has("close") => false,
            (true, true) => true,
            (true, false) if has_fraction || has("arrow") => true,
            (false, true) => has_fraction,
            (false, false) if seconds.contains(',') || has("comma") || !has_fraction => false,
            (false, false) if !is_pair_of_bytes || has("arrow") => true,
            // Without the other lines, this beginning would be ambiguous.
            _ if self.last.is_some() => true,
            // Bytes with the same separators follow, or nothing.
            _ if rest.is_empty() || rest.contains([':', '.']) => false,
            _ => {
                let word = found[0].trim();
                return Err(format!(
                    "{word} may be a time or bytes: write the time as [{word}], or the bytes with blanks between them"
                ));
            }
        };
        if !is_time {
            return Ok(None);
        }
        let time = microseconds(&found);
        let before = *self.last.get_or_insert(time);
        // A clock without a date starts again at midnight.
        if has("hours") && time.saturating_add(self.midnights) < before.saturating_sub(DAY / 2) {
            self.midnights += DAY;
        }
        self.last = Some(time.saturating_add(self.midnights));
        Ok(Some(rest))
    }
}

/// Returns the time that a stamp shows, in microseconds. A clock counts from midnight.
fn microseconds(stamp: &Captures) -> i64 {
    let number = |name| stamp.name(name).map_or("0", |part| part.as_str());
    let whole = |name| number(name).parse().unwrap_or(0.0_f64);
    let seconds = number("seconds").replace([',', ':'], ".");
    let seconds = seconds.parse().unwrap_or(0.0_f64);
    from_seconds(whole("hours") * 3600.0 + whole("minutes") * 60.0 + seconds)
}

/// Returns seconds in microseconds. A time that is out of range becomes the nearest time.
#[allow(
    clippy::cast_possible_truncation,
    reason = "the nearest time is wanted"
)]
pub(super) fn from_seconds(seconds: f64) -> i64 {
    (seconds * 1e6).round() as i64
}
