//! What a stream is read from: a file, standard input or a serial port.

use std::fs::{File, Metadata};
use std::io::{self, ErrorKind, IsTerminal, Read, Seek};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::serial::{self, Device};
use crate::standard;

/// Bytes read or written at a time: enough that calls of the operating system cost little.
pub(crate) const CHUNK_LENGTH: usize = 64 * 1024;

/// An open input. Its errors say what could not be read, and where.
pub(crate) struct Input<'a> {
    /// What to call it in messages.
    pub(crate) name: String,
    reader: Box<dyn Read + Send + 'a>,
    /// If it is a serial port.
    pub(crate) port: Option<Device>,
    /// How many bytes of it have been read, and of a regular file how many there are.
    pub(crate) progress: ProgressBar,
}

impl<'a> Input<'a> {
    /// Any reader.
    pub(crate) fn new(name: &str, reader: impl Read + Send + 'a) -> Self {
        Self {
            name: name.to_owned(),
            reader: Box::new(reader),
            port: None,
            progress: ProgressBar::hidden(),
        }
    }

    /// Opens `argument`: `-` is standard input, a terminal device a serial port, which `baud` is
    /// for, and anything else a file.
    pub(crate) fn open(argument: &Path, baud: Option<u32>) -> Result<Self> {
        let path = argument.to_string_lossy();
        let (name, file) = if path == "-" {
            let file = standard::file(io::stdin()).context("cannot open standard input")?;
            ("standard input", file)
        } else {
            if let Some(port) = serial::open_if_port(argument, baud)? {
                let device = port.device.clone();
                let mut input = Self::new(&path, port);
                input.port = Some(device);
                return Ok(input);
            }
            (&*path, open_file(argument)?)
        };
        if baud.is_some() {
            bail!("--baud is for serial ports, and {name} is none: leave it out, or name a port");
        }
        if file.is_terminal() {
            eprintln!(
                "framelock: reading what is typed (Ctrl-D ends it); see --help for files and ports"
            );
        }
        let size = remaining(&file);
        let input = Self::new(name, file);
        size.inspect(|&size| input.progress.set_length(size));
        Ok(input)
    }

    /// Shows how far the input has been read, if it has a size and standard error is a terminal;
    /// until it is dropped.
    pub(crate) fn show_progress(&self) {
        let style = ProgressStyle::with_template("{bar:40} {bytes}/{total_bytes} {bytes_per_sec}");
        if let (Some(_), Ok(style)) = (self.progress.length(), style) {
            self.progress.set_style(style);
            self.progress.set_draw_target(ProgressDrawTarget::stderr());
        }
    }
}

impl Drop for Input<'_> {
    fn drop(&mut self) {
        self.progress.finish_and_clear();
    }
}

impl Read for Input<'_> {
    /// Tries again what passes: an interrupted read, and one that timed out, since a serial line
    /// may be silent.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.reader.read(buffer) {
                Ok(count) => {
                    self.progress.inc(count as u64);
                    return Ok(count);
                }
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted | ErrorKind::TimedOut => {}
                    // Some shells hand over an input that does not wait.
                    ErrorKind::WouldBlock => std::thread::sleep(Duration::from_millis(1)),
                    kind => {
                        let (name, offset) = (&self.name, self.progress.position());
                        let told = format!("cannot read {name} behind byte {offset}: {error}");
                        return Err(io::Error::new(kind, told));
                    }
                },
            }
        }
    }
}

/// Calls `take` with each piece of `input` as soon as it is there, until the input ends.
pub(crate) fn for_each_chunk(
    mut input: impl Read,
    mut take: impl FnMut(&[u8]) -> Result<()>,
) -> Result<()> {
    let mut chunk = vec![0; CHUNK_LENGTH];
    loop {
        let count = input.read(&mut chunk)?;
        match chunk.get(..count) {
            None | Some([]) => return Ok(()),
            Some(bytes) => take(bytes)?,
        }
    }
}

fn open_file(path: &Path) -> Result<File> {
    const INSTEAD: &str = "name a file, a serial port, or - for standard input";
    let name = path.display();
    let file =
        File::open(path).map_err(|error| anyhow!("cannot open {name}: {error}; {INSTEAD}"))?;
    if file.metadata().is_ok_and(|metadata| metadata.is_dir()) {
        bail!("{name} is a directory; {INSTEAD}");
    }
    Ok(file)
}

/// Bytes from where `file` stands to its end, if it is a regular one.
fn remaining(mut file: &File) -> Option<u64> {
    let metadata = file.metadata().ok().filter(Metadata::is_file)?;
    Some(metadata.len().saturating_sub(file.stream_position().ok()?))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    /// Gives one outcome per read, then the end.
    struct Script(std::vec::IntoIter<io::Result<&'static [u8]>>);

    impl Read for Script {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.0.next().unwrap_or(Ok(&[]))?.read(buffer)
        }
    }

    /// The first pieces, `take` at most, and how reading ends.
    fn read(script: Vec<io::Result<&'static [u8]>>, take: usize) -> (Vec<Vec<u8>>, Result<()>) {
        let mut chunks = Vec::new();
        let input = Input::new("the line", Script(script.into_iter()));
        let outcome = for_each_chunk(input, |chunk| {
            chunks.push(chunk.to_vec());
            anyhow::ensure!(chunks.len() < take, "had enough");
            Ok(())
        });
        (chunks, outcome)
    }

    #[test]
    fn pieces_are_given_as_they_come_until_an_error_that_does_not_pass() {
        let script = || {
            vec![
                Ok(&b"A"[..]),
                Err(ErrorKind::Interrupted.into()),
                Err(ErrorKind::TimedOut.into()),
                Err(ErrorKind::WouldBlock.into()),
                Ok(b"B\0\x7F"),
                Err(io::Error::other("unplugged")),
                Ok(b"behind"),
            ]
        };
        let (chunks, outcome) = read(script(), 9);
        assert_eq!(chunks, [&b"A"[..], b"B\0\x7F"]);
        assert_eq!(
            outcome.unwrap_err().to_string(),
            "cannot read the line behind byte 4: unplugged"
        );
        // Nothing more is read once it fails to be taken.
        let (chunks, outcome) = read(script(), 1);
        assert_eq!(chunks, [b"A"]);
        assert_eq!(outcome.unwrap_err().to_string(), "had enough");
    }
}
