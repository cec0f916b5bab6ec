//! The sent frames, the faults on the line, and the frames that arrive whole.

use std::ops::Range;

use framelock_oracles::{ByteFaults, FaultRates, Seed};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::protocols::Protocol;

/// The seed of all streams, so that their bytes are the same in every run and on every machine.
pub(crate) const SEED: u64 = 15;

/// The padding after the last frame. No frame begins in the padding. The padding completes any false frame that a
/// receiver still waits for.
const BEHIND: [u8; 300] = [0x55; 300];

/// The faults of the line.
#[derive(Clone, Copy)]
pub(crate) struct Fault {
    /// The probability that a byte is lost.
    lost: f64,
    /// The probability that one bit of a byte is inverted.
    flipped: f64,
    /// The probability that a burst of random bytes begins at a byte. These bytes replace the sent bytes.
    burst: f64,
    is_sync_dense: bool,
    loses_lengths: bool,
}

const CLEAN: Fault = Fault {
    lost: 0.0,
    flipped: 0.0,
    burst: 0.0,
    is_sync_dense: false,
    loses_lengths: false,
};

/// The faults of the streams, one for each column of the tables of lost and false frames in docs/rivals.md.
#[rustfmt::skip]
pub(crate) const FAULTS: [Fault; 7] = [
    CLEAN,
    Fault { lost: 0.01, ..CLEAN },
    Fault { flipped: 0.001, ..CLEAN },
    Fault { burst: 0.001, ..CLEAN },
    Fault { lost: 0.01, is_sync_dense: true, ..CLEAN },
    Fault { loses_lengths: true, ..CLEAN },
    // Noise.
    Fault { burst: 1.0, ..CLEAN },
];

/// The source of a frame's contents.
pub(crate) struct Payload {
    random: ChaCha8Rng,
    bytes: Option<&'static [u8]>,
    number: u16,
}

impl Payload {
    /// Returns a random element of `kinds`. All elements are equally likely.
    pub(crate) fn one_of<T: Copy>(&mut self, kinds: &[T]) -> T {
        kinds[self.random.random_range(0..kinds.len())]
    }

    /// Returns `length` bytes of payload. The frame's number comes first and makes the payload unique. The other bytes
    /// are drawn at random from the bytes that this stream's payloads may contain.
    pub(crate) fn bytes(&mut self, length: usize) -> Vec<u8> {
        let mut payload = self.number.to_be_bytes().to_vec();
        while payload.len() < length {
            payload.push(match self.bytes {
                Some(bytes) => self.one_of(bytes),
                None => self.random.random(),
            });
        }
        payload
    }
}

/// The bytes that arrive.
pub(crate) struct Stream {
    pub(crate) bytes: Vec<u8>,
    /// The positions of the frames that have arrived whole.
    pub(crate) whole: Vec<Range<usize>>,
}

impl Stream {
    /// Returns `frames` frames of a protocol, sent over a line with this fault.
    pub(crate) fn new(protocol: &Protocol, fault: Fault, frames: u16) -> Self {
        let mut payload = Payload {
            random: ChaCha8Rng::seed_from_u64(SEED),
            bytes: fault.is_sync_dense.then_some(protocol.sync_dense),
            number: 0,
        };
        let rates = FaultRates {
            drop: fault.lost,
            flip: fault.flipped,
        };
        let (seed, trial) = (SEED, 0);
        let mut line = ByteFaults::new(rates, Seed { seed, trial });
        let mut bursts = ChaCha8Rng::seed_from_u64(SEED + 1);
        let mut burst = 0;
        let (mut bytes, mut whole) = (Vec::new(), Vec::new());
        for number in 0..frames {
            payload.number = number;
            let sent = (protocol.frame)(&mut payload);
            let loses_length = fault.loses_lengths && bursts.random_bool(0.1);
            let begin = bytes.len();
            for (place, &byte) in sent.iter().enumerate() {
                if fault.burst > 0.0 && bursts.random_bool(fault.burst) {
                    burst = bursts.random_range(1..=40);
                }
                if burst > 0 {
                    burst -= 1;
                    bytes.push(bursts.random());
                } else if !(loses_length && place == protocol.length_at) {
                    bytes.extend(line.carry(byte));
                }
            }
            if bytes[begin..] == sent {
                whole.push(begin..bytes.len());
            }
        }
        bytes.extend(BEHIND);
        Self { bytes, whole }
    }

    /// Returns a stream without faults, up to the end of the last frame.
    pub(crate) fn clean(protocol: &Protocol, frames: u16) -> Vec<u8> {
        let Self { mut bytes, whole } = Self::new(protocol, CLEAN, frames);
        bytes.truncate(whole.last().map_or(0, |last| last.end));
        bytes
    }
}
