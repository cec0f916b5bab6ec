//! Inputs: a file, standard input or a serial port.

mod analyser;
mod arrivals;
mod dump;
mod text;
mod time;
mod tlog;

use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal, Read};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};

use crate::output::{note, standard_stream};
use crate::serial::{self, PortOptions};
pub(crate) use arrivals::{Arrival, Arrivals, InputNotation};

/// The most bytes that are read at a time, and the number of bytes after which rows are written. It is so large that
/// system calls cost little.
pub(crate) const CHUNK_LENGTH: usize = 64 * 1024;

/// An open input. Its errors name the input and the offset at which reading failed.
pub(crate) struct Input<'a> {
    /// The input's name in messages.
    pub(crate) name: String,
    reader: Box<dyn Read + Send + 'a>,
    /// Whether the input is a regular file. The time at which bytes are read from a file is not the time at which they
    /// arrived.
    pub(crate) is_file: bool,
    /// A mask with the data bits of a byte.
    mask: u8,
    /// The number of bytes read so far.
    offset: u64,
}

impl<'a> Input<'a> {
    /// Makes an input from any reader.
    pub(crate) fn new(name: &str, reader: impl Read + Send + 'a) -> Self {
        Self {
            name: name.to_owned(),
            reader: Box::new(reader),
            is_file: false,
            mask: 0xFF,
            offset: 0,
        }
    }

    /// Opens `argument`: `-` is standard input, a terminal device is a serial port with the settings
    /// of `options`, and any other name is a file.
    pub(crate) fn open(argument: &Path, options: &PortOptions) -> Result<Self> {
        let path = argument.to_string_lossy();
        let mask = options.data_mask();
        let (name, file) = if path == "-" {
            let file = standard_stream(io::stdin()).context("cannot open standard input")?;
            ("standard input", file)
        } else {
            if let Some(port) = serial::open(argument, options)? {
                return Ok(Self {
                    mask,
                    ..Self::new(&path, port)
                });
            }
            (&*path, open_file(argument)?)
        };
        options.check_none(name, true)?;
        if file.is_terminal() {
            note(
                "reading from the terminal until Ctrl-D; --help shows how to read files and ports",
            );
        }
        Ok(Self {
            is_file: file.metadata().is_ok_and(|metadata| metadata.is_file()),
            mask,
            ..Self::new(name, file)
        })
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

    #[test]
    fn chunks_are_taken_as_they_arrive_until_a_permanent_error() {
        let script = vec![
            Ok(&b"A"[..]),
            Err(ErrorKind::Interrupted.into()),
            Err(ErrorKind::TimedOut.into()),
            Err(ErrorKind::WouldBlock.into()),
            Ok(b"B\0\x7F"),
            Err(io::Error::other("unplugged")),
        ];
        let input = Input::new("the line", Script(script.into_iter()));
        let arrivals = Arrivals::new(input, Some(InputNotation::Bytes)).unwrap();
        let chunks = arrivals.map(|arrival| match arrival {
            Ok(arrival) => Ok(arrival.bytes),
            Err(error) => Err(error.to_string()),
        });
        let expected = [
            Ok(b"A".to_vec()),
            Ok(b"B\0\x7F".to_vec()),
            Err("cannot read the line after byte 4: unplugged".to_owned()),
        ];
        assert_eq!(chunks.take(3).collect::<Vec<_>>(), expected);
    }
}
