//! The part of the RTIC example's interrupt handler that touches no registers.

use framelock::motion::{Bin, Setpoint};
use framelock::{Line, LineEvent, Receiver};

/// The length of a silence that ends a frame, in milliseconds. It is longer than the pauses that a USB serial adapter
/// inserts into a frame.
const IDLE: u32 = 5;

/// Number of bytes to drop after an error, because they may have been received before the error.
const IN_DOUBT: u8 = 8;

/// A receiver that gets single bytes.
pub struct Reception {
    line: Line<Receiver<Bin>>,
    /// The time of the last interrupt.
    heard: u32,
    /// The number of bytes still to drop.
    in_doubt: u8,
}

impl Reception {
    /// Creates a receiver.
    pub const fn new() -> Self {
        Self {
            line: Line::new(Receiver::new()),
            heard: 0,
            in_doubt: 0,
        }
    }

    /// Takes an error, a byte, or both, at the time `now`. Returns the setpoint of the frame that the byte completes.
    pub fn interrupt(
        &mut self,
        now: u32,
        error: Option<LineEvent>,
        byte: Option<u8>,
    ) -> Option<Setpoint> {
        if now.wrapping_sub(self.heard) >= IDLE {
            self.line.event(LineEvent::Idle);
            self.in_doubt = 0;
        }
        self.heard = now;
        if let Some(error) = error {
            self.line.event(error);
            self.in_doubt = IN_DOUBT;
        }
        let byte = byte?;
        if self.in_doubt > 0 {
            self.in_doubt -= 1;
            return None;
        }
        self.line.push(byte)
    }
}
