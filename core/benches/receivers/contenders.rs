//! The contenders: the core's machines, other ways to find the same frames, and yardsticks.

use std::hint::black_box;
use std::sync::LazyLock;

use cobs::CobsDecoderOwned;
use framelock::motion::Setpoint;
use framelock::{Line, Parser};
use framelock_proofs::reference;
use memchr::memmem::Finder;
use regex::bytes::Regex;
use winnow::binary::u8 as any_byte;
use winnow::combinator::{alt, preceded, seq, terminated};
use winnow::error::{EmptyError, ErrMode};
use winnow::token::{any, literal};
use winnow::{Parser as _, Partial};

use crate::answer::Answer;

/// A machine of the core that takes the lecture's frames.
pub(crate) trait Machine:
    for<'a> Parser<Message<'a> = Setpoint> + Default + 'static
{
}

impl<M: for<'a> Parser<Message<'a> = Setpoint> + Default + 'static> Machine for M {}

/// Runs a machine of the core, byte by byte.
pub(crate) fn push<M: Machine>(bytes: &[u8]) -> Answer {
    let mut parser = M::default();
    let mut answer = Answer::default();
    for (index, &byte) in bytes.iter().enumerate() {
        if let Some(setpoint) = parser.push(byte) {
            answer.frame(index, setpoint);
        }
    }
    answer
}

/// Runs a machine of the core on the whole slice in one call.
pub(crate) fn feed<M: Machine>(bytes: &[u8]) -> Answer {
    let mut answer = Answer::default();
    let mut behind = 0;
    M::default().feed(bytes, |found| answer.found(&mut behind, found));
    answer
}

/// Pushes the bytes into a line, which counts the outcome of each byte.
pub(crate) fn line_push<M: Machine>(bytes: &[u8]) -> Answer {
    let mut line = Line::new(M::default());
    let mut answer = Answer::default();
    for (index, &byte) in bytes.iter().enumerate() {
        if let Some(setpoint) = line.push(byte) {
            answer.frame(index, setpoint);
        }
    }
    black_box(line.counters());
    answer
}

/// Feeds the whole slice in one call to a line, which counts the outcome of each byte.
pub(crate) fn line_feed<M: Machine>(bytes: &[u8]) -> Answer {
    let mut line = Line::new(M::default());
    let mut answer = Answer::default();
    let mut behind = 0;
    line.feed(bytes, |found| answer.found(&mut behind, found));
    black_box(line.counters());
    answer
}

/// Runs the naive reference, which needs the whole stream.
pub(crate) fn reference<F: reference::NaiveFormat>(bytes: &[u8]) -> Answer {
    Answer::of_reference::<F>(bytes)
}

/// Finds every match of a regular expression, from left to right.
pub(crate) fn regex(bytes: &[u8]) -> Answer {
    static FRAME: LazyLock<Regex> =
        LazyLock::new(|| Regex::new(r"(?s-u)AB.{4}\r").expect("a valid expression"));
    let mut answer = Answer::default();
    for found in FRAME.find_iter(bytes) {
        if let &[_, _, _, pitch, roll, yaw, _] = found.as_bytes() {
            answer.frame(found.end() - 1, Setpoint { pitch, roll, yaw });
        }
    }
    answer
}

/// Searches for "AB" with a fast substring search, then compares the terminator. Written by hand.
pub(crate) fn memmem(bytes: &[u8]) -> Answer {
    let sync = Finder::new(b"AB");
    let mut answer = Answer::default();
    let mut at = 0;
    while let Some(rest) = bytes.get(at..)
        && let Some(distance) = sync.find(rest)
    {
        at += distance;
        let candidate = bytes.get(at..).and_then(<[u8]>::first_chunk);
        if let Some(&[_, _, _, pitch, roll, yaw, b'\r']) = candidate {
            answer.frame(at + 6, Setpoint { pitch, roll, yaw });
            at += 7;
        } else {
            at += 1;
        }
    }
    answer
}

/// Runs a parser combinator for streams, which in each step takes a frame or skips one byte.
pub(crate) fn winnow(bytes: &[u8]) -> Answer {
    type Stream<'a> = Partial<&'a [u8]>;
    type Error = ErrMode<EmptyError>;
    fn frame(stream: &mut Stream<'_>) -> Result<Setpoint, Error> {
        let setpoint = seq! { Setpoint { pitch: any_byte, roll: any_byte, yaw: any_byte } };
        let payload = preceded(any, setpoint);
        preceded(literal(b"AB"), terminated(payload, literal(b'\r'))).parse_next(stream)
    }
    fn frame_or_byte(stream: &mut Stream<'_>) -> Result<Option<Setpoint>, Error> {
        alt((frame.map(Some), any.value(None))).parse_next(stream)
    }

    let mut answer = Answer::default();
    let mut stream = Partial::new(bytes);
    // The incomplete frame at the end of the slice ends the loop.
    while let Ok(outcome) = frame_or_byte(&mut stream) {
        if let Some(setpoint) = outcome {
            answer.frame(bytes.len() - stream.len() - 1, setpoint);
        }
    }
    answer
}

/// Yardstick: visits every 'A' of the stream, as fast as the `memchr` crate can.
pub(crate) fn memchr_pass(bytes: &[u8]) -> Answer {
    let mut answer = Answer::default();
    memchr::memchr_iter(b'A', bytes).for_each(|index| answer.byte(index));
    answer
}

/// Returns the expected answer of [`memchr_pass`].
pub(crate) fn every_a(bytes: &[u8]) -> Answer {
    let mut answer = Answer::default();
    for (index, &byte) in bytes.iter().enumerate() {
        if byte == b'A' {
            answer.byte(index);
        }
    }
    answer
}

/// Encodes the payload of each frame as a COBS message with its sentinel.
pub(crate) fn cobs_encode(frames: &[u8]) -> Vec<u8> {
    let mut encoded = Vec::with_capacity(frames.len());
    for frame in frames.chunks_exact(7) {
        if let [_, _, payload @ .., _] = frame {
            encoded.extend(cobs::encode_vec(payload));
            encoded.push(0);
        }
    }
    encoded
}

/// Yardstick: decodes the frames' payloads from COBS messages. COBS is a framing that is designed for easy decoding.
/// Each message counts as a frame of seven bytes, so that the throughput is comparable with that of the other
/// contenders.
pub(crate) fn cobs_decode(encoded: &[u8]) -> Answer {
    let mut answer = Answer::default();
    let mut decoder = CobsDecoderOwned::new(4);
    let mut rest = encoded;
    let mut index = 6;
    while let Ok(Some(report)) = decoder.push(rest) {
        if let &[_reserved, pitch, roll, yaw] = decoder.dest() {
            answer.frame(index, Setpoint { pitch, roll, yaw });
        }
        index += 7;
        rest = rest.get(report.parsed_size()..).unwrap_or_default();
    }
    answer
}
