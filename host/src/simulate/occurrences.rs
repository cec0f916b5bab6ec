//! When faults come.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Something that happens at random, with the same probability in each place (a bit, a byte), and
/// lasts a while.
///
/// When it happens next is drawn in advance, so that it costs nothing where it does not.
#[derive(Debug)]
pub(super) struct Occurrences {
    random: ChaCha8Rng,
    /// The logarithm of the probability that it does not begin in a given place.
    quiet_logarithm: f64,
    length: u64,
    /// The next one, or the one under way: its first place, and the one behind its last.
    begin: u64,
    end: u64,
}

impl Occurrences {
    /// `probability`: that it begins in a place that is free; it has `length` of them.
    pub(super) fn new(random: ChaCha8Rng, probability: f64, length: u64) -> Self {
        let mut occurrences = Self {
            random,
            quiet_logarithm: libm::log1p(-probability),
            length: length.max(1),
            begin: 0,
            end: 0,
        };
        occurrences.draw();
        occurrences
    }

    /// Makes the next one begin there; those behind it come at random.
    pub(super) fn begin_at(&mut self, place: u64) {
        self.begin = place;
        self.end = place.saturating_add(self.length);
    }

    /// The next one, behind the last.
    fn draw(&mut self) {
        // From 0 exclusive to 1 inclusive.
        let uniform = 1.0 - self.random.random::<f64>();
        let wait = if self.quiet_logarithm == 0.0 {
            u64::MAX
        } else {
            whole(libm::log(uniform) / self.quiet_logarithm)
        };
        self.begin = self.end.saturating_add(wait);
        self.end = self.begin.saturating_add(self.length);
    }

    /// The first place from `place` on in which it happens; ask for ever later ones.
    pub(super) fn next(&mut self, place: u64) -> u64 {
        while self.end <= place {
            self.draw();
        }
        self.begin.max(place)
    }
}

/// Rounded down.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, which is never"
)]
pub(super) fn whole(number: f64) -> u64 {
    number as u64
}
