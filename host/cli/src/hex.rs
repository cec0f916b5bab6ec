//! Reads bytes from hex text, as loggers print it.

use std::collections::VecDeque;
use std::io::{self, BufRead, ErrorKind, Read};

use framelock_description::hex::parse;

/// Reads the bytes of a hex text, line by line.
pub(crate) struct Reader<R> {
    text: R,
    /// The part of the current line that has arrived.
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
                let told = format!("line {number}: {why}; expected bytes such as 41 42 00 7F");
                io::Error::new(ErrorKind::InvalidData, told)
            })?;
            self.bytes = bytes.into();
            self.number += 1;
            self.line.clear();
        }
        self.bytes.read(buffer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_read_line_by_line() {
        let text = b"41 42\r\n\n0x00, 0x7F\nC8:4A 0d\n4Z\n";
        let mut reader = Reader::new(&text[..]);
        let mut bytes = Vec::new();
        let error = reader.read_to_end(&mut bytes).map_err(|it| it.to_string());
        assert_eq!(bytes, [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D]);
        let told = "line 5: word 1, '4Z', has 'Z', which is no hex digit; expected bytes such as";
        assert!(error.is_err_and(|error| error.starts_with(told)));
    }
}
