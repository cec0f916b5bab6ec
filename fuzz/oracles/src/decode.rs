//! Target `decode`: the command line's reader, on inputs that come in pieces, pause and fail.

use std::fmt::Write as _;
use std::io::{self, BufReader, ErrorKind, Read, Write};

use arbitrary::{Arbitrary, Unstructured};
use framelock::{Bin, BinCrc8, Discard, Lecture, Parser, Receiver, Setpoint};
use framelock_host::decode::{OutputFormat, Summary, decode as decode_stream};
use framelock_host::stream::Failure;
use framelock_proofs::reference::{self, Policy};

use crate::expected::Expected;
use crate::reader;

/// What a call to read gives.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Piece {
    Bytes(Vec<u8>),
    Error(ErrorKind),
}

impl Piece {
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Error(_) => &[],
        }
    }

    pub(crate) fn is_error(&self) -> bool {
        matches!(self, Self::Error(_))
    }
}

impl<'a> Arbitrary<'a> for Piece {
    /// One byte says what it is, by its remainder of 8: 0 to 3: as many bytes as an eighth of it, which
    /// follow. 4: as many frames, with the four bytes of payload that follow. 5 and 6: an error
    /// that passes, after which reading goes on. 7: one that does not.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let what = u8::arbitrary(u)?;
        let number = usize::from(what >> 3);
        Ok(match what % 8 {
            0..=3 => Self::Bytes(u.bytes(number.min(u.len()))?.to_vec()),
            4 => {
                let [a, b, c, d]: [u8; 4] = u.arbitrary()?;
                Self::Bytes([b'A', b'B', a, b, c, d, b'\r'].repeat(number))
            }
            5 => Self::Error(ErrorKind::Interrupted),
            6 => Self::Error(ErrorKind::TimedOut),
            _ => Self::Error(ErrorKind::Other),
        })
    }
}

/// An input that gives the pieces, one a call, then its end.
pub(crate) struct Pieces<'a>(std::slice::Iter<'a, Piece>, &'a [u8]);

impl<'a> Pieces<'a> {
    pub(crate) fn new(pieces: &'a [Piece]) -> Self {
        Self(pieces.iter(), &[])
    }
}

impl Read for Pieces<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.1.is_empty() {
            match self.0.next() {
                Some(Piece::Bytes(bytes)) => self.1 = bytes,
                Some(Piece::Error(kind)) => return Err((*kind).into()),
                None => return Ok(0),
            }
        }
        self.1.read(buffer)
    }
}

