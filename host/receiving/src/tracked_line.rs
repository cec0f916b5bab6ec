//! A line that keeps the pending bytes, and reports the outcome of all other bytes.

use framelock::{Counters, DiscardReason, Found, LineEvent};

use crate::any_line::AnyLine;

/// Consecutive bytes with one outcome: a frame, or bytes that were discarded together.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Piece {
    /// The offset of the first byte in the stream.
    pub from: usize,
    /// The bytes, at least one, as they arrived.
    pub bytes: Vec<u8>,
    /// The frame as [`AnyLine::feed`] reports it: without the delimiters and the stuffing of a packet, and with 0 as
    /// the reserved byte of a frame of setpoints. Empty if the bytes were discarded.
    pub frame: Vec<u8>,
    /// The reason why the bytes were discarded, or `None` if they are a frame.
    pub discarded: Option<DiscardReason>,
}

/// A line that keeps its pending bytes.
#[derive(Clone, Debug)]
pub struct TrackedLine {
    line: AnyLine,
    pending: Vec<u8>,
    decided: usize,
}

impl TrackedLine {
    /// Tracks a line that has not received anything.
    #[must_use]
    pub fn new(line: AnyLine) -> Self {
        Self {
            line,
            pending: Vec::new(),
            decided: 0,
        }
    }

    /// Takes a byte. Returns the bytes that now have an outcome, oldest first.
    pub fn push(&mut self, byte: u8) -> Vec<Piece> {
        self.pending.push(byte);
        self.decide(|line, found| line.feed(&[byte], found))
    }

    /// Takes a line event. Returns the bytes that now have an outcome, oldest first.
    pub fn line_event(&mut self, event: LineEvent) -> Vec<Piece> {
        self.decide(|line, found| line.line_event(event, found))
    }

    fn decide(
        &mut self,
        step: impl FnOnce(&mut AnyLine, &mut dyn FnMut(Found<&[u8]>)),
    ) -> Vec<Piece> {
        let mut pieces = Vec::new();
        step(&mut self.line, &mut |found| {
            let count = found.bytes().min(self.pending.len());
            let discarded = match found {
                Found::Frame { .. } => None,
                Found::Discarded { why, .. } => Some(why),
            };
            pieces.push(Piece {
                from: self.decided,
                bytes: self.pending.drain(..count).collect(),
                frame: found.message().unwrap_or_default().to_vec(),
                discarded,
            });
            self.decided += count;
        });
        pieces
    }

    /// Returns the pending bytes, which may still become part of a frame.
    #[must_use]
    pub fn pending(&self) -> &[u8] {
        &self.pending
    }

    /// Returns the number of bytes that are part of a frame or were discarded. This number is the offset of the first
    /// pending byte.
    #[must_use]
    pub const fn decided(&self) -> usize {
        self.decided
    }

    /// Returns the line's counters.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        self.line.counters()
    }

    /// Returns the line.
    #[must_use]
    pub const fn line(&self) -> &AnyLine {
        &self.line
    }
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::indexing_slicing,
        reason = "a panic fails the test"
    )]

    use framelock::motion::Setpoint;
    use framelock_proofs::reference;
    use rand::{Rng, SeedableRng, seq::IndexedRandom};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{Policy, Protocol};

    /// Returns noise with many starts of frames and with some frames. The stream may end inside a frame.
    fn noise(protocol: &Protocol, random: &mut ChaCha8Rng) -> Vec<u8> {
        let mut stream = Vec::new();
        for _ in 0..random.random_range(0..60) {
            if random.random_ratio(1, 3) {
                let bytes: [u8; 3] = std::array::from_fn(|_| *b"AB\r?".choose(random).unwrap());
                stream.extend(protocol.encode_setpoint(Setpoint::from(bytes)));
            } else {
                stream.push(*b"AB\r?".choose(random).unwrap());
            }
        }
        stream.truncate(random.random_range(0..=stream.len()));
        stream
    }

    /// Compares the outcome of every byte with the reference. A line event ends the stream.
    fn agrees<F: reference::NaiveFormat>(name: &str, policy: Policy) {
        let protocol = Protocol::named(name).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut frames = 0;
        for _ in 0..2_000 {
            let stream = noise(&protocol, &mut random);
            let mut expected = Vec::new();
            let pending = reference::whole_buffer::<F>(&stream, |found| expected.push(found));

            let mut line = TrackedLine::new(AnyLine::new(&protocol, policy).unwrap());
            let mut pieces = Vec::new();
            for &byte in &stream {
                pieces.extend(line.push(byte));
            }
            assert_eq!(line.pending(), &stream[stream.len() - pending..]);
            assert_eq!(line.decided(), stream.len() - pending);
            assert_eq!(line.counters().bytes as usize, stream.len());

            let (mut decided, mut outcomes) = (0, Vec::new());
            for piece in &pieces {
                assert_eq!(piece.from, decided);
                decided += piece.bytes.len();
                assert_eq!(piece.bytes, stream[piece.from..decided]);
                let setpoint = protocol.setpoint(&piece.bytes);
                let each = match piece.discarded {
                    None => Ok((piece.bytes.len(), setpoint.unwrap().into())),
                    Some(why) => Err(why),
                };
                let times = piece.discarded.map_or(1, |_| piece.bytes.len());
                outcomes.extend(std::iter::repeat_n(each, times));
                frames += usize::from(piece.discarded.is_none());
            }
            let expected = expected.into_iter().flat_map(|found| match found {
                Found::Frame {
                    length, message, ..
                } => vec![Ok((length, message)); 1],
                Found::Discarded { count, why, .. } => vec![Err(why); count],
            });
            assert!(outcomes.into_iter().eq(expected), "{stream:?}");

            let rest = line.line_event(LineEvent::Idle);
            let rest: Vec<u8> = rest.into_iter().flat_map(|piece| piece.bytes).collect();
            assert_eq!(rest, stream[stream.len() - pending..]);
            assert_eq!((line.pending(), line.decided()), (&[][..], stream.len()));
        }
        assert!(frames > 2_000, "{frames}");
    }

    #[test]
    fn every_byte_has_the_outcome_that_the_reference_gives_it() {
        agrees::<reference::Bin>("bin", Policy::Framelock);
        agrees::<reference::Lecture>("bin", Policy::Lecture);
        agrees::<reference::BinCrc8>("bin-crc8", Policy::Framelock);
    }
}
