//! Reads and writes bytes in hex.

use std::ffi::OsStr;

use crate::problem::{HexError, HexReason};
use crate::text;

/// Parses words in hex. Words are separate arguments, or are separated by blanks, commas,
/// semicolons or colons. Each word may begin with `0x`.
///
/// # Errors
/// The error names the word that does not consist of bytes in hex, and the reason.
pub fn parse(arguments: &[impl AsRef<OsStr>]) -> Result<Vec<u8>, HexError> {
    let mut bytes = Vec::new();
    let mut number = 0;
    for argument in arguments {
        // If an argument is not Unicode, its invalid parts become U+FFFD, which is no hex digit.
        let argument = argument.as_ref().to_string_lossy();
        let words = argument.split(|c: char| c.is_whitespace() || ",;:".contains(c));
        for word in words.filter(|word| !word.is_empty()) {
            number += 1;
            append(&mut bytes, word).map_err(|reason| HexError {
                number,
                word: text::quoted(word),
                reason,
            })?;
        }
    }
    Ok(bytes)
}

fn append(bytes: &mut Vec<u8>, word: &str) -> Result<(), HexReason> {
    let digits = word
        .strip_prefix("0x")
        .or(word.strip_prefix("0X"))
        .unwrap_or(word);
    if let Some(other) = digits.chars().find(|digit| !digit.is_ascii_hexdigit()) {
        return Err(HexReason::Digit(text::quoted(&other.to_string())));
    }
    // "0x" alone has no digits, so it is not a byte.
    if digits.is_empty() || digits.len() % 2 == 1 {
        return Err(HexReason::Odd);
    }
    let pairs = (0..digits.len()).step_by(2).map(|at| &digits[at..at + 2]);
    bytes.extend(pairs.map(|pair| u8::from_str_radix(pair, 16).expect("two hex digits")));
    Ok(())
}

/// Parses bytes in the notations in which programs print them: as [`parse`] does, and also numbers of one digit
/// (`79 1 0`), joined pairs of digits (`AA.C0`, `AA-C0`), and literals of Python and C (`b'\xaa'`, `\xaa`, `{0xAA}`).
///
/// # Errors
/// The error names the word that does not consist of bytes in hex, and the reason.
pub fn parse_printed(text: &str) -> Result<Vec<u8>, HexError> {
    if let Some(bytes) = literal(text.trim()) {
        return Ok(bytes);
    }
    let words = text.split(|c: char| c.is_whitespace() || ",;:{}".contains(c));
    let words = words.map(|word| {
        let pairs = word.split(['.', '-']);
        if pairs.clone().all(|pair| pair.len() == 2) {
            return pairs.collect();
        }
        match word.trim_start_matches("0x").as_bytes() {
            &[digit] if digit.is_ascii_hexdigit() => format!("0{}", char::from(digit)),
            _ => word.to_owned(),
        }
    });
    parse(&words.collect::<Vec<String>>())
}

/// Returns the bytes of a Python literal such as `b'\xaaA'`, of a text in quotation marks with an escape such as
/// `\xaa`, or of escapes without quotation marks such as `\xaa\xc0`.
fn literal(text: &str) -> Option<Vec<u8>> {
    let is_python = text.starts_with("b'") || text.starts_with("b\"");
    if !is_python && !text.contains("\\x") {
        return None;
    }
    let text = text.strip_prefix('b').unwrap_or(text);
    let quote = text.chars().next().filter(|first| "'\"".contains(*first));
    let mut rest = match quote {
        Some(quote) => text.strip_prefix(quote)?.strip_suffix(quote)?.chars(),
        None => text.chars(),
    };
    let mut bytes = Vec::new();
    while let Some(c) = rest.next() {
        match (c, quote) {
            ('\\', _) => bytes.push(match rest.next()? {
                'x' => {
                    let digits = rest.as_str().get(..2)?;
                    rest.nth(1)?;
                    u8::from_str_radix(digits, 16).ok()?
                }
                code => *b"\n\r\t\0\\'\"".get("nrt0\\'\"".find(code)?)?,
            }),
            (' ' | ',', None) => {}
            (' '..='~', Some(quote)) if c != quote => bytes.push(u8::try_from(c).ok()?),
            _ => return None,
        }
    }
    Some(bytes)
}

