//! Faults on purpose, to see what a board makes of them.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::faulty_line::FaultyLine;

/// How probable each fault is, for each byte: 0 to 1.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct FaultRates {
    /// The byte is not sent.
    pub(super) drop: f64,
    /// One bit of it is inverted.
    pub(super) flip: f64,
    /// It is sent twice.
    pub(super) duplicate: f64,
    /// A byte of any value is sent in front of it.
    pub(super) insert: f64,
}

/// What was done.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct FaultTally {
    /// Bytes that were to be sent.
    pub(super) bytes: u64,
    pub(super) dropped: u64,
    pub(super) flipped: u64,
    pub(super) duplicated: u64,
    pub(super) inserted: u64,
}

/// Puts faults into bytes. Which ones depends on the seed, the rates and the bytes only.
pub(super) struct Faults {
    rates: FaultRates,
    line: FaultyLine,
    random: ChaCha8Rng,
    tally: FaultTally,
}

impl Faults {
    pub(super) fn new(rates: FaultRates, seed: u64) -> Self {
        let random = |stream| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(stream);
            random
        };
        Self {
            rates,
            line: FaultyLine::new(random(0), rates.drop, rates.flip),
            random: random(1),
            tally: FaultTally::default(),
        }
    }

    /// Appends to `sent` what is sent of `bytes`.
    pub(super) fn apply(&mut self, bytes: &[u8], sent: &mut Vec<u8>) {
        for &byte in bytes {
            self.tally.bytes += 1;
            if self.random.random_bool(self.rates.insert) {
                self.tally.inserted += 1;
                sent.push(self.random.random());
            }
            let Some(carried) = self.line.carry(byte) else {
                self.tally.dropped += 1;
                continue;
            };
            self.tally.flipped += u64::from(carried != byte);
            sent.push(carried);
            if self.random.random_bool(self.rates.duplicate) {
                self.tally.duplicated += 1;
                sent.push(carried);
            }
        }
    }

    /// What was done, if anything was to be done.
    pub(super) fn tally(&self) -> Option<FaultTally> {
        (self.rates != FaultRates::default()).then_some(self.tally)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent(rates: FaultRates, seed: u64) -> (Vec<u8>, Option<FaultTally>) {
        let mut faults = Faults::new(rates, seed);
        let mut sent = Vec::new();
        for _ in 0..1_000 {
            faults.apply(b"AB\0\x10\x20\x30\r", &mut sent);
        }
        (sent, faults.tally())
    }

    #[test]
    fn without_faults_bytes_are_what_they_are() {
        let (bytes, tally) = sent(FaultRates::default(), 1);
        assert_eq!(bytes, b"AB\0\x10\x20\x30\r".repeat(1_000));
        assert_eq!(tally, None);
    }

    #[test]
    fn each_fault_is_done_as_often_as_asked_for_and_counted() {
        let rates = FaultRates {
            drop: 0.1,
            flip: 0.2,
            duplicate: 0.05,
            insert: 0.15,
        };
        let (bytes, tally) = sent(rates, 1);
        let tally = tally.unwrap_or_default();
        assert_eq!(tally.bytes, 7_000);
        assert_eq!(
            bytes.len() as u64,
            tally.bytes - tally.dropped + tally.duplicated + tally.inserted
        );
        for (count, expected) in [
            (tally.dropped, 700),
            (tally.flipped, 1_260),
            (tally.duplicated, 315),
            (tally.inserted, 1_050),
        ] {
            assert!(count.abs_diff(expected) < 120, "{tally:?}");
        }
        assert_eq!(sent(rates, 1), (bytes.clone(), Some(tally)));
        assert_ne!(sent(rates, 2).0, bytes);
    }

    #[test]
    fn certain_faults_are_exactly_these() {
        let only = |rates| sent(rates, 3).0;
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
        assert_eq!(kept, b"AB\0\x10\x20\x30\r".repeat(1_000));
        let flipped = only(FaultRates { flip: 1.0, ..none });
        assert_eq!(flipped.len(), 7_000);
    }
}
