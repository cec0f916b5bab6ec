//! Which bytes the arguments mean.

use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

/// Where the bytes come from.
#[derive(PartialEq, Eq, Debug)]
pub(super) enum Source {
    /// The lecture's worked examples: nothing was asked for.
    Examples,
    /// They are the arguments.
    Bytes(Vec<u8>),
    /// A file, a serial port or standard input has them; `why` the argument is no bytes itself.
    File { path: PathBuf, why: String },
}

/// Hex if all of it can be read as hex, else a file. So what a line of arguments means does not
/// depend on which files happen to lie around.
pub(super) fn choose(arguments: &[OsString]) -> Result<Source> {
    if arguments.is_empty() {
        return Ok(Source::Examples);
    }
    match (hex(arguments), arguments) {
        (Ok(bytes), _) if bytes.is_empty() => bail!("no bytes in the arguments"),
        (Ok(bytes), arguments) => {
            if let [only] = arguments
                && Path::new(only).exists()
            {
                let name = only.display();
                eprintln!("framelock: {name} is taken as hex; for the file write ./{name}");
            }
            Ok(Source::Bytes(bytes))
        }
        (Err(why), [only]) => Ok(Source::File {
            path: only.into(),
            why: why.to_string(),
        }),
        (Err(why), _) => bail!("{why}"),
    }
}

/// Why a word is not bytes in hex.
#[derive(PartialEq, Eq, Debug)]
struct NotHex {
    /// Which of the words, counted from 1.
    number: usize,
    word: String,
    /// The first character that is no hex digit; none if only the number of digits is wrong.
    character: Option<char>,
}

impl fmt::Display for NotHex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { number, word, .. } = self;
        write!(f, "word {number}, '{word}', ")?;
        match self.character {
            Some(character) => write!(f, "has '{character}', which is no hex digit"),
            None => write!(f, "is not a whole number of bytes: two digits make a byte"),
        }
    }
}

/// The bytes of words in hex, separated by arguments, blanks, commas, semicolons or colons; each
/// with or without `0x`.
fn hex(arguments: &[OsString]) -> Result<Vec<u8>, NotHex> {
    let mut bytes = Vec::new();
    let mut number = 0;
    for argument in arguments {
        // What is not Unicode is not hex either: it comes out as U+FFFD.
        for word in argument
            .to_string_lossy()
            .split(|c: char| c.is_whitespace() || ",;:".contains(c))
            .filter(|word| !word.is_empty())
        {
            number += 1;
            append(&mut bytes, word).map_err(|character| NotHex {
                number,
                word: word.to_owned(),
                character,
            })?;
        }
    }
    Ok(bytes)
}

/// Appends the bytes of one word; fails with the character that is no hex digit, or with none if
/// the number of digits is odd.
fn append(bytes: &mut Vec<u8>, word: &str) -> Result<(), Option<char>> {
    let digits = word
        .strip_prefix("0x")
        .or_else(|| word.strip_prefix("0X"))
        .unwrap_or(word);
    let mut high = None;
    for character in digits.chars() {
        let digit = character.to_digit(16).ok_or(Some(character))?;
        match high.take() {
            None => high = Some(digit),
            Some(high) => bytes.push((high << 4 | digit).to_le_bytes()[0]),
        }
    }
    // "0x" alone has no digits, which makes no byte either.
    if high.is_some() || digits.is_empty() {
        return Err(None);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    fn words(words: &[&str]) -> Vec<OsString> {
        words.iter().map(OsString::from).collect()
    }

    #[test]
    fn hex_comes_in_many_spellings() {
        let bytes = Ok(vec![0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D]);
        for spelling in [
            &["41", "42", "00", "7F", "C8", "4A", "0D"][..],
            &["4142007FC84A0D"],
            &["41 42 00 7f c8 4a 0d"],
            &["0x41,", "0x42,", "0x00,", "0x7F,", "0xC8,", "0x4A,", "0x0D"],
            &["41:42:00:7F:C8:4A:0D"],
            &["0X4142", "007FC8", "4a0D"],
        ] {
            assert_eq!(hex(&words(spelling)), bytes, "{spelling:?}");
        }
    }

    #[test]
    fn what_is_not_hex_is_named() {
        for (spelling, message) in [
            (
                &["41", "4G"][..],
                "word 2, '4G', has 'G', which is no hex digit",
            ),
            (
                &["41 42", "xyz"],
                "word 3, 'xyz', has 'x', which is no hex digit",
            ),
            (
                &["41", "4"],
                "word 2, '4', is not a whole number of bytes: two digits make a byte",
            ),
            (
                &["0x"],
                "word 1, '0x', is not a whole number of bytes: two digits make a byte",
            ),
            (
                &["41", "4é"],
                "word 2, '4é', has 'é', which is no hex digit",
            ),
        ] {
            let not_hex = hex(&words(spelling)).unwrap_err();
            assert_eq!(not_hex.to_string(), message);
        }
    }

    #[test]
    fn nothing_and_a_dash_have_their_meaning() {
        assert_eq!(choose(&[]).unwrap(), Source::Examples);
        let Source::File { path, .. } = choose(&words(&["-"])).unwrap() else {
            panic!("a dash is not hex");
        };
        assert_eq!(path, Path::new("-"));
        assert!(choose(&words(&[""])).is_err());
        assert!(choose(&words(&["41", "-"])).is_err());
    }
}
