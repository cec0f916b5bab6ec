//! The reading loop, and the two ways in which a stream can fail.

use std::io::{self, BufRead, ErrorKind};
use std::time::Duration;

/// Bytes read or written at a time: enough that a call of the operating system costs nothing
/// beside them, few enough to stay in the processor's cache.
pub const CHUNK_LENGTH: usize = 256 * 1024;

/// Where bytes are read to: at the start of a page, since some processors copy out of the kernel
/// several times slower to anywhere else.
#[repr(align(4096))]
pub(crate) struct Chunk(pub(crate) [u8; CHUNK_LENGTH]);

impl Chunk {
    pub(crate) fn new() -> Box<Self> {
        #[allow(clippy::large_stack_arrays, reason = "on its way to the heap")]
        Box::new(Self([0; CHUNK_LENGTH]))
    }
}

/// Why a stream ended before its end.
#[derive(Debug)]
pub enum Failure {
    /// The input could not be read.
    Read {
        /// Bytes read until then.
        offset: u64,
        /// What the operating system says.
        source: io::Error,
    },
    /// The input was read, but says what it must not.
    Content(String),
    /// The output could not be written.
    Write(io::Error),
}

impl From<io::Error> for Failure {
    /// Reading fails in one place only, [`for_each_chunk`]: everything else is output.
    fn from(error: io::Error) -> Self {
        Self::Write(error)
    }
}

impl Failure {
    /// The failure as the user is told it, or none if there is nothing to tell: whoever read the
    /// output had enough.
    ///
    /// # Errors
    /// The failure, with the names of what failed.
    pub fn told(self, input: &str, output: &str) -> anyhow::Result<()> {
        match self {
            Self::Read { offset, source } => {
                anyhow::bail!("cannot read {input} behind byte {offset}: {source}")
            }
            Self::Content(problem) => anyhow::bail!("{input}: {problem}"),
            Self::Write(source) if source.kind() == ErrorKind::BrokenPipe => Ok(()),
            Self::Write(source) if source.kind() == ErrorKind::StorageFull => {
                anyhow::bail!(
                    "cannot write to {output}: {source}; make room there or write elsewhere"
                )
            }
            Self::Write(source) => anyhow::bail!("cannot write to {output}: {source}"),
        }
    }
}

/// Calls `take` with each piece of `input` as soon as it is there, until the input ends.
///
/// An interrupted read is tried again, and so is one that timed out: a serial line may be silent.
///
/// # Errors
/// Whatever else the input fails with, and what `take` does.
pub fn for_each_chunk(
    input: &mut impl BufRead,
    mut take: impl FnMut(&[u8]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut offset = 0;
    loop {
        let length = match input.fill_buf() {
            Ok([]) => return Ok(()),
            Ok(chunk) => {
                take(chunk)?;
                chunk.len()
            }
            Err(source) => match source.kind() {
                ErrorKind::Interrupted | ErrorKind::TimedOut => 0,
                // Whoever handed the input over made it non-blocking, as some shells do.
                ErrorKind::WouldBlock => {
                    std::thread::sleep(Duration::from_millis(1));
                    0
                }
                _ => return Err(Failure::Read { offset, source }),
            },
        };
        input.consume(length);
        offset += length as u64;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use std::io::{BufReader, Read};

    use super::*;

    /// Gives one outcome per read, then the end.
    struct Script(std::vec::IntoIter<io::Result<&'static [u8]>>);

    impl Read for Script {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.0.next().unwrap_or(Ok(&[]))?.read(buffer)
        }
    }

    fn read(script: Vec<io::Result<&'static [u8]>>) -> (Vec<Vec<u8>>, Result<(), Failure>) {
        let mut chunks = Vec::new();
        let outcome = for_each_chunk(&mut BufReader::new(Script(script.into_iter())), |chunk| {
            chunks.push(chunk.to_vec());
            Ok(())
        });
        (chunks, outcome)
    }

    #[test]
    fn short_reads_are_given_as_they_come() {
        let (chunks, outcome) = read(vec![Ok(b"A"), Ok(b"B\0\x7F"), Ok(b"\xC8\x4A\r")]);
        outcome.unwrap();
        assert_eq!(chunks, [&b"A"[..], b"B\0\x7F", b"\xC8\x4A\r"]);
    }

    #[test]
    fn what_passes_is_tried_again() {
        let passing = [
            ErrorKind::Interrupted,
            ErrorKind::TimedOut,
            ErrorKind::WouldBlock,
        ];
        for kind in passing {
            let (chunks, outcome) = read(vec![Ok(b"1"), Err(kind.into()), Ok(b"2")]);
            outcome.unwrap();
            assert_eq!(chunks, [b"1", b"2"], "{kind}");
        }
    }

    #[test]
    fn an_error_is_told_with_its_place() {
        let error = io::Error::other("unplugged");
        let (chunks, outcome) = read(vec![Ok(b"12"), Ok(b"345"), Err(error), Ok(b"6")]);
        assert_eq!(chunks, [&b"12"[..], b"345"]);
        let told = outcome.unwrap_err().told("the line", "the screen");
        assert_eq!(
            told.unwrap_err().to_string(),
            "cannot read the line behind byte 5: unplugged"
        );
    }

    #[test]
    fn nothing_more_is_read_once_the_output_fails() {
        let full = || Failure::from(io::Error::from(ErrorKind::StorageFull));
        let mut count = 0;
        let mut input = BufReader::new(Script(vec![Ok(&b"1"[..]), Ok(b"2")].into_iter()));
        let outcome = for_each_chunk(&mut input, |_| {
            count += 1;
            Err(full())
        });
        assert!(matches!(outcome, Err(Failure::Write(_))));
        assert_eq!(count, 1);
    }

    #[test]
    fn a_reader_that_had_enough_is_no_failure() {
        let closed = Failure::from(io::Error::from(ErrorKind::BrokenPipe));
        closed.told("the line", "the screen").unwrap();
    }
}
