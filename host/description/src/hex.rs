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
        // An argument that is not Unicode gets U+FFFD for its invalid parts, so it is rejected as
        // hex, too.
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
