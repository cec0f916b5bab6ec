//! A faulty line: turns the frames that are sent into the bytes that arrive. The line breaks whole frames for tests, or
//! single bytes with given probabilities for simulations and benchmarks.

use rand::Rng;
use rand::seq::IndexedRandom as _;
use rand_chacha::ChaCha8Rng;

use crate::random::{Occurrences, Purpose, Seed};
use crate::stream::StreamStep;

/// Returns the bytes that arrive if the frame has one fault: one bit is inverted, a byte is lost, added, doubled or
/// moved, or only the frame's beginning or end arrives. A few choices leave the frame intact: for example, a byte may
/// be moved to its old position, or the end that arrives may be the whole frame. `choose` chooses a number below its
/// argument: first the position of the fault, then its kind, and then the wrong bit, the added byte or the new position
/// of a moved byte.
///
/// # Panics
/// Panics if the frame is empty.
pub fn broken(frame: &[u8], mut choose: impl FnMut(usize) -> usize) -> Vec<u8> {
    let mut bytes = frame.to_vec();
    let at = choose(bytes.len());
    match choose(8) {
        0 => drop(bytes.remove(at)),
        1 => bytes.insert(at, choose(256).to_le_bytes()[0]),
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(..at)),
        4 => bytes.insert(at, bytes[at]),
        5 => {
            let byte = bytes.remove(at);
            bytes.insert(choose(bytes.len() + 1), byte);
        }
        _ => bytes[at] ^= 1 << choose(8),
    }
    bytes
}

/// Returns the bytes that arrive on a faulty line. All frames arrive intact. Before some of them, a broken copy or
/// noise arrives. The noise contains many bytes of the frames. After the frames, another broken copy arrives.
pub fn faulty(frames: &[Vec<u8>], random: &mut impl Rng) -> Vec<u8> {
    let mut bytes = Vec::new();
    for frame in frames {
        match random.random_range(0..3) {
            0 => bytes.extend(broken(frame, |count| random.random_range(0..count))),
            1 => {
                for _ in 0..random.random_range(1..30) {
                    bytes.push(match random.random_range(0..3) {
                        0 => random.random(),
                        1 => frame[random.random_range(0..frame.len().min(4))],
                        _ => frame[random.random_range(0..frame.len())],
                    });
                }
            }
            _ => {}
        }
        bytes.extend(frame);
    }
    if let Some(frame) = frames.choose(random) {
        bytes.extend(broken(frame, |count| random.random_range(0..count)));
    }
    bytes
}

/// Cuts the bytes into slices: of one byte each, of up to 40 bytes, or of any length.
pub fn cut(bytes: &[u8], random: &mut impl Rng) -> Vec<StreamStep> {
    let most = [1, 40, 40, bytes.len()][random.random_range(0..4)];
    let (mut rest, mut slices) = (bytes, Vec::new());
    while !rest.is_empty() {
        let (slice, behind) = rest.split_at(random.random_range(1..=rest.len().min(most)));
        slices.push(StreamStep::Slice(slice.to_vec()));
        rest = behind;
    }
    slices
}

/// The probability of each fault for each byte, from 0 to 1.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct FaultRates {
    /// The byte is lost.
    pub drop: f64,
    /// One bit of the byte is inverted.
    pub flip: f64,
}

/// A line that loses bytes, as full buffers do, and inverts bits. Receivers get no report of these faults. The faults
/// depend only on the seed and the rates.
#[derive(Debug)]
pub struct ByteFaults {
    drops: Occurrences,
    flips: Occurrences,
    values: ChaCha8Rng,
    /// The number of bytes carried so far.
    carried: u64,
}

impl ByteFaults {
    /// Creates a line with faults at these rates.
    #[must_use]
    pub fn new(rates: FaultRates, seed: Seed) -> Self {
        let occurrences = |purpose, rate| Occurrences::new(seed, purpose, rate, 1);
        Self {
            drops: occurrences(Purpose::Losses, rates.drop),
            flips: occurrences(Purpose::ByteFlips, rates.flip),
            values: seed.random(Purpose::FaultValues),
            carried: 0,
        }
    }

    /// Carries a byte over the line. Returns the byte that arrives, or `None` if it is lost.
    pub fn carry(&mut self, byte: u8) -> Option<u8> {
        let number = self.carried;
        self.carried += 1;
        if self.drops.happens(number) {
            None
        } else if self.flips.happens(number) {
            Some(byte ^ 1 << self.values.random_range(0..8))
        } else {
            Some(byte)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends many zero bytes. For each of them, returns the byte that arrives, or `None` if it is lost.
    fn carried(drop: f64, flip: f64, seed: u64) -> Vec<Option<u8>> {
        let mut faults = ByteFaults::new(FaultRates { drop, flip }, Seed { seed, trial: 0 });
        (0..10_000).map(|_| faults.carry(0)).collect()
    }

    /// `choose` gives the position, the fault, and one more number that some faults need.
    #[test]
    fn a_broken_frame_has_one_fault() {
        for (choices, expected) in [
            ([1, 0, 9], "ace"),
            ([1, 1, 120], "axbce"),
            ([2, 2, 9], "ab"),
            ([1, 3, 9], "bce"),
            ([1, 4, 9], "abbce"),
            ([0, 5, 2], "bcae"),
            ([3, 6, 2], "abca"),
        ] {
            let mut choices = choices.into_iter();
            let bytes = broken(b"abce", |_| choices.next().expect("three choices"));
            assert_eq!(String::from_utf8(bytes).as_deref(), Ok(expected));
        }
    }

    #[test]
    fn each_fault_is_as_frequent_as_its_rate() {
        assert_eq!(carried(0.0, 0.0, 1), vec![Some(0); 10_000]);
        assert_eq!(carried(1.0, 0.0, 1), vec![None; 10_000]);
        let is_flipped = |byte: &Option<u8>| byte.is_some_and(u8::is_power_of_two);
        assert!(carried(0.0, 1.0, 1).iter().all(is_flipped));
        let bytes = carried(0.1, 0.2, 1);
        let lost = bytes.iter().filter(|byte| byte.is_none()).count();
        let flipped = bytes.iter().filter(|byte| is_flipped(byte)).count();
        assert!(
            lost.abs_diff(1_000) < 180 && flipped.abs_diff(1_800) < 240,
            "{lost} {flipped}"
        );
        assert_eq!(carried(0.1, 0.2, 1), bytes);
        assert_ne!(carried(0.1, 0.2, 2), bytes);
    }
}
