//! Faults of whole bytes after the UART: bytes are lost or altered, as by USB adapters and full buffers.
//! Receivers get no report of these faults.

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
}

/// A line with such faults. The faults depend only on the seed and the rates.
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

    /// Returns the byte that arrives for each of many bytes 0.
    fn carried(drop: f64, flip: f64, seed: u64) -> Vec<Option<u8>> {
        let mut faults = ByteFaults::new(FaultRates { drop, flip }, Seed { seed, trial: 0 });
        (0..10_000).map(|_| faults.carry(0)).collect()
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
