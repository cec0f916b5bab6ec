//! Takes bytes and prints setpoints.
//!
//! `cargo run -p framelock-examples --bin push_in_a_loop`

use framelock::Receiver;
use framelock::motion::Bin;

/// Boot messages, a frame, a frame that lost a byte, and another frame.
const RECEIVED: &[u8] = b"boot\r\nAB\0\x10\x20\x30\rAB\0\x11\x31\rAB\0\x12\x22\x32\r";

pub(crate) fn main() {
    let mut receiver = Receiver::<Bin>::new();
    // In firmware, loop while the serial port has a byte.
    for &byte in RECEIVED {
        // All three demands arrive together, with the frame's last byte.
        if let Some(setpoint) = receiver.push(byte) {
            println!("{setpoint}");
        }
    }
}

// It prints:
// pitch 16, roll 32, yaw 48
// pitch 18, roll 34, yaw 50