/// Returns bytes in hex, without separators.
#[must_use]
pub fn glued(bytes: &[u8]) -> String {
    let mut digits = Vec::new();
    text::append_hex(bytes, &mut digits);
    String::from_utf8(digits).expect("digits are text")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(words: &[&str]) -> Result<Vec<u8>, String> {
        parse(words).map_err(|error| error.to_string())
    }

    #[test]
    fn hex_comes_in_many_spellings() {
        let bytes = vec![0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D];
        for spelling in [
            &["41", "42", "00", "7F", "C8", "4A", "0D"][..],
            &["4142007FC84A0D"],
            &["41 42 00 7f c8 4a 0d"],
            &["0x41,", "0x42,", "0x00,", "0x7F,", "0xC8,", "0x4A,", "0x0D"],
            &["41:42:00:7F:C8:4A:0D"],
            &["0X4142", "007FC8", "4a0D"],
        ] {
            assert_eq!(parsed(spelling), Ok(bytes.clone()), "{spelling:?}");
        }
        assert_eq!(parsed(&[""]), Ok(vec![]));
        assert_eq!(glued(&bytes), "4142007FC84A0D");
    }

    #[test]
    fn printed_bytes_have_more_spellings() {
        for spelling in [
            "AA C0 2C 00 0A 41",
            "0xAA 0xC0 0x2C 0x0 0xA 0x41",
            "aa c0 2c 0 a 41",
            "AA.C0.2C.00.0A.41",
            "AA-C0-2C-00-0A-41",
            "{0xAA, 0xC0, 0x2C, 0, 0xA, 0x41};",
            r"b'\xaa\xc0,\x00\nA'",
            r#"b"\xaa\xc0,\0\nA""#,
            r"'\xAA\xC0,\x00\x0A\x41'",
            r"\xaa\xc0\x2c\x00\x0a\x41",
            r"\xaa, \xc0, \x2c \x00 \x0a \x41",
        ] {
            let bytes = vec![0xAA, 0xC0, 0x2C, 0x00, 0x0A, 0x41];
            assert_eq!(parse_printed(spelling), Ok(bytes), "{spelling}");
        }
        let quotes = r#"b'"\'\\'"#;
        assert_eq!(parse_printed(quotes), Ok(b"\"'\\".to_vec()));
        assert_eq!(parse_printed("b'AB'"), Ok(b"AB".to_vec()));
        for wrong in [
            "-",
            "AA.C",
            "123",
            "0x",
            r"b'\xaa', b'\xc0'",
            r"b'\xaa",
            r"\xaa\xc0A",
            r"b'\xaé'",
            r"b'\q'",
            "b'é'",
        ] {
            assert!(parse_printed(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_not_hex_is_named_and_shown_as_a_terminal_may() {
        let whole = "is not a whole number of bytes: two digits make a byte";
        for (spelling, why) in [
            (["41", "4G"], "word 2, '4G', has 'G', which is no hex digit"),
            (
                ["41 42", "xy"],
                "word 3, 'xy', has 'x', which is no hex digit",
            ),
            (["41", "4é"], "word 2, '4é', has 'é', which is no hex digit"),
            (["41", "-"], "word 2, '-', has '-', which is no hex digit"),
            (
                ["41", "\x1B[2J"],
                "word 2, '\\x1B[2J', has '\\x1B', which is no hex digit",
            ),
            (["41", "4"], &format!("word 2, '4', {whole}")),
            (["", "0x"], &format!("word 1, '0x', {whole}")),
        ] {
            assert_eq!(parsed(&spelling), Err(why.into()));
        }
        let long = "1".repeat(3_000_001);
        assert!(parsed(&[&long]).is_err_and(|why| why.len() < 200));
    }
}
