//! Reads dumps: lines that begin with the offset of their first byte, as xxd, hexdump -C, od -tx1 and Wireshark print
//! them.

use std::sync::LazyLock;

use framelock_description::hex::{parse, parse_printed};
use regex::Regex;

/// An offset at the beginning of a line.
static OFFSET: LazyLock<Regex> = LazyLock::new(|| {
    let pattern = r"^\s*(?:0x)?([0-9a-fA-F]{4,16})(:?)(\s+|$)";
    Regex::new(pattern).expect("the pattern is valid")
});

/// The greatest number of bytes that a line `*` may replace.
const MOST_REPEATED: u64 = 1 << 30;

/// A dump up to a line.
pub(super) struct Dump {
    /// The first offset, as the dump spells it.
    start: String,
    /// The bases in which all offsets so far can be read.
    bases: Vec<u32>,
    /// The number of bytes so far.
    count: u64,
    /// The bytes of the last line, which a line `*` repeats.
    last: Vec<u8>,
    is_repeated: bool,
}

impl Dump {
    /// Returns whether the first line of a text begins like a dump.
    pub(super) fn may_begin(line: &str) -> bool {
        OFFSET.is_match(line)
    }

    /// Returns the beginning of a dump if the first line of a text, or its first two lines, begin with offsets.
    ///
    /// # Errors
    /// Returns an error if the line may have an offset or not.
    pub(super) fn begins(line: &str, next: Option<&str>) -> Result<Option<Self>, String> {
        let Some(found) = OFFSET.captures(line) else {
            return Ok(None);
        };
        let (start, rest) = (&found[1], line[found[0].len()..].trim());
        // The offsets of od have seven digits. They are octal, unless an option says otherwise.
        let bases: &[u32] = if start.len() == 7 {
            &[8, 10, 16]
        } else {
            &[16, 10]
        };
        let new = Self {
            start: start.to_owned(),
            bases: bases.to_vec(),
            count: 0,
            last: Vec::new(),
            is_repeated: false,
        };
        let is_zero = start.bytes().all(|digit| digit == b'0');
        let is_offset =
            !found[2].is_empty() || is_zero && (start.len() % 2 == 1 || found[3].len() > 1);
        if is_offset && !rest.is_empty() {
            return Ok(Some(new));
        }
        let follows = next.is_some_and(|next| {
            let mut dump = Self {
                bases: new.bases.clone(),
                start: start.to_owned(),
                last: Vec::new(),
                ..new
            };
            let bytes = bytes_of(rest);
            dump.count = bytes.map_or(0, |bytes| bytes.len() as u64);
            dump.count > 0
                && OFFSET
                    .captures(next)
                    .is_some_and(|next| dump.follows(&next[1]))
        });
        let is_longer = rest
            .split_whitespace()
            .next()
            .is_some_and(|word| word.len() < start.len());
        match next {
            _ if follows => Ok(Some(new)),
            None if is_zero && is_longer => Err(format!(
                "{start} may be an offset or bytes: write {start}: or the bytes in pairs of digits"
            )),
            _ => Ok(None),
        }
    }

    /// Returns the bytes of a line, and the bytes that a line `*` before replaces.
    pub(super) fn line(&mut self, line: &str) -> Result<Vec<u8>, String> {
        if line.trim() == "*" {
            self.is_repeated = true;
            return Ok(Vec::new());
        }
        let found = OFFSET.captures(line).ok_or("the offset is missing")?;
        let (offset, rest) = (&found[1], &line[found[0].len()..]);
        let mut bytes = Vec::new();
        if std::mem::take(&mut self.is_repeated) {
            bytes = self.repeated(offset);
        } else if self.count > 0 && offset.bytes().all(|digit| digit == b'0') {
            // Another dump begins, for example of Wireshark's next packet.
            (self.count, self.start) = (0, offset.to_owned());
        }
        self.count += bytes.len() as u64;
        if !self.follows(offset) {
            let count = self.count;
            return Err(format!(
                "the offset {offset} does not follow from {count} bytes before: is a line missing?"
            ));
        }
        let is_pair = |word: &str| word.len() == 2;
        let mut words = rest
            .split("  ")
            .next()
            .unwrap_or_default()
            .split_whitespace();
        if found[2].is_empty() && !words.all(is_pair) {
            return Err("words of several bytes may be in another order than the bytes: dump with xxd, hexdump -C or \
                 od -tx1".into());
        }
        self.last = bytes_of(rest)?;
        self.count += self.last.len() as u64;
        bytes.extend(&self.last);
        Ok(bytes)
    }

    /// Keeps the bases in which this offset is the start plus the bytes so far. Returns whether there is one.
    fn follows(&mut self, offset: &str) -> bool {
        let (start, count) = (&self.start, self.count);
        self.bases
            .retain(|base| distance(start, offset, *base) == Some(count));
        !self.bases.is_empty()
    }

    /// Returns the bytes that a line `*` before this offset replaces: whole lines.
    fn repeated(&self, offset: &str) -> Vec<u8> {
        let missing = self.bases.iter().find_map(|base| {
            let missing = distance(&self.start, offset, *base)?.checked_sub(self.count)?;
            let is_whole = missing.checked_rem(self.last.len() as u64) == Some(0);
            (is_whole && missing <= MOST_REPEATED).then_some(missing)
        });
        let lines = missing.unwrap_or(0) / (self.last.len() as u64).max(1);
        self.last.repeat(usize::try_from(lines).unwrap_or(0))
    }
}

/// Returns the number of bytes between two offsets.
fn distance(start: &str, offset: &str, base: u32) -> Option<u64> {
    let number = |text| u64::from_str_radix(text, base).ok();
    number(offset)?.checked_sub(number(start)?)
}

fn bytes_of(text: &str) -> Result<Vec<u8>, String> {
    without_characters(text).map_or_else(|| parse_printed(text).map_err(|why| why.to_string()), Ok)
}

/// Returns the bytes of a line if the same bytes follow as characters, with a dot for each byte that is no character.
pub(super) fn without_characters(line: &str) -> Option<Vec<u8>> {
    // A line is padded by at most a few dozen blanks.
    line.match_indices("  ").take(100).find_map(|(at, _)| {
        let bytes = parse(&[&line[..at]]).ok()?;
        let character = |byte: &u8| {
            if matches!(byte, b' '..=b'~') {
                char::from(*byte)
            } else {
                '.'
            }
        };
        let characters: String = bytes.iter().map(character).collect();
        let shown = line[at..].trim();
        let is_framed = [format!("|{characters}|"), format!(">{characters}<")]
            .iter()
            .any(|framed| framed == shown);
        (is_framed || shown == characters.trim()).then_some(bytes)
    })
}
