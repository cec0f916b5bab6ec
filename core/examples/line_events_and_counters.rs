//! Counts the outcome of every byte, and reports errors and pauses of the line to the receiver.
//!
//! `cargo run -p framelock --example line_events_and_counters`

use framelock::motion::{Bin, Setpoint};
use framelock::{Line, LineEvent, Receiver};

/// The silence that counts as an idle gap, in microseconds.
const IDLE: u32 = 5_000;

/// Returns the time and the cause of each UART interrupt. In the stream, `?` is a byte without a stop bit, and `_` is a
/// pause.
fn interrupts() -> impl Iterator<Item = (u32, Result<u8, LineEvent>)> {
    let mut now: u32 = 0;
    let line = b"AB\0abc\rAB\0a?c\rAB\0ab_AB\0def\r";
    line.iter().filter_map(move |&byte| {
        now += if byte == b'_' { 9_000 } else { 87 };
        match byte {
            b'_' => None,
            b'?' => Some((now, Err(LineEvent::Framing))),
            _ => Some((now, Ok(byte))),
        }
    })
}

/// Handles an interrupt at the time `now`: a byte, or an error instead of a byte. `heard` is the time of the previous
/// interrupt. No frame contains bytes from both before and after a line event.
pub(crate) fn interrupt(
    line: &mut Line<Receiver<Bin>>,
    heard: &mut u32,
    now: u32,
    found: Result<u8, LineEvent>,
) -> Option<Setpoint> {
    if now.wrapping_sub(*heard) >= IDLE {
        line.event(LineEvent::Idle);
    }
    *heard = now;
    match found {
        Ok(byte) => line.push(byte),
        Err(event) => {
            line.event(event);
            None
        }
    }
}

pub(crate) fn main() {
    let mut line = Line::new(Receiver::new());
    let mut heard = 0;
    for (now, found) in interrupts() {
        if let Some(setpoint) = interrupt(&mut line, &mut heard, now, found) {
            println!("{setpoint}");
        }
    }
    let counted = line.counters();
    println!("{} bytes, {} in frames", counted.bytes, counted.frame_bytes);
    println!("{:?}", counted.discarded);
    println!("{:?}", counted.events);
}

// It prints:
// pitch 97, roll 98, yaw 99
// pitch 100, roll 101, yaw 102
// 25 bytes, 14 in frames
// Discarded { no_sync: 2, broken_sync: 0, bad_header: 0, too_long: 0, unknown_message: 0, checksum_mismatch: 0, wrong_terminator: 0, broken_stuffing: 0, line_event: 9 }
// LineEvents { framing: 1, parity: 0, overrun: 0, line_break: 0, idle: 1 }
