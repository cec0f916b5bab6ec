//! The part of the RP2040 example's reception that touches no registers.

use framelock::motion::{Bin, Setpoint};
use framelock::{Line, LineEvent, Receiver};

/// Takes the bytes of a read, or an error, or a pause. Calls `frame` with each setpoint.
pub fn take(
    line: &mut Line<Receiver<Bin>>,
    read: Result<&[u8], LineEvent>,
    frame: impl FnMut(Setpoint),
) {
    match read {
        Ok(bytes) => line.messages(bytes).for_each(frame),
        Err(event) => line.event(event),
    }
}
