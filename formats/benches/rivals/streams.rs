//! The sent frames, the faults on the line, and the frames that arrive whole.

use std::ops::Range;

use framelock_oracles::{ByteFaults, FaultRates, Seed};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The seed of all streams, so that their bytes are the same in every run and on every machine.
pub(crate) const SEED: u64 = 15;

/// The padding after the last frame. No frame begins in the padding. The padding completes any false frame that a
/// receiver still waits for.
const BEHIND: [u8; 300] = [0x55; 300];

/// The faults of the line.
#[derive(Clone, Copy)]
pub(crate) struct Fault {
    pub(crate) name: &'static str,
    /// The probabilities that a byte is lost, and that one of its bits is inverted.
    lost: f64,
    flipped: f64,
    has_bursts: bool,
    is_sync_dense: bool,
    loses_lengths: bool,
}

const CLEAN: Fault = Fault {
    name: "clean",
    lost: 0.0,
    flipped: 0.0,
    has_bursts: false,
    is_sync_dense: false,
    loses_lengths: false,
};

#[rustfmt::skip]
pub(crate) const FAULTS: [Fault; 6] = [
    CLEAN,
    Fault { name: "1 % lost", lost: 0.01, ..CLEAN },
    Fault { name: "0.1 % flips", flipped: 0.001, ..CLEAN },
    Fault { name: "bursts", has_bursts: true, ..CLEAN },
    Fault { name: "sync-dense", lost: 0.01, is_sync_dense: true, ..CLEAN },
    Fault { name: "length lost", loses_lengths: true, ..CLEAN },
];

/// A protocol's frames.
pub(crate) struct Protocol {
    pub(crate) name: &'static str,
    /// The bytes that occur in the payloads of the sync-dense stream: bytes that begin frames, and short lengths.
    pub(crate) sync_dense: &'static [u8],
    /// The index of the length byte, or of the second byte if the protocol has no length byte.
    pub(crate) length_at: usize,
    /// The longest frame that is sent.
    pub(crate) longest: usize,
    /// Makes a frame.
    pub(crate) frame: fn(&mut Payload) -> Vec<u8>,
    /// Extracts from a frame the key that identifies this frame in the comparison. The key is a part of the frame that
    /// every receiver returns to its user.
    pub(crate) key: fn(&[u8]) -> Vec<u8>,
}

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
            ..FaultRates::default()
        };
        let mut line = ByteFaults::new(
            rates,
            Seed {
                seed: SEED,
                trial: 0,
            },
        );
        let mut bursts = ChaCha8Rng::seed_from_u64(SEED + 1);
        let mut burst = 0;
        let (mut bytes, mut whole) = (Vec::new(), Vec::new());
        for number in 0..frames {
            payload.number = number;
            let sent = (protocol.frame)(&mut payload);
            assert!(sent.len() <= protocol.longest);
            let loses_length = fault.loses_lengths && bursts.random_bool(0.1);
            let begin = bytes.len();
            for (place, &byte) in sent.iter().enumerate() {
                if fault.has_bursts && bursts.random_bool(0.001) {
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
