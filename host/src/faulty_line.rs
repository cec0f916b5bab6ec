//! A serial line that loses and corrupts bytes.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// The line. What it does depends on its seed and its rates only.
#[derive(Debug)]
pub(crate) struct FaultyLine {
    random: ChaCha8Rng,
    drop: f64,
    flip: f64,
}

impl FaultyLine {
    /// `drop` and `flip` are the probabilities, from 0 to 1, that a byte is lost and that one bit
    /// of it is inverted.
    pub(crate) fn new(random: ChaCha8Rng, drop: f64, flip: f64) -> Self {
        Self { random, drop, flip }
    }

    /// Whether it loses any bytes.
    pub(crate) fn drops(&self) -> bool {
        self.drop > 0.0
    }

    /// The byte as it arrives, if it does.
    pub(crate) fn carry(&mut self, byte: u8) -> Option<u8> {
        if self.random.random_bool(self.drop) {
            return None;
        }
        if self.random.random_bool(self.flip) {
            return Some(byte ^ 1 << self.random.random_range(0..8));
        }
        Some(byte)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn carried(drop: f64, flip: f64) -> Vec<Option<u8>> {
        let mut line = FaultyLine::new(ChaCha8Rng::seed_from_u64(1), drop, flip);
        (0..10_000).map(|_| line.carry(0x41)).collect()
    }

    #[test]
    fn faults_come_at_the_rates_asked_for() {
        assert!(carried(0.0, 0.0).iter().all(|byte| *byte == Some(0x41)));
        assert!(carried(1.0, 0.0).iter().all(Option::is_none));
        for byte in carried(0.0, 1.0) {
            assert_eq!(byte.map(|byte| (byte ^ 0x41).count_ones()), Some(1));
        }
        let lost = carried(0.1, 0.5)
            .iter()
            .filter(|byte| byte.is_none())
            .count();
        assert!((900..1100).contains(&lost), "{lost}");
    }
}
