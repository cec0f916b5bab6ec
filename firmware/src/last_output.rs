//! The outputs as they were last, for the time after a reset: servos then begin where they are.

use core::sync::atomic::{AtomicU32, Ordering};

use framelock::motion::Setpoint;

/// Pitch, roll, yaw in one word, and its check word. No start-up code writes to this section: after
/// power-on it has anything, after another reset what was there, as a rule. A brown-out looks like power-on
/// and leaves the servos where they are, so the check word alone says whether it is known: of 2^32 words at
/// random one deceives. `used`, so that the compiler does not take the zeros for granted.
#[used]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".uninit.LAST_OUTPUT")]
static LAST_OUTPUT: [AtomicU32; 2] = [AtomicU32::new(0), AtomicU32::new(0)];

/// Tells outputs from anything else.
const CHECK: u32 = 0x5E27_0A75;

/// Where the outputs were before the reset, if it is known.
pub(crate) fn before_reset() -> Option<Setpoint> {
    let [output, check] = &LAST_OUTPUT;
    let output = output.load(Ordering::Relaxed);
    let is_known = check.load(Ordering::Relaxed) == output ^ CHECK;
    let [pitch, roll, yaw, _] = output.to_le_bytes();
    is_known.then_some(Setpoint { pitch, roll, yaw })
}

/// This is where they are now.
pub(crate) fn keep(Setpoint { pitch, roll, yaw }: Setpoint) {
    let output = u32::from_le_bytes([pitch, roll, yaw, 0]);
    let [word, check] = &LAST_OUTPUT;
    word.store(output, Ordering::Relaxed);
    check.store(output ^ CHECK, Ordering::Relaxed);
}
