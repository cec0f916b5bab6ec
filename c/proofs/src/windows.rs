//! Frames of one length: from any pair of related states, a byte and a line event have the same result in C and in Rust.
//! The message, each counter, the pending bytes, and the state afterwards are the same.
//!
//! Six axes: up to 13 pending bytes. If the first byte of the terminator is wrong, the Rust receiver notices at once, but the
//! receiver in C, like a layout in Rust, notices one byte later.

use core::ops::Range;

use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{
    Counters, Discarded, FixedFormat, FrameBytes, Line, LineEvent, LineEvents, Receiver,
};
use framelock_formats::motion::{SixAxes, SixAxesBigEndian};

unsafe extern "C" {
    safe fn c_hold(count: u8);
    safe fn c_hold_byte(place: u8, byte: u8);
    safe fn c_held_byte(place: u8) -> u8;
    safe fn c_is_lost() -> u8;
    safe fn c_push(byte: u8) -> u8;
    safe fn c_line_event(event: u8);
    safe fn c_pending() -> u32;
    safe fn c_value(place: u8) -> u32;
    safe fn c_counter(place: u8) -> u32;
}

/// The fixed bytes of a format and their places, without the last byte of a frame.
type Fixed = &'static [(u8, u8)];

/// Returns any bytes of which the first `count` may become a frame, because the fixed bytes are among them.
fn any_beginning<const N: usize>(fixed: Fixed, count: u8) -> [u8; N] {
    let mut bytes: [u8; N] = kani::any();
    let mut next = 0;
    while next < fixed.len() {
        let (place, byte) = fixed[next];
        if place < count {
            bytes[usize::from(place)] = byte;
        }
        next += 1;
    }
    bytes
}

/// Returns a line, and puts the receiver in C into the related state: these bytes are pending, and bytes have been
/// discarded before them, or none. The window of the Rust receiver also holds older bytes, which cannot begin a frame: here
/// at most one.
fn related<F: FixedFormat, const N: usize>(held: &[u8; N], count: u8) -> Line<Receiver<F>> {
    let mut line = Line::new(Receiver::new());
    if kani::any() {
        line.push(0);
        c_push(0);
    }
    let mut place = 0;
    while place < count {
        line.push(held[usize::from(place)]);
        c_hold_byte(place, held[usize::from(place)]);
        place += 1;
    }
    assert!(line.pending() == usize::from(count));
    c_hold(count);
    line
}

/// Checks that both have the same counters and pending bytes after this stream. The bytes that are pending in Rust are
/// always the last ones of the stream (theorem 4).
fn are_related<F: FixedFormat, const N: usize>(
    line: &Line<Receiver<F>>,
    stream: &[u8; N],
    length: u8,
    fixed: Fixed,
) {
    let pending = c_pending().to_le_bytes()[0];
    assert!(line.pending() == usize::from(pending) && pending <= length);
    let mut place = 0;
    while place < N {
        if place < usize::from(pending) {
            let held = c_held_byte(place.to_le_bytes()[0]);
            assert!(held == stream[usize::from(length - pending) + place]);
        }
        place += 1;
    }
    let mut next = 0;
    while next < fixed.len() {
        let (place, byte) = fixed[next];
        assert!(place >= pending || c_held_byte(place) == byte);
        next += 1;
    }
    let counters = counters(line.counters());
    let mut place = 0;
    while place < counters.len() {
        assert!(counters[place] == c_counter(place.to_le_bytes()[0]));
        place += 1;
    }
}

/// Returns all counters, in the order that the files in C have.
pub(crate) fn counters(counters: &Counters) -> [u32; 17] {
    let Counters {
        bytes,
        frames,
        frame_bytes,
        resynchronisations,
        events,
        discarded,
        ..
    } = *counters;
    let LineEvents {
        framing,
        parity,
        overrun,
        line_break,
        idle,
        ..
    } = events;
    let Discarded {
        no_sync,
        broken_sync,
        bad_header,
        too_long,
        unknown_message,
        checksum_mismatch,
        wrong_terminator,
        line_event,
        ..
    } = discarded;
    [
        bytes,
        frames,
        frame_bytes,
        resynchronisations,
        framing,
        parity,
        overrun,
        line_break,
        idle,
        no_sync,
        broken_sync,
        bad_header,
        too_long,
        unknown_message,
        checksum_mismatch,
        wrong_terminator,
        line_event,
    ]
}

