//! The watchdog, and why the chip was reset.

use nrf52840_hal::pac::{POWER, WDT};
use nrf52840_hal::wdt::{self, WatchdogHandle, count::One, handles::Hdl0};

use crate::receive;
use crate::settings::WATCHDOG;

/// Fed by the main loop only, while both times advance: the receiver's and the failsafe's.
pub(crate) struct Watchdog {
    handle: WatchdogHandle<Hdl0>,
    fed_at: (u32, u32),
}

impl Watchdog {
    /// From here on it bites, and nothing but a reset ends it. It goes on in sleep, and halts with a
    /// debugger: that is how it comes out of reset. `None` if someone else has started it in another
    /// way.
    pub(crate) fn start(watchdog: WDT) -> Option<Self> {
        let parts = wdt::Watchdog::try_new(watchdog)
            .map(|mut watchdog| {
                watchdog.set_lfosc_ticks(WATCHDOG * 32_768 / 1_000);
                watchdog.activate::<One>()
            })
            // A soft reset does not stop it: it goes on with these settings.
            .or_else(wdt::Watchdog::try_recover::<One>);
        let (handle,) = parts.ok()?.handles;
        Some(Self {
            handle,
            fed_at: (0, 0),
        })
    }

    /// Feeds it four times in its time, if the receiver has been through its handler and the
    /// failsafe's clock has moved since it was fed last; and asks the receiver for the next time.
    pub(crate) fn feed(&mut self, receiver: u32, failsafe: u32) {
        let (last_receiver, last_failsafe) = self.fed_at;
        let due = failsafe.wrapping_sub(last_failsafe) >= WATCHDOG * 1_000 / 4;
        if !due || receiver == last_receiver {
            return;
        }
        self.fed_at = (receiver, failsafe);
        self.handle.pet();
        receive::ask_for_a_round();
    }
}

/// Why the chip was reset last: the bits of RESETREAS, which are cleared. 0: power came on.
pub(crate) fn reset_cause(power: &POWER) -> u32 {
    let cause = power.resetreas.read().bits();
    // SAFETY: writing 1 to a bit clears it.
    power.resetreas.write(|w| unsafe { w.bits(cause) });
    cause
}
