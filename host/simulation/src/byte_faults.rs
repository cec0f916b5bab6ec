//! Faults of whole bytes after the UART: bytes are lost, altered, duplicated or inserted, as by USB
//! adapters and full buffers. Receivers get no report of these faults.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::random::{Occurrences, Purpose, Seed};

/// The probability of each fault for each byte, from 0 to 1.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct FaultRates {
    /// The byte is lost.
    pub drop: f64,
    /// One bit of the byte is inverted.
    pub flip: f64,
    /// The byte arrives twice.
    pub duplicate: f64,
    /// A byte of any value arrives before this byte.
    pub insert: f64,
}

/// The number of times that each fault occurred.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FaultCounts {
    /// Bytes sent through the line.
    pub bytes: u64,
    /// Bytes lost.
    pub dropped: u64,
    /// Bytes with an inverted bit.
    pub flipped: u64,
    /// Bytes that arrived twice.
    pub duplicated: u64,
    /// Inserted bytes, which nobody sent.
    pub inserted: u64,
}

/// A line with such faults. The faults depend only on the seed and the rates.
#[derive(Debug)]
pub struct ByteFaults {
    drops: Occurrences,
    flips: Occurrences,
    duplicates: Occurrences,
    insertions: Occurrences,
    values: ChaCha8Rng,
    counts: FaultCounts,
}

impl ByteFaults {
    /// Creates a line with faults at these rates.
    #[must_use]
    pub fn new(rates: FaultRates, seed: Seed) -> Self {
        let occurrences = |purpose, rate| Occurrences::new(seed, purpose, rate, 1);
        Self {
            drops: occurrences(Purpose::Losses, rates.drop),
            flips: occurrences(Purpose::ByteFlips, rates.flip),
            duplicates: occurrences(Purpose::Duplicates, rates.duplicate),
            insertions: occurrences(Purpose::Insertions, rates.insert),
            values: seed.random(Purpose::FaultValues),
            counts: FaultCounts::default(),
        }
    }

    /// Carries a byte over the line. Returns the bytes that arrive: an inserted byte, the byte
    /// itself unless it is lost, and the copy if the byte is duplicated.
    pub fn carry(&mut self, byte: u8) -> [Option<u8>; 3] {
        let number = self.counts.bytes;
        self.counts.bytes += 1;
        let mut carried = [None, Some(byte), None];
        let [inserted, received, again] = &mut carried;
        if self.insertions.happens(number) {
            self.counts.inserted += 1;
            *inserted = Some(self.values.random());
        }
        if self.drops.happens(number) {
            self.counts.dropped += 1;
            *received = None;
            return carried;
        }
        if self.flips.happens(number) {
            self.counts.flipped += 1;
            *received = Some(byte ^ 1 << self.values.random_range(0..8));
        }
        if self.duplicates.happens(number) {
            self.counts.duplicated += 1;
            *again = *received;
        }
        carried
    }

    /// Returns the faults counted so far.
    #[must_use]
    pub fn counts(&self) -> FaultCounts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: &[u8] = b"AB\0\x10\x20\x30\r";

    fn carried(rates: FaultRates, seed: u64) -> (Vec<u8>, FaultCounts) {
        let mut faults = ByteFaults::new(rates, Seed { seed, trial: 0 });
        let sent = FRAME.repeat(1_000);
        let bytes = sent.iter().flat_map(|&byte| faults.carry(byte));
        (bytes.flatten().collect(), faults.counts())
    }

    #[test]
    fn without_faults_bytes_are_what_they_are() {
        let (bytes, counts) = carried(FaultRates::default(), 1);
        assert_eq!(bytes, FRAME.repeat(1_000));
        let only_bytes = FaultCounts {
            bytes: 7_000,
            ..FaultCounts::default()
        };
        assert_eq!(counts, only_bytes);
    }

    #[test]
    fn each_fault_is_as_frequent_as_asked_for_and_counted() {
        let rates = FaultRates {
            drop: 0.1,
            flip: 0.2,
            duplicate: 0.05,
            insert: 0.15,
        };
        let (bytes, counts) = carried(rates, 1);
        assert_eq!(counts.bytes, 7_000);
        assert_eq!(
            bytes.len() as u64,
            counts.bytes - counts.dropped + counts.duplicated + counts.inserted
        );
        for (count, expected) in [
            (counts.dropped, 700),
            (counts.flipped, 1_260),
            (counts.duplicated, 315),
            (counts.inserted, 1_050),
        ] {
            assert!(count.abs_diff(expected) < 180, "{counts:?}");
        }
        assert_eq!(carried(rates, 1), (bytes.clone(), counts));
        assert_ne!(carried(rates, 2).0, bytes);
    }

    #[test]
    fn certain_faults_are_exactly_these() {
        let only = |rates| carried(rates, 3).0;
        let none = FaultRates::default();
        assert!(only(FaultRates { drop: 1.0, ..none }).is_empty());
        let doubled = only(FaultRates {
            duplicate: 1.0,
            ..none
        });
        assert!(doubled.starts_with(b"AABB\0\0\x10\x10\x20\x20\x30\x30\r\rAABB"));
        let inserted = only(FaultRates {
            insert: 1.0,
            ..none
        });
        let kept: Vec<u8> = inserted.iter().skip(1).step_by(2).copied().collect();
        assert_eq!(kept, FRAME.repeat(1_000));
        let flipped = only(FaultRates { flip: 1.0, ..none });
        let differences = flipped.iter().zip(FRAME.iter().cycle());
        assert!(
            differences
                .clone()
                .all(|(flipped, sent)| (flipped ^ sent).is_power_of_two())
        );
        assert_eq!(differences.count(), 7_000);
    }
}
