//! The answer of a contender. The answer is cheap to compute, and a wrong contender is unlikely to return the right
//! answer by chance.

use framelock::Found;
use framelock::motion::Setpoint;
use framelock_proofs::reference;

/// The number of frames, and a checksum of their setpoints and positions.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) struct Answer {
    count: u64,
    checksum: u64,
}

impl Answer {
    /// Adds a frame whose last byte is at `index`.
    #[inline]
    pub(crate) fn frame(&mut self, index: usize, setpoint: Setpoint) {
        let Setpoint { pitch, roll, yaw } = setpoint;
        let value = u32::from_le_bytes([pitch, roll, yaw, 0]);
        self.count += 1;
        // Multiply by the index, so that exchanging the setpoints of two frames changes the sum.
        let product = u64::from(value).wrapping_mul(index as u64);
        self.checksum = self.checksum.wrapping_add(product);
    }

    /// Adds the outcome of the next bytes. `behind` is the number of bytes before the new ones. This function adds the
    /// number of new bytes to `behind`.
    #[inline]
    pub(crate) fn found(&mut self, behind: &mut usize, found: Found<Setpoint>) {
        *behind += found.bytes();
        if let Found::Frame { message, .. } = found {
            self.frame(*behind - 1, message);
        }
    }

    /// Adds a byte at `index`, for a yardstick that only searches for bytes.
    #[inline]
    pub(crate) fn byte(&mut self, index: usize) {
        self.count += 1;
        self.checksum = self.checksum.wrapping_add(index as u64);
    }

    /// Returns the answer of the naive reference.
    pub(crate) fn of_reference<F: reference::NaiveFormat>(bytes: &[u8]) -> Self {
        let mut answer = Self::default();
        let mut behind = 0;
        reference::whole_buffer::<F>(bytes, |found| {
            answer.found(&mut behind, found.map(Setpoint::from));
        });
        answer
    }
}
