//! The watchdog: nRF52840 Product Specification, section "WDT".
//!
//! The watchdog counts down from CRV at 32 768 Hz. When the reload request comes, the watchdog starts again from CRV.
//! Once started, it runs until a reset by its own timeout, by the reset pin, or by a low supply voltage. The watchdog
//! resets the chip two cycles of the 32.768 kHz clock after its time is over. Except for CRV, the model supports only
//! the settings after a reset: one reload request, running while the CPU sleeps, and pausing while a debugger halts the
//! CPU. The event TIMEOUT is not modelled.

use crate::CYCLES_PER_SECOND;
use crate::line::SerialLine;
use crate::peripheral::{Access, Common, Context, Peripheral, READ_ONLY};

pub(crate) const WATCHDOG: u32 = 0x4001_0000;

const START: u32 = 0x000;
const RUNSTATUS: u32 = 0x400;
const CRV: u32 = 0x504;
const RREN: u32 = 0x508;
const RR0: u32 = 0x600;
const RELOAD: u32 = 0x6E52_4635;

/// Converts cycles of the 32.768 kHz clock to CPU cycles, rounded down.
fn low_frequency(cycles: u64) -> u64 {
    cycles * CYCLES_PER_SECOND / 32_768
}

#[derive(Debug)]
pub(crate) struct Watchdog {
    common: Common,
    /// The instant at which the watchdog resets the chip, if it runs.
    bites_at: Option<u64>,
}

impl Watchdog {
    pub(crate) fn new() -> Self {
        // "The minimum value is 0xF."
        let registers = [
            (CRV, u32::MAX, Access::Plain(0xF..=u32::MAX)),
            (RREN, 1, Access::Plain(1..=1)),
            (RUNSTATUS, 0, READ_ONLY),
        ];
        Self {
            common: Common::new("WDT", WATCHDOG, &[], registers),
            bites_at: None,
        }
    }

    fn reload(&mut self, now: u64) {
        let timeout = low_frequency(u64::from(self.common[CRV]) + 1);
        self.bites_at = Some(now + timeout + low_frequency(2));
    }
}

impl Peripheral for Watchdog {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        match (offset, self.bites_at) {
            // "Can only be changed before the watchdog is started." Later writes have no effect.
            (CRV | RREN, Some(_)) | (RR0, None) => {}
            (RR0, Some(bites_at)) => {
                // In the last two cycles of the 32.768 kHz clock before the reset, a reload request comes too late.
                if value == RELOAD && context.now + low_frequency(2) < bites_at {
                    self.reload(context.now);
                }
            }
            _ => self.common.store(offset, value)?,
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        if offset != START {
            return None;
        }
        if self.bites_at.is_none() {
            self.common.set(RUNSTATUS, 1);
            self.reload(context.now);
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.bites_at
    }

    fn advance(&mut self, context: &mut Context) {
        self.bites_at = None;
        context.bites = true;
    }

    fn pause(&mut self, cycles: u64) {
        self.bites_at = self.bites_at.map(|at| at + cycles);
    }
}
