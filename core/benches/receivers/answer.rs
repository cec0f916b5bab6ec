//! What a contender finds, in a form that costs little to keep and is hard to get right by chance.

use framelock::Found;
use framelock::motion::Setpoint;
use framelock_proofs::reference;

/// How many frames there were, and a checksum of their setpoints and places.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) struct Answer {
    count: u64,
    checksum: u64,
}

impl Answer {
    /// A frame whose last byte is at `index`.
    #[inline]
    pub(crate) fn frame(&mut self, index: usize, setpoint: Setpoint) {
        let Setpoint { pitch, roll, yaw } = setpoint;
        let value = u32::from_le_bytes([pitch, roll, yaw, 0]);
        self.count += 1;
        // A product, so that two frames cannot exchange their setpoints unnoticed.
        let product = u64::from(value).wrapping_mul(index as u64);
        self.checksum = self.checksum.wrapping_add(product);
    }

    /// What became of the next bytes; `behind` is how many there were before them, and then with them.
    #[inline]
    pub(crate) fn found(&mut self, behind: &mut usize, found: Found<Setpoint>) {
        *behind += found.bytes();
        if let Found::Frame { message, .. } = found {
            self.frame(*behind - 1, message);
        }
    }

    /// A byte at `index`, for a yardstick that looks for bytes only.
    #[inline]
    pub(crate) fn byte(&mut self, index: usize) {
        self.count += 1;
        self.checksum = self.checksum.wrapping_add(index as u64);
    }

    /// The naive reference's.
    pub(crate) fn of_reference<F: reference::Format>(bytes: &[u8]) -> Self {
        let mut answer = Self::default();
        let mut behind = 0;
        reference::whole_buffer::<F>(bytes, |found| {
            answer.found(&mut behind, found.map(Setpoint::from));
        });
        answer
    }
}
