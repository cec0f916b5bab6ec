//! Repeatable random numbers, and the times at which faults occur.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The purpose of random numbers. Each purpose has a generator of its own, so that more faults of one kind change
/// neither the other faults nor the frames sent. Do not change the values of this enum, because a seed must give the
/// same results in each version.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// Inverted bits on the line.
    BitFlips = 0,
    /// Bursts of noise on the line.
    Bursts = 1,
    /// The levels of the line during a burst.
    BurstLevels = 3,
    /// The frames of the sender.
    Sender = 4,
    /// Lost bytes.
    Losses = 5,
    /// Values drawn once per trial.
    Once = 7,
    /// The bytes in which a bit is inverted.
    ByteFlips = 8,
    /// The bit that is inverted in each byte of [`ByteFlips`](Self::ByteFlips).
    FaultValues = 10,
}

/// The source of a trial's random numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Seed {
    /// The seed that the user chose.
    pub seed: u64,
    /// The trial's number.
    pub trial: u64,
}

impl Seed {
    /// Returns the generator for this purpose. Each trial and purpose has its own stream number. The
    /// stream numbers of purposes from 8 on have the highest bit set.
    #[must_use]
    pub fn random(self, purpose: Purpose) -> ChaCha8Rng {
        let purpose = purpose as u64;
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream((purpose / 8) << 63 | (self.trial * 8 + purpose % 8));
        random
    }
}

/// A random fault that lasts for a number of positions (bits or bytes). Outside the fault, it begins
/// with the same probability at each position. Callers ask for positions in ascending order.
///
/// The next occurrence is drawn in advance, so that positions without a fault need no random numbers.
#[derive(Debug)]
pub struct Occurrences {
    random: ChaCha8Rng,
    /// The logarithm of the probability that no occurrence begins at a given position.
    quiet_logarithm: f64,
    length: u64,
    /// The first position of the next or the current occurrence.
    begin: u64,
}

impl Occurrences {
    /// Draws the first occurrence. An occurrence begins at each free position with this
    /// `probability`, and lasts for `length` positions.
    #[must_use]
    pub fn new(seed: Seed, purpose: Purpose, probability: f64, length: u64) -> Self {
        let mut occurrences = Self {
            random: seed.random(purpose),
            quiet_logarithm: libm::log1p(-probability),
            length: length.max(1),
            begin: 0,
        };
        occurrences.draw_from(0);
        occurrences
    }

    fn draw_from(&mut self, place: u64) {
        // A number from 0 (excluded) to 1 (included).
        let uniform = 1.0 - self.random.random::<f64>();
        let wait = if self.quiet_logarithm == 0.0 {
            u64::MAX
        } else {
            whole(libm::log(uniform) / self.quiet_logarithm)
        };
        self.begin = place.saturating_add(wait);
    }

    /// Returns the first position at or after `place` that is part of an occurrence.
    pub fn next(&mut self, place: u64) -> u64 {
        while self.begin.saturating_add(self.length) <= place {
            self.draw_from(self.begin + self.length);
        }
        self.begin.max(place)
    }

    /// Returns whether `place` is part of an occurrence.
    pub fn happens(&mut self, place: u64) -> bool {
        self.next(place) == place
    }
}

/// Rounds down to a whole number.
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, but no value gets there"
)]
pub fn whole(number: f64) -> u64 {
    number as u64
}
