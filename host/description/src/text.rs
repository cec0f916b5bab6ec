//! Makes text from any source safe to show on a terminal. Control codes and other bytes on which a terminal would act
//! are escaped one by one, as in `\x1B`.

use serde_json::Value as Json;

/// The greatest number of characters that an error quotes from a text.
const QUOTED: usize = 40;

/// Appends bytes that may be text. Bytes that are not printable, or not UTF-8, are escaped as in `\x1B`. A backslash
/// becomes `\\`. [`unescaped`] restores the same bytes.
pub fn escape(bytes: &[u8], into: &mut Vec<u8>) {
    let is_plain = |byte: &u8| matches!(byte, b' '..=b'~') && *byte != b'\\';
    if bytes.iter().all(is_plain) {
        return into.extend(bytes);
    }
    for chunk in bytes.utf8_chunks() {
        for c in chunk.valid().chars() {
            match c {
                '\\' => into.extend(br"\\"),
                '"' | '\'' => into.push(c as u8),
                _ if c.escape_debug().len() == 1 => append_char(c, into),
                _ => escape_char(c, into),
            }
        }
        escape_each(chunk.invalid(), into);
    }
}

/// Returns a copy of `message` that is safe to show on a terminal. The message may contain text from any source.
/// Escapes characters on which a terminal acts, and characters that change the direction of writing. Keeps backslashes,
/// because parts of the message may already be escaped.
#[must_use]
pub fn harmless(message: &str) -> String {
    let mut harmless = Vec::with_capacity(message.len());
    for c in message.chars() {
        let changes_direction = matches!(c,
            '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
        if c.is_control() || changes_direction {
            escape_char(c, &mut harmless);
        } else {
            append_char(c, &mut harmless);
        }
    }
    String::from_utf8(harmless).expect("only characters were appended")
}

fn append_char(c: char, into: &mut Vec<u8>) {
    into.extend(c.encode_utf8(&mut [0; 4]).as_bytes());
}

fn escape_char(c: char, into: &mut Vec<u8>) {
    escape_each(c.encode_utf8(&mut [0; 4]).as_bytes(), into);
}

fn escape_each(bytes: &[u8], into: &mut Vec<u8>) {
    for &byte in bytes {
        into.extend(br"\x");
        append_hex(&[byte], into);
    }
}

/// Appends two digits in hex for each byte.
pub(crate) fn append_hex(bytes: &[u8], into: &mut Vec<u8>) {
    let digits =
        |byte: &u8| [byte >> 4, byte & 15].map(|four| b"0123456789ABCDEF"[usize::from(four)]);
    into.extend(bytes.iter().flat_map(digits));
}

/// Returns the bytes of an escaped text. A backslash that begins no escape is kept.
#[must_use]
pub fn unescaped(text: &str) -> Vec<u8> {
    let (mut bytes, mut rest) = (Vec::new(), text.as_bytes());
    while let Some((&first, behind)) = rest.split_first() {
        let escaped = match rest {
            [b'\\', b'\\', behind @ ..] => Some((b'\\', behind)),
            [b'\\', b'x', high, low, behind @ ..] => {
                let digit = |byte: u8| char::from(byte).to_digit(16)?.try_into().ok();
                let digits: Option<(u8, u8)> = digit(*high).zip(digit(*low));
                digits.map(|(high, low)| (high << 4 | low, behind))
            }
            _ => None,
        };
        let (byte, behind) = escaped.unwrap_or((first, behind));
        bytes.push(byte);
        rest = behind;
    }
    bytes
}

/// Returns the first characters of a text, escaped, for an error. Adds no quotation marks.
#[must_use]
pub fn quoted(text: &str) -> String {
    let beginning: String = text.chars().take(QUOTED).collect();
    let mut escaped = Vec::new();
    escape(beginning.as_bytes(), &mut escaped);
    String::from_utf8(escaped).expect("escaped text is UTF-8")
}

/// Returns the part of an error message that suggests the nearest name. Returns an empty text if none of `names`
/// resembles `name`.
#[must_use]
pub fn nearest(name: &str, names: &[impl AsRef<str>]) -> String {
    let small = name.to_ascii_lowercase();
    // The Jaro-Winkler distance is small for names that begin alike, such as `ublox` and `ubx`.
    let distance = |other: &&str| 1.0 - strsim::jaro_winkler(&other.to_ascii_lowercase(), &small);
    let near = names
        .iter()
        .map(AsRef::as_ref)
        .filter(|other| distance(other) < 0.35);
    let nearest = near.min_by(|one, other| distance(one).total_cmp(&distance(other)));
    nearest.map_or(String::new(), |other| format!(" (perhaps {other}?)"))
}

/// Returns the beginning of a value for an error. Text is in quotation marks.
#[must_use]
pub fn quote(value: &Json) -> String {
    match value {
        Json::String(string) => format!("\"{}\"", quoted(string)),
        value => quoted(&value.to_string()),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use rand::seq::IndexedRandom;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn escaped(bytes: &[u8]) -> String {
        let mut text = Vec::new();
        escape(bytes, &mut text);
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn what_a_terminal_acts_on_is_escaped() {
        for (bytes, text) in [
            (&b"a, \"b\""[..], "a, \"b\""),
            ("Größe °".as_bytes(), "Größe °"),
            (b"\x1B[2J\x07", "\\x1B[2J\\x07"),
            (b"a\\b\r\n", "a\\\\b\\x0D\\x0A"),
            (b"\xFF\xC3", "\\xFF\\xC3"),
            (b" a b ", " a b "),
            (b"", ""),
            // 8-bit control codes, and characters that change the direction of writing.
            ("\u{9B}2J\u{202E}".as_bytes(), "\\xC2\\x9B2J\\xE2\\x80\\xAE"),
        ] {
            assert_eq!(escaped(bytes), text);
        }
    }

    #[test]
    fn a_message_keeps_all_that_a_terminal_does_not_act_on() {
        let as_it_was = "Größe 7 µm: \"C:\\x\", e\u{301}";
        assert_eq!(harmless(as_it_was), as_it_was);
        assert_eq!(
            harmless("\x1B[2J\u{9B}2J\x7F\n\u{202E}\u{2066}"),
            "\\x1B[2J\\xC2\\x9B2J\\x7F\\x0A\\xE2\\x80\\xAE\\xE2\\x81\\xA6"
        );
    }

    #[test]
    fn any_bytes_come_back() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..5_000 {
            let byte = |random: &mut ChaCha8Rng| match random.random_range(0..3) {
                0 => random.random(),
                1 => *b"\\x0F1B ".choose(random).unwrap(),
                _ => *"é\u{9B}€".as_bytes().choose(random).unwrap(),
            };
            let bytes: Vec<u8> = (0..random.random_range(0..12))
                .map(|_| byte(&mut random))
                .collect();
            let text = escaped(&bytes);
            assert_eq!(unescaped(&text), bytes, "{text}");
            assert!(!text.chars().any(char::is_control), "{text:?}");
        }
        assert_eq!(unescaped("a\\b\\xZ1\\"), b"a\\b\\xZ1\\");
    }
}
