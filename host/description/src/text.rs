//! Text from a wire, as a terminal may show it: what it would act on is escaped.

/// What of a text stands in an error.
const QUOTED: usize = 40;

/// Appends bytes that may be text. What is not to be printed, or not UTF-8, becomes `\x1B`, a backslash `\\`, and a
/// blank at either end `\x20`: [`unescaped`] gives the same bytes again.
pub fn escape(bytes: &[u8], into: &mut Vec<u8>) {
    let is_plain = |byte: &u8| matches!(byte, b'!'..=b'~') && *byte != b'\\';
    if bytes.iter().all(is_plain) {
        return into.extend(bytes);
    }
    let inner = bytes.len() - 1;
    let mut at = 0;
    for chunk in bytes.utf8_chunks() {
        for c in chunk.valid().chars() {
            let mut encoded = [0; 4];
            let encoded = c.encode_utf8(&mut encoded).as_bytes();
            match c {
                '\\' => into.extend(br"\\"),
                ' ' if at == 0 || at == inner => escape_each(encoded, into),
                '"' | '\'' => into.extend(encoded),
                _ if c.escape_debug().len() == 1 => into.extend(encoded),
                _ => escape_each(encoded, into),
            }
            at += encoded.len();
        }
        escape_each(chunk.invalid(), into);
        at += chunk.invalid().len();
    }
}

fn escape_each(bytes: &[u8], into: &mut Vec<u8>) {
    for &byte in bytes {
        into.extend(br"\x");
        crate::hex::append_glued(&[byte], into);
    }
}

/// The bytes of an escaped text. A backslash that begins no escape is a backslash.
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

/// The beginning of a text, for an error.
#[must_use]
pub fn quoted(text: &str) -> String {
    let beginning: String = text.chars().take(QUOTED).collect();
    let mut escaped = Vec::new();
    escape(beginning.as_bytes(), &mut escaped);
    String::from_utf8(escaped).unwrap_or_default()
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
            (b" a b ", "\\x20a b\\x20"),
            (b" ", "\\x20"),
            (b"", ""),
            // The control codes of 8 bits, and what turns the direction of writing.
            ("\u{9B}2J\u{202E}".as_bytes(), "\\xC2\\x9B2J\\xE2\\x80\\xAE"),
        ] {
            assert_eq!(escaped(bytes), text);
        }
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
