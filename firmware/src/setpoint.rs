//! The current setpoint, from the receive handler to the main loop.

use core::sync::atomic::{AtomicU32, Ordering};

use framelock::motion::Setpoint;

/// Pitch, roll, yaw, as they lie in a frame, and a sequence number. One word, so that it is read and
/// written by one instruction each and never torn. Written by the receive handler only.
///
/// No test looks for a torn one: the main loop cannot run in the middle of the handler, so it could
/// see one only if it read the word in parts, and the type leaves no way to.
#[unsafe(no_mangle)]
static SETPOINT: AtomicU32 = AtomicU32::new(0);

/// A setpoint as it was published.
///
/// The sequence number tells a repeated setpoint from silence. It would take 256 frames between two
/// looks at it to deceive; at 1 Mbaud these take 17 ms, and the main loop looks every few.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Published(u32);

impl Published {
    /// The current one.
    pub(crate) fn now() -> Self {
        Self(SETPOINT.load(Ordering::Relaxed))
    }

    pub(crate) fn setpoint(self) -> Setpoint {
        let [pitch, roll, yaw, _sequence] = self.0.to_le_bytes();
        Setpoint { pitch, roll, yaw }
    }
}

/// Makes it the current one, with the next sequence number.
pub(crate) fn publish(Setpoint { pitch, roll, yaw }: Setpoint) {
    let [.., sequence] = Published::now().0.to_le_bytes();
    let setpoint = u32::from_le_bytes([pitch, roll, yaw, sequence.wrapping_add(1)]);
    SETPOINT.store(setpoint, Ordering::Relaxed);
}
