//! Smooth pitch, roll and yaw from one random point to the next, as a motion PC sends them.

use framelock::Setpoint;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::setpoints::LEVEL;

/// The motion. Time is counted in frames: ask for each slot in turn.
#[derive(Debug)]
pub(crate) struct SmoothMotion {
    random: ChaCha8Rng,
    leg: Leg,
    slots_per_leg: u64,
}

/// From one point to another, starting and ending at rest.
#[derive(Clone, Copy, Debug)]
struct Leg {
    from: Setpoint,
    to: Setpoint,
    begin: u64,
    length: u64,
}

impl SmoothMotion {
    /// Starts at level. The next point is reached after so many slots.
    pub(crate) fn new(random: ChaCha8Rng, slots_per_leg: u64) -> Self {
        Self {
            random,
            leg: Leg {
                from: LEVEL,
                to: LEVEL,
                begin: 0,
                length: 0,
            },
            slots_per_leg,
        }
    }

    /// Where it is in the slot, if it goes where it is going already.
    pub(crate) fn here(&self, slot: u64) -> Setpoint {
        self.leg.at(slot)
    }

    /// Where it is in the slot; where a leg has ended the next begins.
    pub(crate) fn setpoint(&mut self, slot: u64) -> Setpoint {
        if slot >= self.leg.begin + self.leg.length {
            let to = [(); 3]
                .map(|()| self.random.random_range(0x28..=0xD8))
                .into();
            self.go(slot, to, self.slots_per_leg);
        }
        self.here(slot)
    }

    /// Leaves for `to`, which is reached after so many slots.
    pub(crate) fn go(&mut self, slot: u64, to: Setpoint, slots: u64) {
        self.leg = Leg {
            from: self.here(slot),
            to,
            begin: slot,
            length: slots,
        };
    }
}

impl Leg {
    /// Whole numbers only, so that it is the same on every computer.
    fn at(self, slot: u64) -> Setpoint {
        const BITS: u32 = 10;
        const ONE: u64 = 1 << BITS;
        const CUBE: u64 = 1 << (3 * BITS);
        let elapsed = (slot - self.begin).min(self.length);
        let part = (elapsed * ONE).checked_div(self.length).unwrap_or(ONE);
        // 3x^2 - 2x^3: flat at both ends.
        let weight = part * part * (3 * ONE - 2 * part);
        let mut axes = <[u8; 3]>::from(self.from);
        for (axis, to) in axes.iter_mut().zip(<[u8; 3]>::from(self.to)) {
            let sum = u64::from(*axis) * (CUBE - weight) + u64::from(to) * weight;
            *axis = ((sum + CUBE / 2) >> (3 * BITS)).to_le_bytes()[0];
        }
        axes.into()
    }
}
