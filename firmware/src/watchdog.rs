//! The watchdog, and why the chip was reset.

use nrf52840_hal::pac::{POWER, WDT};
use nrf52840_hal::wdt::{self, WatchdogHandle, count::One, handles::Hdl0};

use crate::settings::WATCHDOG;

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
pub(crate) fn reset_cause(power: &POWER) -> u32 {
    let cause = power.resetreas.read();
    // SAFETY: writing 1 to a bit clears it.
    power.resetreas.write(|w| unsafe { w.bits(cause.bits()) });
    if cause.resetpin().is_detected() {
        return 1;
    }
    cause.bits()
}
