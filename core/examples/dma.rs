//! Receives from a DMA that writes into a circular buffer.
//!
//! `cargo run -p framelock --example dma`
//!
//! In firmware, a timer's interrupt calls `receive` every millisecond. The interrupts for an idle line, for half a
//! buffer and for errors may call it too, at any time, if all these interrupts have the same priority. `receive` reads
//! the DMA's position once and takes the bytes before this position. It reports a pause only if the position has not
//! changed for the time `PAUSE`. An idle interrupt alone does not prove a pause: if the interrupt is late, new bytes
//! may already have arrived.

use std::sync::atomic::{AtomicU8, Ordering::Relaxed};

use framelock::motion::{Bin, Setpoint};
use framelock::{Found, Line, LineEvent, Parser, Receiver};

/// The size of the DMA's buffer in bytes. At 115 200 baud, the buffer fills in 22 ms.
pub(crate) const SIZE: usize = 256;

/// The longest time between two calls of `receive`, in microseconds: half of the time in which the buffer fills.
const LATEST: u32 = 11_000;

/// The silence that ends a frame, in microseconds. It must be longer than the longest pause inside a frame and the time
/// of a byte together.
const PAUSE: u32 = 5_000;

/// The hardware: a timer, and a UART with its DMA.
pub(crate) trait Serial {
    /// Returns the count of a free-running timer, in microseconds.
    fn now(&self) -> u32;
    /// Returns the index to which the DMA writes next.
    fn position(&self) -> usize;
    /// Returns true if the UART has reported an error. The last byte before the position is then corrupted.
    fn has_error(&self) -> bool;
    /// Clears the error. If the DMA has stopped, starts it again and returns true: its position is then 0.
    fn restart(&self) -> bool;
}

/// A receiver, and how far it has read.
pub(crate) struct Reception<P: Parser> {
    pub(crate) line: Line<P>,
    /// The index of the first byte that the receiver has not taken.
    taken: usize,
    /// The time of the last call of `receive`.
    called: u32,
    /// The time of the last call that found a new position, or that came too late.
    changed: u32,
}

impl<P: Parser> Reception<P> {
    pub(crate) fn new(parser: P, now: u32) -> Self {
        Self {
            line: Line::new(parser),
            taken: 0,
            called: now,
            changed: now,
        }
    }

    /// Takes the bytes that have arrived. Reports the frames and the discarded bytes to `found`.
    pub(crate) fn receive(
        &mut self,
        serial: &impl Serial,
        buffer: &[AtomicU8; SIZE],
        mut found: impl FnMut(Found<P::Message<'_>>),
    ) {
        let has_error = serial.has_error();
        let before = serial.now();
        // Read once: bytes that arrive from now on wait for the next call.
        let position = serial.position();
        let after = serial.now();
        let arrived = (position + SIZE - self.taken) % SIZE;
        let intact = arrived.saturating_sub(usize::from(has_error));
        if after.wrapping_sub(self.called) > LATEST {
            self.changed = after;
            // The DMA may have overwritten bytes.
            self.line.line_event(LineEvent::Overrun, &mut found);
        } else if arrived > 0 {
            self.changed = after;
            for byte in buffer.iter().cycle().skip(self.taken).take(intact) {
                self.line.feed(&[byte.load(Relaxed)], &mut found);
            }
        } else if before.wrapping_sub(self.changed) >= PAUSE && self.line.pending() > 0 {
            self.line.line_event(LineEvent::Idle, &mut found);
        }
        self.taken = position;
        self.called = before;
        if has_error {
            self.line.line_event(LineEvent::Framing, &mut found);
            if serial.restart() {
                self.taken = 0;
            }
        }
    }
}

/// The state of the simulated hardware before one call.
struct Simulated {
    now: u32,
    position: usize,
    has_error: bool,
}

impl Serial for Simulated {
    fn now(&self) -> u32 {
        self.now
    }

    fn position(&self) -> usize {
        self.position
    }

    fn has_error(&self) -> bool {
        self.has_error
    }

    fn restart(&self) -> bool {
        false
    }
}

pub(crate) fn main() {
    let buffer = [const { AtomicU8::new(0) }; SIZE];
    let mut reception = Reception::new(Receiver::<Bin>::new(), 0);
    let mut position = 0;
    // In the stream, `?` is a corrupted byte, and `_` is a pause. The program calls `receive` after each part.
    let parts = ["AB\0abc\rAB", "\0def\r", "AB\0gh?", "AB\0ijk\rAB\0l", "_"];
    let mut serial = Simulated {
        now: 0,
        position,
        has_error: false,
    };
    for part in parts.into_iter().chain(["mn\rAB\0opq\r"]) {
        if part == "_" {
            serial.now += 6_000;
        } else {
            for byte in part.bytes() {
                if let Some(place) = buffer.get(position) {
                    place.store(byte, Relaxed);
                }
                position = (position + 1) % SIZE;
                serial.now += 87;
            }
        }
        serial.position = position;
        serial.has_error = part.ends_with('?');
        reception.receive(&serial, &buffer, |found| {
            if let Some(setpoint) = found.message() {
                let setpoint: Setpoint = setpoint;
                println!("{setpoint}");
            }
        });
    }
    println!("{:?}", reception.line.counters().events);
}

// It prints:
// pitch 97, roll 98, yaw 99
// pitch 100, roll 101, yaw 102
// pitch 105, roll 106, yaw 107
// pitch 111, roll 112, yaw 113
// LineEvents { framing: 1, parity: 0, overrun: 0, line_break: 0, idle: 1 }
