//! Reads dumps: lines that begin with the offset of their first byte, as xxd, hexdump -C, od -tx1 and Wireshark print
//! them.

use std::sync::LazyLock;

use anyhow::{Context, Result, ensure};
use framelock_description::HexError;
use framelock_description::hex::{parse, parse_printed};
use regex::Regex;

/// An offset at the beginning of a line.
static OFFSET: LazyLock<Regex> = LazyLock::new(|| {
    let pattern = r"^(\s*)(?:0x)?([0-9a-fA-F]{4,16})(:?)(\s+|$)";
    Regex::new(pattern).expect("the pattern is valid")
});

/// The greatest number of bytes that a line `*` may replace.
const MOST_REPEATED: u64 = 1 << 28;

/// The state of reading a dump, line by line.
#[derive(Default)]
pub(super) struct Dump {
    /// The blanks before an offset. A dump of both directions of a line indents one direction.
    indentation: usize,
    /// The offset of the next line.
    next: u64,
    /// The bytes of the last line, which a line `*` repeats.
    last: Vec<u8>,
    is_repeated: bool,
}

impl Dump {
    /// Returns whether a line may begin a dump.
    pub(super) fn may_begin(line: &str) -> bool {
        OFFSET.is_match(line)
    }

    /// Returns the state at the beginning of a dump, or `None` if a text with these first two lines is no dump. Some
    /// offsets can be recognised in the first line. For others, the second line must begin with the offset that
    /// follows.
    pub(super) fn begin(line: &str, second: Option<&str>) -> Option<Self> {
        let found = OFFSET.captures(line)?;
        let (start, rest) = (offset(&found[2])?, &line[found[0].len()..]);
        let has_gap = found[2].len() % 2 == 1 || found[4].len() > 1;
        let is_offset = !found[3].is_empty() || start == 0 && has_gap;
        let follows = || {
            let second = offset(&OFFSET.captures(second?)?[2])?;
            let length = bytes(rest).ok()?.len() as u64;
            Some(length > 0 && second == start.saturating_add(length))
        };
        let is_dump = !rest.is_empty() && (is_offset || follows() == Some(true));
        is_dump.then(|| Self {
            indentation: found[1].len(),
            next: start,
            ..Self::default()
        })
    }

    /// Returns the bytes of a line. If a line `*` precedes it, the bytes that `*` stands for come first.
    pub(super) fn line(&mut self, line: &str) -> Result<Vec<u8>> {
        if line.trim() == "*" {
            self.is_repeated = true;
            return Ok(Vec::new());
        }
        let found = OFFSET.captures(line).context("the offset is missing")?;
        let (word, rest) = (&found[2], &line[found[0].len()..]);
        let offset = offset(word).with_context(|| format!("{word} is no offset"))?;
        let mut repeated = Vec::new();
        if std::mem::take(&mut self.is_repeated) {
            let missing = offset.saturating_sub(self.next).min(MOST_REPEATED);
            let lines = missing.checked_div(self.last.len() as u64).unwrap_or(0);
            repeated = self.last.repeat(usize::try_from(lines)?);
            self.next += repeated.len() as u64;
        } else if offset == 0 {
            // Another dump begins, for example of Wireshark's next packet.
            self.next = 0;
        }
        ensure!(
            offset == self.next,
            "the offset {word} does not follow from the lines before: is a line missing?"
        );
        ensure!(
            found[1].len() == self.indentation,
            "this line is indented otherwise than the lines before: keep the lines of one direction"
        );
        let mut words = rest.split("  ").next().unwrap_or_default().split(' ');
        ensure!(
            !found[3].is_empty() || words.all(|word| word.is_empty() || word.len() == 2),
            "words of several bytes may be in another order than the bytes: dump with xxd, hexdump -C or od -tx1"
        );
        self.last = bytes(rest)?;
        self.next = offset.saturating_add(self.last.len() as u64);
        repeated.extend(&self.last);
        Ok(repeated)
    }
}

/// Parses an offset. Offsets of seven digits are those of od, which are octal.
fn offset(digits: &str) -> Option<u64> {
    let base = if digits.len() == 7 { 8 } else { 16 };
    u64::from_str_radix(digits, base).ok()
}

/// Returns the bytes of a line. The same bytes may follow as characters, with a dot for a byte that is no character.
pub(super) fn bytes(line: &str) -> Result<Vec<u8>, HexError> {
    // A line is padded by at most a few dozen blanks.
    let mut parts = line.match_indices("  ").take(100);
    let before_characters = parts.find_map(|(at, _)| {
        let bytes = parse(&[&line[..at]]).ok()?;
        let is_character = |byte: u8| matches!(byte, b' '..=b'~');
        let characters = bytes
            .iter()
            .map(|&byte| if is_character(byte) { byte.into() } else { '.' });
        let characters: String = characters.collect();
        let shown = [format!("|{characters}|"), format!(">{characters}<")];
        let rest = line[at..].trim();
        (rest == characters.trim() || shown.iter().any(|shown| shown == rest)).then_some(bytes)
    });
    before_characters.map_or_else(|| parse_printed(line), Ok)
}
