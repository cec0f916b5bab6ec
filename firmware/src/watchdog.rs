//! The watchdog, and why the chip was reset.

use nrf52840_hal::pac::{POWER, WDT};

use crate::receive;
use crate::settings::WATCHDOG;

/// What the reload register takes, by the product specification.
const RELOAD: u32 = 0x6E52_4635;

/// Fed by the main loop only, while both times advance: the receiver's and the failsafe's.
pub(crate) struct Watchdog {
    watchdog: WDT,
    fed_at: (u32, u32),
}

impl Watchdog {
    /// From here on it bites, and nothing but a reset ends it. It goes on in sleep, and halts with a
    /// debugger.
    pub(crate) fn start(watchdog: WDT) -> Self {
        watchdog.config.write(|w| w.sleep().run().halt().pause());
        // SAFETY: 32 768 Hz; the register takes 15 and more, and the settings assert less than a
        // minute.
        watchdog
            .crv
            .write(|w| unsafe { w.crv().bits(WATCHDOG * 32_768 / 1_000) });
        watchdog.rren.write(|w| w.rr0().enabled());
        watchdog.tasks_start.write(|w| w.tasks_start().set_bit());
        Self {
            watchdog,
            fed_at: (0, 0),
        }
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
        // SAFETY: the value is the one that reloads.
        self.watchdog.rr[0].write(|w| unsafe { w.bits(RELOAD) });
        receive::ask_for_a_round();
    }
}

/// Why the chip was reset last: the bits of RESETREAS, which it forgets hereby. 0: power came on.
pub(crate) fn reset_cause(power: &POWER) -> u32 {
    let cause = power.resetreas.read().bits();
    // SAFETY: writing 1 to a bit clears it.
    power.resetreas.write(|w| unsafe { w.bits(cause) });
    cause
}
