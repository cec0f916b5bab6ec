//! Repeatable randomness, and when faults come.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What random numbers are for. Each purpose has a generator of its own, so that more of one kind
/// of fault changes neither the others nor what is sent.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Purpose {
    BitFlips,
    Bursts,
    Breaks,
    BurstLevels,
    Sender,
    Losses,
    Duplicates,
    /// What is drawn once in a trial.
    Once,
    ByteFlips,
    Insertions,
    /// Which bit is inverted, which byte inserted.
    FaultValues,
}

/// Where the random numbers of a trial come from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Seed {
    /// The user's.
    pub seed: u64,
    /// The trial's number.
    pub trial: u64,
}

impl Seed {
    /// The streams are eight for each trial, and eight more in the upper half of the numbers.
    pub(crate) fn random(self, purpose: Purpose) -> ChaCha8Rng {
        let purpose = purpose as u64;
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream((purpose / 8) << 63 | (self.trial * 8 + purpose % 8));
        random
    }
}

/// Something that happens at random, with the same probability in each place (a bit, a byte), and
/// lasts a while. Places are asked for in rising order.
///
/// When it happens next is drawn in advance, so that it costs nothing where it does not.
#[derive(Debug)]
pub(crate) struct Occurrences {
    random: ChaCha8Rng,
    /// The logarithm of the probability that it does not begin in a given place.
    quiet_logarithm: f64,
    length: u64,
    /// The first place of the next one, or of the current one. Those behind it come at random.
    pub(crate) begin: u64,
}

impl Occurrences {
    /// `probability`: that it begins in a place that is free; it lasts for `length` of them.
    pub(crate) fn new(seed: Seed, purpose: Purpose, probability: f64, length: u64) -> Self {
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
        // From 0 exclusive to 1 inclusive.
        let uniform = 1.0 - self.random.random::<f64>();
        let wait = if self.quiet_logarithm == 0.0 {
            u64::MAX
        } else {
            whole(libm::log(uniform) / self.quiet_logarithm)
        };
        self.begin = place.saturating_add(wait);
    }

    /// The first place from `place` on in which it happens.
    pub(crate) fn next(&mut self, place: u64) -> u64 {
        while self.begin.saturating_add(self.length) <= place {
            self.draw_from(self.begin + self.length);
        }
        self.begin.max(place)
    }

    /// Whether it happens in `place`.
    pub(crate) fn happens(&mut self, place: u64) -> bool {
        self.next(place) == place
    }
}

/// Rounded down.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, which is never reached"
)]
pub(crate) fn whole(number: f64) -> u64 {
    number as u64
}
