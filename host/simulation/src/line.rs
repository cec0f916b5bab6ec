//! The sending end of the line. It sends characters bit by bit with the sender's own clock, and
//! noise disturbs them.
//!
//! The [`Uart`] at the other end turns the line's levels into bytes. The next disturbance is drawn in advance, so that
//! a line without noise costs little time.

use anyhow::{Result, ensure};
use framelock_oracles::{Occurrences, Purpose, Seed, whole};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::parameters::Parameters;
use crate::uart::{BIT, BITS_PER_BYTE, Uart};

/// The line, with the noise on it and the receiving UART at its end.
///
/// Positions on the line are counted in the sender's bits, including idle ones. Times are counted
/// in steps. A tick of the receiver's clock has 2^16 steps.
#[derive(Debug)]
pub(crate) struct NoisyLine {
    pub(crate) uart: Uart,
    noise: Noise,
    /// The length of one of the sender's bits, in time steps.
    bit: u64,
    /// The time at which the sender's bit 0 begins. It may lie anywhere in a tick of the receiver,
    /// because the two clocks are independent.
    phase: u64,
    /// Bits sent, including idle ones.
    pub(crate) sent: u64,
}

impl NoisyLine {
    /// Creates an idle line. The sender's first bit begins at the time `phase`, which is less than
    /// one tick of the receiver.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "between half a bit and two"
    )]
    pub(crate) fn new(parameters: &Parameters, seed: Seed, phase: u64) -> Self {
        let mut uart = Uart::default();
        uart.advance(true, phase);
        Self {
            uart,
            noise: Noise::new(parameters, seed),
            bit: (BIT as f64 / (1.0 + parameters.baud_error / 100.0)).round() as u64,
            phase,
            sent: 0,
        }
    }

    /// Returns the index of the bit that is on the line at this time.
    pub(crate) fn bit_at(&self, time: u64) -> u64 {
        time.saturating_sub(self.phase) / self.bit
    }

    /// Returns the time at which this bit begins.
    pub(crate) fn instant(&self, bit: u64) -> u64 {
        self.phase + bit * self.bit
    }

    /// Keeps the line idle until this bit.
    pub(crate) fn idle_until(&mut self, bit: u64) {
        while self.sent < bit {
            let quiet = self.noise.quiet_until(self.sent).min(bit);
            if quiet == self.sent {
                self.send_bit(true);
            } else {
                self.uart.advance(true, self.instant(quiet));
                self.sent = quiet;
            }
        }
    }

    /// Sends a byte.
    pub(crate) fn send(&mut self, byte: u8) {
        character(byte).for_each(|bit| self.send_bit(bit));
    }

    fn send_bit(&mut self, level: bool) {
        let bit = self.sent;
        self.sent += 1;
        if self.noise.quiet_until(bit) > bit {
            self.uart.advance(level, self.instant(self.sent));
        } else {
            let [first, second] = self.noise.disturbed(bit, level);
            self.uart.advance(first, self.instant(bit) + self.bit / 2);
            self.uart.advance(second, self.instant(self.sent));
        }
    }
}

/// Returns the levels of a character: a low start bit, the data bits from the least significant
/// one, and a high stop bit.
fn character(byte: u8) -> impl Iterator<Item = bool> {
    let levels = 1 << (BITS_PER_BYTE - 1) | u16::from(byte) << 1;
    (0..BITS_PER_BYTE).map(move |bit| levels >> bit & 1 == 1)
}

/// Inverted bits and bursts of noise.
#[derive(Debug)]
struct Noise {
    flips: Occurrences,
    bursts: Occurrences,
    /// Draws the levels of the line during a burst.
    levels: ChaCha8Rng,
    /// The result of the last search for a disturbed bit. No bit between the start of the search and this bit is
    /// disturbed.
    quiet_until: u64,
}

