//! Proves that receivers of fixed-length frames do the same in C and in Rust. Two states are *related* if they have the
//! same pending bytes and counters, and both or neither follow a loss. From any pair of related states, a byte and a
//! line event each have the same results in both languages: the message, and related next states.
//!
//! For six axes, the proofs cover only up to 13 pending bytes. With more pending bytes, the receivers differ: if the
//! first byte of the terminator is wrong, the Rust receiver rejects the frame immediately. The C receiver rejects the
//! frame one byte later, as a `BufferedReceiver` with the same layout does.

use core::ops::Range;

use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{
    Counters, Discarded, FixedFormat, FrameBytes, Line, LineEvent, LineEvents, Receiver,
};
use framelock_formats::motion::{SixAxes, SixAxesBigEndian};

unsafe extern "C" {
    safe fn c_hold(count: u8, is_lost: u8);
    safe fn c_hold_byte(place: u8, byte: u8);
    safe fn c_held_byte(place: u8) -> u8;
    safe fn c_is_lost() -> u8;
    safe fn c_push(byte: u8) -> u8;
    safe fn c_line_event(event: u8);
    safe fn c_pending() -> u32;
    safe fn c_value(place: u8) -> u32;
    safe fn c_counter(place: u8) -> u32;
}

/// The positions and values of a format's fixed bytes, except the last byte of the frame.
type Fixed = &'static [(u8, u8)];

/// Returns arbitrary bytes. The first `count` bytes agree with the fixed bytes, so they may become a frame.
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

/// Returns a Rust line in any state in which the first `count` bytes of `held` are pending, and puts the C receiver
/// into the related state. The Rust receiver's state also contains older bytes, which do not affect the receiver. All
/// counters are 0.
fn related<F: FixedFormat, const N: usize>(held: &[u8; N], count: u8) -> Line<Receiver<F>> {
    let mut history: [u8; N] = kani::any();
    let mut place = 0;
    while place < usize::from(count) {
        history[N - usize::from(count) + place] = held[place];
        place += 1;
    }
    let since = kani::any_where(|&since| usize::from(count) <= since && since < N);
    let receiver = Receiver::holding(&history, since, kani::any());
    kani::assume(receiver.pending() == usize::from(count));
    let mut place = 0;
    while place < count {
        c_hold_byte(place, held[usize::from(place)]);
        place += 1;
    }
    let is_lost: bool = kani::any();
    c_hold(count, u8::from(is_lost));
    let line = Line::new(receiver);
    if is_lost { line.after_loss() } else { line }
}

/// Checks that both receivers have the same counters and the same pending bytes after this stream. The Rust receiver's
/// pending bytes are always the last bytes of the stream (theorem 4).
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
    assert!(line.is_after_loss() == (c_is_lost() != 0));
    let counters = counters(line.counters());
    let mut place = 0;
    while place < counters.len() {
        assert!(counters[place] == c_counter(place.to_le_bytes()[0]));
        place += 1;
    }
}

/// Returns all counters except `broken_stuffing`, which only packets need, in the order of the C files.
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

/// The line events, in the order of their numbers in C.
pub(crate) const LINE_EVENTS: [LineEvent; 5] = [
    LineEvent::Framing,
    LineEvent::Parity,
    LineEvent::Overrun,
    LineEvent::Break,
    LineEvent::Idle,
];

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

fn event_is_same<F: FixedFormat, const N: usize>(fixed: Fixed, count: u8, event: u8) {
    let stream = any_beginning::<N>(fixed, count);
    let mut line = related::<F, N>(&stream, count);
    line.line_event(LINE_EVENTS[usize::from(event)], |_| ());
    c_line_event(event);
    are_related(&line, &stream, count, fixed);
    kani::cover!(
        c_counter(16) == u32::from(count),
        "the pending bytes are discarded"
    );
}

fn of_setpoint(message: Setpoint) -> [u16; 3] {
    [message.pitch, message.roll, message.yaw].map(u16::from)
}

/// Calls `step` with one of these numbers, which the prover chooses. The loop does not compare `number` with an
/// arbitrary number, because the compiler might then pass the arbitrary number to `step`. So the number is a constant
/// in each call.
fn for_any(numbers: Range<u8>, step: impl Fn(u8)) {
    let mut number = numbers.start;
    while number < numbers.end {
        if kani::any() {
            step(number);
            return;
        }
        number += 1;
    }
}

/// Defines the harnesses of each format. Each entry states the length of a frame, the bound on the loops, the possible
/// numbers of pending bytes, the fixed bytes, and how to convert a message to its values.
macro_rules! for_formats {
    ($($name:ident $format:ident $length:literal $bound:literal $counts:expr, $fixed:expr, $values:expr;)*) => {
        $(
            mod $name {
                use super::*;

                #[kani::proof]
                #[kani::unwind($bound)]
                fn byte_is_same() {
                    for_any($counts, |count| {
                        super::byte_is_same::<$format, $length, _>(&$fixed, $values, count);
                    });
                }

                #[kani::proof]
                #[kani::unwind($bound)]
                fn event_is_same() {
                    for_any($counts, |count| for_any(0..5, |event| {
                        super::event_is_same::<$format, $length>(&$fixed, count, event);
                    }));
                }
            }
        )*
    };
}
for_formats! {
    bin Bin 7 19 0..7, [(0, b'A'), (1, b'B')], of_setpoint;
    bin_crc8 BinCrc8 8 34 0..8, [(0, b'A'), (1, b'B')], of_setpoint;
    six_axes SixAxes 16 19 0..14, [(0, 0xFF), (1, 0xFF), (14, b'\n')], |axes| axes;
    six_axes_be SixAxesBigEndian 16 19 0..14, [(0, 0xFF), (1, 0xFF), (14, b'\n')], |axes| axes;
}
