//! Bytes as people write them in hex.

use std::collections::VecDeque;
use std::ffi::OsStr;
use std::io::{self, BufRead, ErrorKind, Read};

/// The bytes of words in hex, separated by arguments, blanks, commas, semicolons or colons; each
/// with or without `0x`.
///
/// # Errors
/// Which word is not bytes in hex, and why.
pub(crate) fn parse(arguments: &[impl AsRef<OsStr>]) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut number = 0;
    for argument in arguments {
        // What is not Unicode is not hex either: it comes out as U+FFFD.
        let argument = argument.as_ref().to_string_lossy();
        let words = argument.split(|c: char| c.is_whitespace() || ",;:".contains(c));
        for word in words.filter(|word| !word.is_empty()) {
            number += 1;
            append(&mut bytes, word).map_err(|why| format!("word {number}, '{word}', {why}"))?;
        }
    }
    Ok(bytes)
}

fn append(bytes: &mut Vec<u8>, word: &str) -> Result<(), String> {
    let digits = word.strip_prefix("0x").or(word.strip_prefix("0X"));
    let mut values = Vec::new();
    for digit in digits.unwrap_or(word).chars() {
        let value = digit.to_digit(16).map(u32::to_le_bytes);
        let [value, ..] = value.ok_or_else(|| format!("has '{digit}', which is no hex digit"))?;
        values.push(value);
    }
    let (pairs, odd) = values.as_chunks::<2>();
    // "0x" alone has no digits, which make no byte either.
    if pairs.is_empty() || !odd.is_empty() {
        return Err("is not a whole number of bytes: two digits make a byte".into());
    }
    bytes.extend(pairs.iter().map(|[high, low]| high << 4 | low));
    Ok(())
}

/// The bytes that a text says, a line at a time.
pub(crate) struct Reader<R> {
    text: R,
    /// What of a line has come.
    line: Vec<u8>,
    number: u64,
    bytes: VecDeque<u8>,
}

impl<R: BufRead> Reader<R> {
    pub(crate) fn new(text: R) -> Self {
        Self {
            text,
            line: Vec::new(),
            number: 1,
            bytes: VecDeque::new(),
        }
    }
}

impl<R: BufRead> Read for Reader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.bytes.is_empty() {
            if self.text.read_until(b'\n', &mut self.line)? == 0 && self.line.is_empty() {
                break;
            }
            let number = self.number;
            let bytes = parse(&[&*String::from_utf8_lossy(&self.line)]).map_err(|why| {
                let told = format!("line {number}: {why}; wanted are bytes such as 41 42 00 7F");
                io::Error::new(ErrorKind::InvalidData, told)
            })?;
            self.bytes = bytes.into();
            self.number += 1;
            self.line.clear();
        }
        self.bytes.read(buffer)
    }
}

/// Bytes as digits without anything between them.
pub(crate) fn glued(bytes: &[u8]) -> String {
    let digits = bytes.iter().map(|byte| format!("{byte:02X}"));
    digits.collect::<Vec<_>>().concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(words: &[&str]) -> Result<Vec<u8>, String> {
        parse(words)
    }

    #[test]
    fn hex_comes_in_many_spellings() {
        for spelling in [
            &["41", "42", "00", "7F", "C8", "4A", "0D"][..],
            &["4142007FC84A0D"],
            &["41 42 00 7f c8 4a 0d"],
            &["0x41,", "0x42,", "0x00,", "0x7F,", "0xC8,", "0x4A,", "0x0D"],
            &["41:42:00:7F:C8:4A:0D"],
            &["0X4142", "007FC8", "4a0D"],
        ] {
            let bytes = vec![0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D];
            assert_eq!(parsed(spelling), Ok(bytes), "{spelling:?}");
        }
        assert_eq!(parsed(&[""]), Ok(vec![]));
    }

    #[test]
    fn a_text_is_read_line_by_line() {
        let text = b"41 42\r\n\n0x00, 0x7F\nC8:4A 0d\n4Z\n";
        let mut reader = Reader::new(&text[..]);
        let mut bytes = Vec::new();
        let error = reader.read_to_end(&mut bytes).map_err(|it| it.to_string());
        assert_eq!(bytes, [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D]);
        let told = "line 5: word 1, '4Z', has 'Z', which is no hex digit; wanted are bytes such as";
        assert!(error.is_err_and(|error| error.starts_with(told)));
    }

    #[test]
    fn what_is_not_hex_is_named() {
        let whole = "is not a whole number of bytes: two digits make a byte";
        for (spelling, why) in [
            (["41", "4G"], "word 2, '4G', has 'G', which is no hex digit"),
            (
                ["41 42", "xy"],
                "word 3, 'xy', has 'x', which is no hex digit",
            ),
            (["41", "4é"], "word 2, '4é', has 'é', which is no hex digit"),
            (["41", "-"], "word 2, '-', has '-', which is no hex digit"),
            (["41", "4"], &format!("word 2, '4', {whole}")),
            (["", "0x"], &format!("word 1, '0x', {whole}")),
        ] {
            assert_eq!(parsed(&spelling), Err(why.into()));
        }
    }
}
