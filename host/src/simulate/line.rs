//! The sender's end of the line: characters, bit by bit, with the sender's own clock.
//!
//! What comes out at the other end is what the [`Uart`] makes of the levels. The emulator of the
//! firmware has a line of its own: that one is exact to a cycle of the chip and samples each bit
//! once; this one is for millions of characters, and votes as a UART does.

use super::noise::Noise;
use super::uart::{BIT, BITS_PER_BYTE, Heard, Uart};

/// The line, with the noise on it and the receiving UART at its end.
#[derive(Debug)]
pub(super) struct Line {
    uart: Uart,
    noise: Noise,
    /// A bit of the sender's, in time steps.
    bit: u64,
    /// When the sender's bit 0 begins: the clocks know nothing of each other.
    phase: u64,
    /// Bits sent.
    sent: u64,
}

impl Line {
    /// `baud_error`: by how many per cent the sender is faster than the receiver. `phase`: less
    /// than a tick.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "between half a bit and two"
    )]
    pub(super) fn new(noise: Noise, baud_error: f64, phase: u64) -> Self {
        let mut uart = Uart::new();
        uart.advance(true, phase, &mut |_| ());
        Self {
            uart,
            noise,
            bit: (BIT as f64 / (1.0 + baud_error / 100.0)).round() as u64,
            phase,
            sent: 0,
        }
    }

    /// When all that was sent so far has been.
    pub(super) fn now(&self) -> u64 {
        self.instant(self.sent)
    }

    /// When a byte would have been sent if it began now.
    pub(super) fn byte_end(&self) -> u64 {
        self.instant(self.sent + BITS_PER_BYTE)
    }

    fn instant(&self, bit: u64) -> u64 {
        self.phase + bit * self.bit
    }

    /// Nothing is sent until so many bits have been in all.
    pub(super) fn idle_until(&mut self, bit: u64, heard: &mut impl FnMut(Heard)) {
        while self.sent < bit {
            let quiet = self.noise.quiet_until(self.sent).min(bit);
            if quiet == self.sent {
                self.send_bit(true, heard);
            } else {
                self.uart.advance(true, self.instant(quiet), heard);
                self.sent = quiet;
            }
        }
    }

    /// Bits sent, idle ones included.
    pub(super) fn bits_sent(&self) -> u64 {
        self.sent
    }

    /// Sends a byte.
    pub(super) fn send(&mut self, byte: u8, heard: &mut impl FnMut(Heard)) {
        let behind = self.sent + BITS_PER_BYTE;
        if self.noise.quiet_until(self.sent) < behind {
            for bit in character(byte) {
                self.send_bit(bit, heard);
            }
            return;
        }
        if !self.uart.take_whole(byte, self.now(), self.bit, heard) {
            for (number, bit) in (self.sent + 1..).zip(character(byte)) {
                self.uart.advance(bit, self.instant(number), heard);
            }
        }
        self.sent = behind;
    }

    fn send_bit(&mut self, level: bool, heard: &mut impl FnMut(Heard)) {
        let [first, second] = self.noise.disturbed(self.sent, level);
        let middle = self.now() + self.bit / 2;
        self.sent += 1;
        self.uart.advance(first, middle, heard);
        self.uart.advance(second, self.now(), heard);
    }
}

/// The levels of a character: low, the bits from the lowest on, high.
fn character(byte: u8) -> impl Iterator<Item = bool> {
    let levels = 1 << (BITS_PER_BYTE - 1) | u16::from(byte) << 1;
    (0..BITS_PER_BYTE).map(move |bit| levels >> bit & 1 == 1)
}