impl Noise {
    fn new(parameters: &Parameters, seed: Seed) -> Self {
        let baud = f64::from(parameters.baud);
        let bursts_per_bit = (parameters.burst_rate / baud).min(1.0);
        let burst_length = whole(parameters.burst_length / 1000.0 * baud);
        Self {
            flips: Occurrences::new(seed, Purpose::BitFlips, parameters.bit_flip, 1),
            bursts: Occurrences::new(seed, Purpose::Bursts, bursts_per_bit, burst_length),
            levels: seed.random(Purpose::BurstLevels),
            quiet_until: 0,
        }
    }

    /// Returns the first disturbed bit at or after `bit`. Successive calls must pass bits in ascending order.
    fn quiet_until(&mut self, bit: u64) -> u64 {
        if self.quiet_until <= bit {
            self.quiet_until = self.flips.next(bit).min(self.bursts.next(bit));
        }
        self.quiet_until
    }

    /// Returns the levels of both halves of a bit that is sent as `level`.
    fn disturbed(&mut self, bit: u64, level: bool) -> [bool; 2] {
        let is_flipped = self.flips.happens(bit);
        if self.bursts.happens(bit) {
            self.levels.random()
        } else {
            [level != is_flipped; 2]
        }
    }
}

/// Checks that a line with this baud rate can carry `rate` frames per second, each of `bytes` bytes. The error states
/// the highest possible rate, rounded down to a multiple of 1 / `steps`.
///
/// # Errors
/// Returns an error if the frames do not fit.
#[expect(clippy::cast_precision_loss, reason = "frames are short")]
pub fn check_rate(rate: f64, bytes: usize, baud: u32, steps: f64) -> Result<()> {
    let (bits, baud) = ((bytes as u64 * BITS_PER_BYTE) as f64, f64::from(baud));
    let needed = (bits * rate).ceil();
    ensure!(
        needed <= baud,
        "{rate} frames of {bytes} bytes in a second need {needed} baud: raise --baud from {baud}, \
         or lower --rate to {} at most",
        (baud / bits * steps).floor() / steps
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEED: Seed = Seed { seed: 1, trial: 0 };

    /// Sends a million high bits and returns how many half bits arrive low.
    fn low_halves(parameters: &Parameters) -> usize {
        let mut noise = Noise::new(parameters, SEED);
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
            Noise::new(&Parameters::DEFAULT, SEED).quiet_until(0),
            u64::MAX
        );
    }

    #[test]
    fn faults_come_as_often_and_last_as_long_as_asked_for() {
        for (bit_flip, burst_rate, burst_length, expected) in [
            (0.01, 0.0, 1.0, 19_400..20_600),
            (1.0, 0.0, 1.0, 2_000_000..2_000_001),
            // 86.8 bursts are expected in a million bits. Each lasts for 57 bits, whose 114 half bits are high or low
            // at random.
            (0.0, 10.0, 0.5, 3_000..7_000),
            // The whole line is one burst.
            (0.0, 1e6, 1e5, 997_000..1_003_000),
        ] {
            let low = low_halves(&Parameters {
                bit_flip,
                burst_rate,
                burst_length,
                ..Parameters::DEFAULT
            });
            assert!(expected.contains(&low), "{low} not {expected:?}");
        }
    }

    #[test]
    fn frames_fit_up_to_the_last_bit_of_the_line() {
        // A frame takes 70 bits.
        for (fits, too_many, most) in [(96.0, 97.0, "96"), (95.95, 96.05, "96")] {
            assert!(check_rate(fits, 7, 6_720, 10.0).is_ok());
            let complaint = check_rate(too_many, 7, 6_720, 10.0);
            let complaint = complaint.map_err(|error| error.to_string());
            let expected = format!("lower --rate to {most} at most");
            assert!(complaint.is_err_and(|complaint| complaint.ends_with(&expected)));
        }
        let complaint = check_rate(68.0, 10, 6_725, 10.0).map_err(|error| error.to_string());
        assert!(complaint.is_err_and(|it| it.ends_with("lower --rate to 67.2 at most")));
    }
}
