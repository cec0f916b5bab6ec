//! Time stamps in logs.

use std::sync::LazyLock;

use anyhow::{Result, bail};
use regex::{Captures, Regex};

/// A time at the beginning of a line: a time of day or a number of seconds, perhaps in brackets, with a date before it
/// or an arrow after it.
static STAMP: LazyLock<Regex> = LazyLock::new(|| {
    let pattern = r"(?x) ^ \s* (?<open> [\[(] \s* )?
        (?<date> \d{1,4} [-/.] \d{1,2} [-/.] \d{1,4} (?: T | [\s,;_]+ ) )?
        (?: (?<hours> \d{1,2} ) : (?<minutes> \d\d ) : )?
        (?<seconds> -? \d{1,20} (?<fraction> [.,] \d{1,20} | :\d{3} )? )
        (?: Z | [+-] \d\d :? \d\d )?
        (?: (?<close> \s* [\])] [:,;|]? ) | (?<arrow> \s* -> ) | (?<comma> \s* [,;|>] ) | :? (?: \s | $ ) ) \s*";
    Regex::new(pattern).expect("the pattern is valid")
});

/// Reads the times at the beginnings of a log's lines.
#[derive(Default)]
pub(super) struct Times {
    /// The time of the last line, in microseconds. `None` if no line had a time.
    pub(super) last: Option<i64>,
    /// The last midnight, in microseconds since the midnight before the first line.
    midnight: i64,
}

const DAY: i64 = 86_400_000_000;

impl Times {
    /// Returns the rest of a line without its time, and stores the time. Returns `None` if the line has no time.
    ///
    /// # Errors
    /// Returns an error if the line's beginning may be either a time or bytes.
    pub(super) fn strip<'l>(&mut self, line: &'l str) -> Result<Option<&'l str>> {
        let Some(found) = STAMP.captures(line) else {
            return Ok(None);
        };
        let (stamp, rest) = line.split_at(found[0].len());
        let has = |name| found.name(name).is_some();
        let (is_clock, has_fraction) = (has("hours"), has("fraction"));
        let is_marked = has("open") || has("date") || has("arrow");
        // Numbers with commas may be bytes. So unless the number is marked, a comma is allowed only after a fraction of
        // three or more digits.
        let is_long = has_fraction && found["fraction"].len() > 3;
        let is_number = is_marked || !found["seconds"].contains(',') && (is_long || !has("comma"));
        if has("open") != has("close") || !(is_clock || has_fraction && is_number) {
            return Ok(None);
        }
        let is_pair = matches!(found["seconds"].as_bytes(), [_, _, b'.', _, _]);
        let is_weak = !is_marked && if is_clock { !has_fraction } else { is_pair };
        if is_weak && self.last.is_none() {
            // All bytes of a line have the same separator. So if the rest is empty, or has a colon or a point, too,
            // this line is bytes.
            if rest.is_empty() || rest.contains([':', '.']) {
                return Ok(None);
            }
            let stamp = stamp.trim();
            bail!(
                "{stamp} may be a time or bytes: write the time as [{stamp}], or the bytes with blanks between them"
            );
        }
        let mut time = microseconds(&found);
        if is_clock {
            // At midnight, the time of day starts again from 0.
            let is_next_day =
                |last: i64| time.saturating_add(self.midnight) < last.saturating_sub(DAY / 2);
            if self.last.is_some_and(is_next_day) {
                self.midnight += DAY;
            }
            time = time.saturating_add(self.midnight);
        }
        self.last = Some(time);
        Ok(Some(rest))
    }
}

/// Returns the time that a stamp shows, in microseconds. A time of day counts from midnight.
fn microseconds(stamp: &Captures) -> i64 {
    let number = |name| {
        let digits = stamp.name(name).map_or("0", |part| part.as_str());
        digits.replace([',', ':'], ".").parse().unwrap_or(0.0_f64)
    };
    from_seconds(number("hours") * 3600.0 + number("minutes") * 60.0 + number("seconds"))
}

/// Returns seconds in microseconds. A time that is out of range becomes the nearest time.
#[allow(
    clippy::cast_possible_truncation,
    reason = "the nearest time is wanted"
)]
pub(super) fn from_seconds(seconds: f64) -> i64 {
    (seconds * 1e6).round() as i64
}