/// An output with room for so many bytes.
struct Output {
    written: Vec<u8>,
    room: usize,
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let room = self.room - self.written.len();
        if room == 0 && !bytes.is_empty() {
            return Err(ErrorKind::StorageFull.into());
        }
        let part = bytes.get(..room).unwrap_or(bytes);
        self.written.extend(part);
        Ok(part.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The first byte of the input says which parser and output format, the second how large the
/// reader's buffer is, the third how much room the output has (255: endless); the others are
/// `Piece`s. What is written is what the reference sees in the bytes up to the input's end or
/// failure, or as much of it as there is room for; a failure names its place; the summary puts every
/// byte in one place. The core's own reader, blocking and async, gives what the reference sees in all
/// of the bytes.
///
/// # Panics
/// If one of these does not hold.
pub fn decode(data: &[u8]) {
    let mut u = Unstructured::new(data);
    let [which, buffer, room]: [u8; 3] = u.arbitrary().unwrap_or_default();
    let mut pieces = Vec::new();
    while !u.is_empty()
        && let Ok(piece) = u.arbitrary()
    {
        pieces.push(piece);
    }
    let case = Case {
        format: match which % 4 {
            0 => OutputFormat::Jsonl,
            1 => OutputFormat::Csv,
            2 => OutputFormat::Text,
            _ => OutputFormat::None,
        },
        buffer: usize::from(buffer) + 1,
        room: if room == u8::MAX {
            usize::MAX
        } else {
            usize::from(room) * 4
        },
        pieces,
    };
    match which >> 2 & 3 {
        0 => case.check::<Receiver<Bin>, reference::Bin>(Policy::Rescan),
        1 => case.check::<Lecture, reference::Bin>(Policy::Discard),
        2 => case.check::<Receiver<BinCrc8>, reference::BinCrc8>(Policy::Rescan),
        _ => case.check::<Receiver<BinCrc8, Discard>, reference::BinCrc8>(Policy::Discard),
    }
}

#[derive(Debug)]
struct Case {
    format: OutputFormat,
    buffer: usize,
    room: usize,
    pieces: Vec<Piece>,
}

impl Case {
    fn check<P, F>(&self, policy: Policy)
    where
        P: Parser<Message = Setpoint> + Default + std::fmt::Debug,
        F: reference::Format,
    {
        reader::check::<P, F>(&self.pieces, policy);
        let input = Pieces::new(&self.pieces);
        let mut input = BufReader::with_capacity(self.buffer, input);
        let mut output = Output {
            written: Vec::new(),
            room: self.room,
        };
        let outcome = decode_stream::<P, _, _>(&mut input, &mut output, self.format);

        let (bytes, fails) = self.stream();
        let expected = Expected::of::<F>(&bytes, policy);
        let text = self.text(&expected);
        let fits = text.len() <= self.room;
        let written = String::from_utf8_lossy(&output.written);
        let possible = text.get(..self.room).unwrap_or(&text);
        assert_eq!(written, possible, "{self:02X?}");
        match outcome {
            Ok(summary) => {
                assert!(fits && !fails, "{self:02X?}");
                self.check_summary::<P>(&summary, &expected, bytes.len());
            }
            Err(Failure::Read { offset, source }) => {
                assert!(fits && fails, "{self:02X?}");
                assert_eq!(offset, bytes.len() as u64, "{self:02X?}");
                assert_eq!(source.kind(), ErrorKind::Other, "{self:02X?}");
            }
            Err(Failure::Write(source)) => {
                assert!(!fits, "{self:02X?}");
                assert_eq!(source.kind(), ErrorKind::StorageFull, "{self:02X?}");
            }
            Err(Failure::Content(problem)) => {
                panic!("{problem}: no stream is an error: {self:02X?}")
            }
        }
    }

    /// The bytes up to the end or the error that does not pass, and whether there is one.
    fn stream(&self) -> (Vec<u8>, bool) {
        let mut bytes = Vec::new();
        for piece in &self.pieces {
            match piece {
                Piece::Bytes(more) => bytes.extend(more),
                Piece::Error(ErrorKind::Other) => return (bytes, true),
                Piece::Error(_) => {}
            }
        }
        (bytes, false)
    }

    /// What is to be written.
    fn text(&self, expected: &Expected) -> String {
        let mut text = String::new();
        if self.format == OutputFormat::Csv {
            text.push_str("offset,pitch,roll,yaw\n");
        }
        for (offset, Setpoint { pitch, roll, yaw }) in &expected.frames {
            let outcome = match self.format {
                OutputFormat::Jsonl => writeln!(
                    text,
                    r#"{{"offset":{offset},"pitch":{pitch},"roll":{roll},"yaw":{yaw}}}"#
                ),
                OutputFormat::Csv => writeln!(text, "{offset},{pitch},{roll},{yaw}"),
                OutputFormat::Text => writeln!(
                    text,
                    "byte {offset:>10}   pitch {pitch:>3}   roll {roll:>3}   yaw {yaw:>3}"
                ),
                OutputFormat::None => Ok(()),
            };
            assert_eq!(outcome, Ok(()), "a string has room");
        }
        text
    }

    fn check_summary<P: Parser>(&self, summary: &Summary, expected: &Expected, bytes: usize) {
        let wanted = Summary {
            bytes: bytes as u64,
            frame_length: P::FRAME_LENGTH as u64,
            frames: expected.frames.len() as u64,
            discarded: expected.dropped.total(),
            pending: expected.pending as u64,
            discarded_by: expected.dropped,
            resynchronisations: expected.resynchronisations,
        };
        assert_eq!(*summary, wanted, "{self:02X?}");
        let placed = summary.frame_length * summary.frames + summary.discarded + summary.pending;
        assert_eq!(summary.bytes, placed, "{self:02X?}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The seeds are written in this layout.
    #[test]
    fn bytes_are_read_as_pieces() {
        let mut u = Unstructured::new(b"\x10AB\x05\x14wxyz\x06\x07");
        let mut pieces = Vec::<Piece>::new();
        while !u.is_empty() {
            pieces.push(u.arbitrary().expect("enough"));
        }
        assert_eq!(
            pieces,
            [
                Piece::Bytes(b"AB".to_vec()),
                Piece::Error(ErrorKind::Interrupted),
                Piece::Bytes(b"ABwxyz\rABwxyz\r".to_vec()),
                Piece::Error(ErrorKind::TimedOut),
                Piece::Error(ErrorKind::Other),
            ]
        );
    }
}
