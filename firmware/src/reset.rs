//! Resets: panics, faults and the watchdog; the cause of the last reset, and the outputs before it.
//!
//! After a panic or a fault the servos are let go and the chip is reset. A stack overflow gets no
//! further than a fault with nowhere to put its frame: the processor locks up, at which the chip
//! resets itself.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use framelock::motion::Setpoint;
use nrf52840_hal::pac::{POWER, WDT};
use nrf52840_hal::wdt::{self, WatchdogHandle, count::One, handles::Hdl0};

use crate::settings::WATCHDOG;
use crate::{servo, telemetry};

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    telemetry::panicked(info.location());
    servo::stop();
    SCB::sys_reset()
}

#[exception]
// SAFETY: the signature that the attribute demands; the frame is not used.
unsafe fn HardFault(_frame: &ExceptionFrame) -> ! {
    servo::stop();
    SCB::sys_reset()
}

/// Fed by the main loop only, while the receiver works. If the failsafe's clock stands still no tick wakes the main
/// loop.
pub(crate) struct Watchdog(WatchdogHandle<Hdl0>);

impl Watchdog {
    /// From here on it bites, and nothing but a reset ends it. It goes on in sleep, and halts with a
    /// debugger: that is how it comes out of reset.
    ///
    /// A soft reset does not end it, and its settings cannot be changed while it runs: after
    /// flashing, the time is still the old program's, until another reset. `None` if that program fed
    /// it in another way; then resets help, since at last the watchdog's own is among them.
    pub(crate) fn start(watchdog: WDT) -> Option<Self> {
        let parts = wdt::Watchdog::try_new(watchdog)
            .map(|mut watchdog| {
                watchdog.set_lfosc_ticks(WATCHDOG * 32_768 / 1_000);
                watchdog.activate::<One>()
            })
            .or_else(wdt::Watchdog::try_recover::<One>);
        let (handle,) = parts.ok()?.handles;
        Some(Self(handle))
    }

    /// Once a tick: feeds it if the receiver works.
    pub(crate) fn feed(&mut self, receiver_works: bool) {
        if receiver_works {
            self.0.pet();
        }
    }
}

/// Why the chip was reset last: the bits of RESETREAS, which are cleared. 0: power came on. With the
/// reset pin's bit others may be set that should not be (erratum 136): it alone counts.
pub(crate) fn cause(power: &POWER) -> u32 {
    let cause = power.resetreas.read();
    // SAFETY: writing 1 to a bit clears it.
    power.resetreas.write(|w| unsafe { w.bits(cause.bits()) });
    if cause.resetpin().is_detected() {
        return 1;
    }
    cause.bits()
}

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
pub(crate) fn last_output() -> Option<Setpoint> {
    let [output, check] = &LAST_OUTPUT;
    let output = output.load(Ordering::Relaxed);
    let is_known = check.load(Ordering::Relaxed) == output ^ CHECK;
    let [pitch, roll, yaw, _] = output.to_le_bytes();
    is_known.then_some(Setpoint { pitch, roll, yaw })
}

/// Keeps these outputs for the time after a reset.
pub(crate) fn keep_output(Setpoint { pitch, roll, yaw }: Setpoint) {
    let output = u32::from_le_bytes([pitch, roll, yaw, 0]);
    let [word, check] = &LAST_OUTPUT;
    word.store(output, Ordering::Relaxed);
    check.store(output ^ CHECK, Ordering::Relaxed);
}
