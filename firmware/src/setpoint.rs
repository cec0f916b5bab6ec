//! The current setpoint, which the receive handler passes to the main loop.

use core::sync::atomic::{AtomicU32, Ordering};

use framelock::motion::Setpoint;

/// Pitch, roll and yaw as in a frame, followed by a sequence number. All four share one word, which single instructions
/// read and write. So a reader never sees a torn setpoint, which consists of parts of two setpoints. Only the receive
/// handler writes the word.
///
/// No test looks for a torn setpoint.
#[unsafe(no_mangle)]
static SETPOINT: AtomicU32 = AtomicU32::new(0);

/// A setpoint as it was published.
///
/// The sequence number distinguishes a repeated setpoint from silence. This would fail only if a multiple of 256 frames
/// arrived between two reads. At 1 Mbaud, 256 frames take about 18 ms, and the main loop reads the setpoint every 2 ms.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Published(u32);

impl Published {
    /// Returns the current setpoint.
    pub(crate) fn now() -> Self {
        Self(SETPOINT.load(Ordering::Relaxed))
    }

    pub(crate) fn setpoint(self) -> Setpoint {
        let [pitch, roll, yaw, _sequence] = self.0.to_le_bytes();
        Setpoint { pitch, roll, yaw }
    }
}

/// Makes this setpoint the current one, with the next sequence number.
pub(crate) fn publish(Setpoint { pitch, roll, yaw }: Setpoint) {
    let [.., sequence] = Published::now().0.to_le_bytes();
    let setpoint = u32::from_le_bytes([pitch, roll, yaw, sequence.wrapping_add(1)]);
    SETPOINT.store(setpoint, Ordering::Relaxed);
}
