//! Inputs: a file, standard input or a serial port.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead, BufReader, ErrorKind, IsTerminal, Read};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use clap::ValueEnum;
use framelock_description::hex;

use crate::output::{note, standard_stream};
use crate::serial::{self, PortOptions};

/// The number of bytes that are read or written at a time. It is large enough that system calls cost
/// little.
pub(crate) const CHUNK_LENGTH: usize = 64 * 1024;

/// An open input. Its errors name the input and the offset at which reading failed.
pub(crate) struct Input<'a> {
    /// The input's name in messages.
    pub(crate) name: String,
    reader: Box<dyn Read + Send + 'a>,
    /// Whether the input is a regular file. Such a file does not tell when its bytes arrived.
    pub(crate) is_file: bool,
    /// The number of bytes read so far.
    offset: u64,
}

/// The notation of the input's bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Spelling {
    /// Raw bytes
    Bytes,
    /// Text in hex, as loggers print it
    Hex,
}

impl<'a> Input<'a> {
    /// Makes an input from any reader.
    pub(crate) fn new(name: &str, reader: impl Read + Send + 'a) -> Self {
        Self {
            name: name.to_owned(),
            reader: Box::new(reader),
            is_file: false,
            offset: 0,
        }
    }

    /// Opens `argument`: `-` is standard input, a terminal device is a serial port with the settings
    /// of `options`, and any other name is a file.
    pub(crate) fn open(argument: &Path, options: &PortOptions) -> Result<Self> {
        let path = argument.to_string_lossy();
        let (name, file) = if path == "-" {
            let file = standard_stream(io::stdin()).context("cannot open standard input")?;
            ("standard input", file)
        } else {
            if let Some(port) = serial::open(argument, options)? {
                return Ok(Self::new(&path, port));
            }
            (&*path, open_file(argument)?)
        };
        options.check_none(name)?;
        if file.is_terminal() {
            note(
                "reading from the terminal until Ctrl-D; --help shows how to read files and ports",
            );
        }
        Ok(Self {
            is_file: file.metadata().is_ok_and(|metadata| metadata.is_file()),
            ..Self::new(name, file)
        })
    }

    /// Sets the notation of the input's bytes. If the notation is hex, the input parses the text that it reads.
    pub(crate) fn spelled(self, spelling: Spelling) -> Self {
        match spelling {
            Spelling::Bytes => self,
            Spelling::Hex => Self {
                reader: Box::new(HexReader::new(BufReader::new(self.reader))),
                ..self
            },
        }
    }
}

impl Read for Input<'_> {
    /// Reads bytes. Repeats a read that was interrupted or timed out, because a serial line may be silent.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.reader.read(buffer) {
                Ok(count) => {
                    self.offset += count as u64;
                    return Ok(count);
                }
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted | ErrorKind::TimedOut => {}
                    // Some shells pass standard input in non-blocking mode.
                    ErrorKind::WouldBlock => std::thread::sleep(Duration::from_millis(1)),
                    kind => {
                        let (name, offset) = (&self.name, self.offset);
                        let message = format!("cannot read {name} after byte {offset}: {error}");
                        return Err(io::Error::new(kind, message));
                    }
                },
            }
        }
    }
}

/// Calls `take` with the bytes of `input` as soon as they arrive, until the input ends.
pub(crate) fn for_each_arrival(
    mut input: Input,
    mut take: impl FnMut(&[u8]) -> Result<()>,
) -> Result<()> {
    let mut chunk = vec![0; CHUNK_LENGTH];
    loop {
        match input.read(&mut chunk)? {
            0 => return Ok(()),
            count => take(&chunk[..count])?,
        }
    }
}

fn open_file(path: &Path) -> Result<File> {
    const INSTEAD: &str =
        "name a file, a serial port (`framelock ports` lists them), or - for standard input";
    let name = path.display();
    // Opening a directory fails with a different error on Windows.
    if path.is_dir() {
        bail!("{name} is a directory; {INSTEAD}");
    }
    File::open(path).map_err(|error| anyhow!("cannot open {name}: {error}; {INSTEAD}"))
}

/// Reads the bytes of a hex text, line by line.
struct HexReader<R> {
    text: R,
    /// The part of the current line that has arrived.
    line: Vec<u8>,
    number: u64,
    bytes: VecDeque<u8>,
}

impl<R: BufRead> HexReader<R> {
    fn new(text: R) -> Self {
        Self {
            text,
            line: Vec::new(),
            number: 1,
            bytes: VecDeque::new(),
        }
    }
}

impl<R: BufRead> Read for HexReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.bytes.is_empty() {
            if self.text.read_until(b'\n', &mut self.line)? == 0 && self.line.is_empty() {
                break;
            }
            let number = self.number;
            let bytes = hex::parse(&[&*String::from_utf8_lossy(&self.line)]).map_err(|why| {
                let message = format!("line {number}: {why}; expected bytes such as 41 42 00 7F");
                io::Error::new(ErrorKind::InvalidData, message)
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
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    /// A reader that returns one of these outcomes per read. After the last outcome, the reader returns the end of the
    /// input.
    struct Script(std::vec::IntoIter<io::Result<&'static [u8]>>);

    impl Read for Script {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.0.next().unwrap_or(Ok(&[]))?.read(buffer)
        }
    }

    /// Reads at most `take` chunks. Returns them and the final outcome.
    fn read(script: Vec<io::Result<&'static [u8]>>, take: usize) -> (Vec<Vec<u8>>, Result<()>) {
        let mut chunks = Vec::new();
        let input = Input::new("the line", Script(script.into_iter()));
        let outcome = for_each_arrival(input, |bytes| {
            chunks.push(bytes.to_vec());
            anyhow::ensure!(chunks.len() < take, "had enough");
            Ok(())
        });
        (chunks, outcome)
    }

    #[test]
    fn chunks_are_taken_as_they_arrive_until_a_permanent_error() {
        let script = || {
            vec![
                Ok(&b"A"[..]),
                Err(ErrorKind::Interrupted.into()),
                Err(ErrorKind::TimedOut.into()),
                Err(ErrorKind::WouldBlock.into()),
                Ok(b"B\0\x7F"),
                Err(io::Error::other("unplugged")),
                Ok(b"after"),
            ]
        };
        let (chunks, outcome) = read(script(), 9);
        assert_eq!(chunks, [&b"A"[..], b"B\0\x7F"]);
        assert_eq!(
            outcome.unwrap_err().to_string(),
            "cannot read the line after byte 4: unplugged"
        );
        // After `take` fails, nothing more is read.
        let (chunks, outcome) = read(script(), 1);
        assert_eq!(chunks, [b"A"]);
        assert_eq!(outcome.unwrap_err().to_string(), "had enough");
    }
}
