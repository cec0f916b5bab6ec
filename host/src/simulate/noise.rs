//! What disturbs the line, bit by bit: inverted bits, bursts of noise, breaks.
//!
//! Time is counted in the sender's bits, idle ones included. When the next fault comes is drawn in
//! advance, so that a quiet line costs nothing.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::occurrences::{Occurrences, whole};
use super::parameters::Parameters;

/// The disturbances of one trial.
#[derive(Debug)]
pub(super) struct Noise {
    flips: Occurrences,
    bursts: Occurrences,
    breaks: Occurrences,
    /// What the line does in a burst.
    levels: ChaCha8Rng,
    /// No bit before this one is disturbed, but for those that have been asked about.
    quiet_until: u64,
}

impl Noise {
    /// `random` gives a generator of its own for each number.
    pub(super) fn new(parameters: &Parameters, random: impl Fn(u64) -> ChaCha8Rng) -> Self {
        let baud = f64::from(parameters.baud);
        let per_bit = |per_second: f64| (per_second / baud).min(1.0);
        let mut bursts = Occurrences::new(
            random(1),
            per_bit(parameters.burst_rate),
            whole(parameters.burst_length / 1000.0 * baud),
        );
        if let Some(seconds) = parameters.burst_at {
            bursts.begin_at(whole(seconds * baud));
        }
        Self {
            flips: Occurrences::new(random(0), parameters.bit_flip, 1),
            bursts,
            breaks: Occurrences::new(
                random(2),
                per_bit(parameters.break_rate),
                parameters.break_length.into(),
            ),
            levels: random(3),
            quiet_until: 0,
        }
    }

    /// The first bit from `bit` on that is disturbed; ask for ever later ones.
    pub(super) fn quiet_until(&mut self, bit: u64) -> u64 {
        if self.quiet_until <= bit {
            let [flips, bursts, breaks] =
                [&mut self.flips, &mut self.bursts, &mut self.breaks].map(|each| each.next(bit));
            self.quiet_until = flips.min(bursts).min(breaks);
        }
        self.quiet_until
    }

    /// What becomes of a bit that is sent as `level`: both halves of it.
    pub(super) fn disturbed(&mut self, bit: u64, level: bool) -> [bool; 2] {
        let is_flipped = self.flips.next(bit) == bit;
        if self.breaks.next(bit) == bit {
            [false; 2]
        } else if self.bursts.next(bit) == bit {
            self.levels.random()
        } else {
            [level != is_flipped; 2]
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn random(stream: u64) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        random.set_stream(stream);
        random
    }

    /// Of a million bits sent high, how many halves arrive low.
    fn low_halves(parameters: &Parameters) -> usize {
        let mut noise = Noise::new(parameters, random);
        let mut low = 0;
        let mut bit = noise.quiet_until(0);
        while bit < 1_000_000 {
            let halves = noise.disturbed(bit, true);
            low += halves.iter().filter(|high| !**high).count();
            bit = noise.quiet_until(bit + 1);
        }
        low
    }

    #[test]
    fn a_quiet_line_is_never_disturbed() {
        assert_eq!(
            Noise::new(&Parameters::default(), random).quiet_until(0),
            u64::MAX
        );
    }

    #[test]
    fn faults_come_as_often_and_last_as_long_as_asked_for() {
        let quiet = Parameters::default();
        let flipped = low_halves(&Parameters {
            bit_flip: 0.01,
            ..quiet.clone()
        });
        assert!((19_400..20_600).contains(&flipped), "{flipped}");
        assert_eq!(
            low_halves(&Parameters {
                bit_flip: 1.0,
                ..quiet.clone()
            }),
            2_000_000
        );
        // 86.8 breaks of 20 bits in a million bits; the next waits for the end of the last.
        let broken = low_halves(&Parameters {
            break_rate: 10.0,
            ..quiet.clone()
        });
        assert!((2_500..4_500).contains(&broken), "{broken}");
        assert_eq!(broken % 40, 0);
        // One burst of 0.1 s, in which every half bit is one or the other.
        let burst = low_halves(&Parameters {
            burst_at: Some(1.0),
            burst_length: 100.0,
            ..quiet
        });
        assert!((11_520 - 400..11_520 + 400).contains(&burst), "{burst}");
    }
}
