//! Faults of a serial line, repeatable by their seed.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::line::Symbol;

/// How often what goes wrong, per byte, from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fault {
    /// The byte does not arrive.
    pub drop: f64,
    /// A random byte arrives before it.
    pub insert: f64,
    /// One of its bits is inverted.
    pub flip: f64,
    /// Its stop bit is low: a framing error.
    pub framing: f64,
    /// Its parity bit is wrong; without parity, nothing.
    pub parity: f64,
    /// A break comes before it, of 12 to 40 bits.
    pub line_break: f64,
    /// A pause comes before it, of 10 to 100 bits.
    pub pause: f64,
}

/// Puts faults between a sender and the line.
#[derive(Clone, Debug)]
pub struct Faults {
    fault: Fault,
    random: ChaCha8Rng,
    injected: u64,
}

impl Faults {
    /// The same seed gives the same faults.
    #[must_use]
    pub fn new(fault: Fault, seed: u64) -> Self {
        Self {
            fault,
            random: ChaCha8Rng::seed_from_u64(seed),
            injected: 0,
        }
    }

    /// How many faults there were so far.
    #[must_use]
    pub fn injected(&self) -> u64 {
        self.injected
    }

    fn happens(&mut self, probability: f64) -> bool {
        let happens = probability > 0.0 && self.random.random::<f64>() < probability;
        self.injected += u64::from(happens);
        happens
    }

    /// What comes onto the line in place of these bytes.
    pub fn symbols(&mut self, bytes: &[u8]) -> Vec<Symbol> {
        let fault = self.fault;
        let mut symbols = Vec::with_capacity(bytes.len());
        for byte in bytes {
            if self.happens(fault.line_break) {
                symbols.push(Symbol::Break(self.random.random_range(12..=40)));
            }
            if self.happens(fault.pause) {
                symbols.push(Symbol::Idle(self.random.random_range(10..=100)));
            }
            if self.happens(fault.insert) {
                symbols.push(Symbol::Byte(self.random.random()));
            }
            if self.happens(fault.drop) {
                continue;
            }
            let mut byte = *byte;
            if self.happens(fault.flip) {
                byte ^= 1 << self.random.random_range(0..8);
            }
            symbols.push(if self.happens(fault.framing) {
                Symbol::BadStop(byte)
            } else if self.happens(fault.parity) {
                Symbol::BadParity(byte)
            } else {
                Symbol::Byte(byte)
            });
        }
        symbols
    }
}