/// Returns any line event, and its number in C.
pub(crate) fn any_line_event() -> (LineEvent, u8) {
    match kani::any::<u8>() {
        0 => (LineEvent::Framing, 0),
        1 => (LineEvent::Parity, 1),
        2 => (LineEvent::Overrun, 2),
        3 => (LineEvent::Break, 3),
        _ => (LineEvent::Idle, 4),
    }
}

fn byte_is_same<F: FixedFormat<Frame = [u8; N]>, const N: usize, const VALUES: usize>(
    fixed: Fixed,
    values: impl Fn(F::Message) -> [u16; VALUES],
    count: u8,
) where
    [u8; N]: FrameBytes,
{
    let mut stream = any_beginning::<N>(fixed, count);
    let mut line = related::<F, N>(&stream, count);
    let byte = kani::any();
    stream[usize::from(count)] = byte;
    let message = line.push(byte);
    assert!(message.is_some() == (c_push(byte) != 0));
    let is_frame = message.is_some();
    if let Some(message) = message {
        let values = values(message);
        let mut place = 0;
        while place < VALUES {
            assert!(u32::from(values[place]) == c_value(place.to_le_bytes()[0]));
            place += 1;
        }
    }
    are_related(&line, &stream, count + 1, fixed);
    let is_last = usize::from(count) == N - 1;
    kani::cover!(
        line.pending() == usize::from(count) + 1,
        "the bytes may become a frame"
    );
    kani::cover!(
        is_frame == is_last && c_is_lost() != u8::from(is_last),
        "a frame, if the byte can be its last"
    );
}

fn event_is_same<F: FixedFormat, const N: usize>(fixed: Fixed, count: u8) {
    let stream = any_beginning::<N>(fixed, count);
    let mut line = related::<F, N>(&stream, count);
    let (event, number) = any_line_event();
    line.line_event(event, |_| ());
    c_line_event(number);
    are_related(&line, &stream, count, fixed);
    // The next frame shows whether the loss is remembered.
    assert!((c_is_lost() != 0) == (c_counter(9) + c_counter(16) > 0));
    kani::cover!(
        c_counter(16) == u32::from(count),
        "the pending bytes are discarded"
    );
}

fn of_setpoint(message: Setpoint) -> [u16; 3] {
    [message.pitch, message.roll, message.yaw].map(u16::from)
}

/// Runs a step for each number of pending bytes in a range, of which any is chosen. So the number is known to the prover.
fn for_any_count(counts: Range<u8>, step: impl Fn(u8)) {
    let chosen: u8 = kani::any_where(|chosen| counts.contains(chosen));
    let mut count = counts.start;
    while count < counts.end {
        if count == chosen {
            step(count);
            return;
        }
        count += 1;
    }
}

/// Defines the harnesses of a format, for each of these ranges of pending bytes.
macro_rules! for_formats {
    ($($name:ident $format:ident $length:literal $bound:literal $fixed:expr, $values:expr; $($of:ident $counts:expr),*;)*) => {
        $(
            mod $name {
                $(
                    mod $of {
                        use crate::windows::*;

                        #[kani::proof]
                        #[kani::unwind($bound)]
                        fn byte_is_same() {
                            for_any_count($counts, |count| {
                                crate::windows::byte_is_same::<$format, $length, _>(&$fixed, $values, count);
                            });
                        }

                        #[kani::proof]
                        #[kani::unwind($bound)]
                        fn event_is_same() {
                            for_any_count($counts, |count| {
                                crate::windows::event_is_same::<$format, $length>(&$fixed, count);
                            });
                        }
                    }
                )*
            }
        )*
    };
}
for_formats! {
    bin Bin 7 19 [(0, b'A'), (1, b'B')], of_setpoint;
        all 0..7;
    bin_crc8 BinCrc8 8 34 [(0, b'A'), (1, b'B')], of_setpoint;
        first 0..4, second 4..8;
    six_axes SixAxes 16 19 [(0, 0xFF), (1, 0xFF), (14, b'\n')], |axes| axes;
        first 0..4, second 4..8, third 8..12, fourth 12..13, fifth 13..14;
    six_axes_be SixAxesBigEndian 16 19 [(0, 0xFF), (1, 0xFF), (14, b'\n')], |axes| axes;
        first 0..4, second 4..8, third 8..12, fourth 12..13, fifth 13..14;
}
