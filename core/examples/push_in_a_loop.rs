//! Takes bytes and prints setpoints. Reports pauses to the receiver. Without pauses, one lost byte can make the
//! receiver find frames at the wrong place for ever, if a repeated frame contains a carriage return followed by `AB`.
//!
//! `cargo run -p framelock --example push_in_a_loop`

use framelock::motion::{Bin, Setpoint};
use framelock::{LineEvent, Receiver};

/// The length of a silence that ends a frame, in milliseconds. It is longer than the pauses that a USB serial adapter
/// inserts into a frame.
const IDLE: u32 = 5;

/// Boot messages, a frame, a frame that lost a byte, and another frame. `_` is a pause.
const RECEIVED: &[u8] = b"boot\r\nAB\0\x10\x20\x30\r_AB\0\x11\x31\r_AB\0\x12\x22\x32\r";

pub(crate) struct Reception {
    receiver: Receiver<Bin>,
    /// The time of the last byte.
    heard: u32,
}

impl Reception {
    pub(crate) const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
            heard: 0,
        }
    }

    /// Performs one iteration of the loop, at the time `now`. `byte` is the next byte of the serial port, or `None` if
    /// no byte waits. Most ports, such as Arduino's `Serial`, report no line errors. If your port reports them, pass
    /// them to the receiver, too.
    pub(crate) fn iterate(&mut self, now: u32, byte: Option<u8>) -> Option<Setpoint> {
        if let Some(byte) = byte {
            self.heard = now;
            // With a frame's last byte, `push` returns all three demands together.
            return self.receiver.push(byte);
        }
        if self.receiver.pending() > 0 && now.wrapping_sub(self.heard) >= IDLE {
            self.receiver.line_event(LineEvent::Idle, |_| ());
        }
        None
    }
}

pub(crate) fn main() {
    let mut reception = Reception::new();
    let mut now = 0;
    // In firmware, loop for ever.
    for &byte in RECEIVED {
        let (byte, iterations) = match byte {
            b'_' => (None, 10),
            byte => (Some(byte), 1),
        };
        for _ in 0..iterations {
            if let Some(setpoint) = reception.iterate(now, byte) {
                println!("{setpoint}");
            }
            now += 1;
        }
    }
}

// It prints:
// pitch 16, roll 32, yaw 48
// pitch 18, roll 34, yaw 50
