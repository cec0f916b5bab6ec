//! Theorem 8: after a line event no frame is committed that holds a byte from before it (L1). The event
//! leaves the machine as at reset, whatever was pending; so what comes after it is received as if
//! nothing had come before.

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8};
use framelock::{Found, Line, Receiver};

use crate::states::{OfSetpoints, any_lecture, any_line_event, any_receiver};

/// As at reset; and by its consequence: nothing is committed before a frame's length of bytes has come.
fn drops_what_is_pending<P: OfSetpoints>(parser: P, reset: P) {
    let mut line = Line::new(parser);
    let pending = line.pending();
    let mut told = 0;
    line.line_event(any_line_event(), |found| {
        assert!(told == 0 && !matches!(found, Found::Frame { .. }));
        told = found.bytes();
    });
    assert!(told == pending);
    let mut after = *line.parser();
    assert!(after == reset);
    let mut count = 1;
    while count < P::LENGTH {
        assert!(after.push(kani::any()).is_none());
        count += 1;
    }
    let committed = after.push(kani::any()).is_some();
    kani::cover!(
        committed && pending == P::LENGTH - 1,
        "a frame after the event"
    );
}

#[kani::proof]
#[kani::unwind(9)]
fn lecture() {
    drops_what_is_pending(any_lecture(), Lecture::new());
}

#[kani::proof]
#[kani::unwind(9)]
fn receiver_of_bin() {
    drops_what_is_pending(any_receiver::<Bin, 7>(), Receiver::new());
}

#[kani::proof]
#[kani::unwind(34)]
fn receiver_of_bin_crc8() {
    drops_what_is_pending(any_receiver::<BinCrc8, 8>(), Receiver::new());
}
