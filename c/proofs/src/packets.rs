//! Proves that receivers of packets do the same in C and in Rust. Both receivers take the same six items. Each item is
//! any byte or any line event. After each item, both receivers have delivered the same packet or none, and have the
//! same counters and the same number of pending bytes. The packets have up to three bytes.

use framelock::{Format, Line, PacketReceiver};
use framelock_formats::packet::{Cobs, Slip};

use crate::windows::{LINE_EVENTS, counters};

unsafe extern "C" {
    safe fn c_push(byte: u8) -> u8;
    safe fn c_line_event(event: u8);
    safe fn c_frame_length() -> u8;
    safe fn c_frame_byte(place: u8) -> u8;
    safe fn c_pending() -> u32;
    safe fn c_counter(place: u8) -> u32;
}

/// The number of bytes and line events in a stream.
const STEPS: usize = 6;

/// Defines the harness of a format, in a module with the name of its C file.
macro_rules! for_formats {
    ($($name:ident $format:ty;)*) => {
        $(
            mod $name {
                use super::*;

                type Receiver = PacketReceiver<$format, [u8; <$format>::LONGEST]>;

                #[kani::proof]
                #[kani::unwind(7)]
                fn stream_is_same() {
                    let mut line = Line::new(Receiver::new(Default::default()));
                    let mut step = 0;
                    while step < STEPS {
                        take_step(&mut line);
                        step += 1;
                    }
                    kani::cover!(line.counters().frames == 1, "a packet");
                    kani::cover!(line.counters().discarded.broken_stuffing > 0, "broken stuffing");
                    kani::cover!(line.counters().discarded.too_long > 0, "a packet that is too long");
                }

                /// Takes an arbitrary byte or line event, and compares the receivers.
                fn take_step(line: &mut Line<Receiver>) {
                    if kani::any() {
                        let byte = kani::any();
                        let is_frame_in_c = c_push(byte) != 0;
                        let frame = line.push(byte).map(|frame| frame.message());
                        assert!(frame.is_some() == is_frame_in_c);
                        if let Some(frame) = frame {
                            assert!(frame.len() == usize::from(c_frame_length()));
                            let place = kani::any::<u8>();
                            if usize::from(place) < frame.len() {
                                assert!(frame[usize::from(place)] == c_frame_byte(place));
                            }
                        }
                    } else {
                        let event: u8 = kani::any_where(|event| *event < 5);
                        c_line_event(event);
                        line.line_event(LINE_EVENTS[usize::from(event)], |_| ());
                    }
                    assert!(line.pending() == c_pending() as usize);
                    let counters = counters(line.counters());
                    let which = kani::any::<u8>();
                    if usize::from(which) < counters.len() {
                        assert!(counters[usize::from(which)] == c_counter(which));
                    }
                    assert!(line.counters().discarded.broken_stuffing == c_counter(17));
                }
            }
        )*
    };
}
for_formats! {
    slip Slip<3>;
    cobs Cobs<3>;
}
