//! Theorem 8: after a line event no frame is delivered that contains a byte from before the event (L1). Whatever bytes
//! are pending, the event leaves the machine in its state at reset. So the machine treats the bytes after the event as
//! if no byte had come before.

use framelock::any_format::any_line_event;
use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8};
use framelock::{Found, Line, Receiver};

use crate::states::{OfSetpoints, any_lecture, any_receiver};

/// Checks that a line event leaves the machine in its state at reset. Also checks a consequence: the machine delivers
/// nothing as long as fewer bytes have come after the event than a frame has.
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
