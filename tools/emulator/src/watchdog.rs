//! The watchdog: nRF52840 Product Specification, section "WDT".
//!
//! It counts down from CRV at 32 768 Hz, is reloaded when all enabled reload requests have come, and
//! once started goes on until a reset. The chip is reset two cycles of the 32.768 kHz clock after
//! TIMEOUT. Only "runs while the CPU sleeps" is modelled, which is how it comes out of reset.

use crate::error::Refusal;
use crate::peripheral::{Common, Context, Peripheral};
use crate::time::CYCLES_PER_SECOND;

const START: u32 = 0x000;
const TIMEOUT: u32 = 0x100;
const RUNSTATUS: u32 = 0x400;
const REQSTATUS: u32 = 0x404;
const CRV: u32 = 0x504;
const RREN: u32 = 0x508;
const CONFIG: u32 = 0x50C;
const RR: u32 = 0x600;
const RR_LAST: u32 = 0x61C;
const RELOAD: u32 = 0x6E52_4635;
const CONFIG_SLEEP: u32 = 1;

/// Cycles of the 32.768 kHz clock in CPU cycles, to the nearest below.
fn low_frequency(cycles: u64) -> u64 {
    cycles * CYCLES_PER_SECOND / 32_768
}

#[derive(Clone, Debug)]
pub(crate) struct Watchdog {
    reload_value: u32,
    requests: u32,
    requested: u32,
    configuration: u32,
    times_out_at: Option<u64>,
    bites_at: Option<u64>,
    running: bool,
    /// Set when the chip is to be reset.
    pub(crate) bit: bool,
}

impl Watchdog {
    pub(crate) fn new() -> Self {
        Self {
            reload_value: u32::MAX,
            requests: 1,
            requested: 1,
            configuration: CONFIG_SLEEP,
            times_out_at: None,
            bites_at: None,
            running: false,
            bit: false,
        }
    }

    fn reload(&mut self, now: u64) {
        self.requested = self.requests;
        let timeout = low_frequency(u64::from(self.reload_value) + 1);
        self.times_out_at = Some(now + timeout);
    }
}

impl Peripheral for Watchdog {
    fn common(&self) -> Common {
        Common::new("WDT", &[TIMEOUT], 0)
    }

    fn read(&self, offset: u32, _: u64) -> Option<u32> {
        Some(match offset {
            RUNSTATUS => u32::from(self.running),
            REQSTATUS => self.requested,
            CRV => self.reload_value,
            RREN => self.requests,
            CONFIG => self.configuration,
            _ => return None,
        })
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        match offset {
            // "Can only be changed before the watchdog is started": writes after it are lost.
            CRV | RREN | CONFIG if self.running => {}
            // "The minimum value is 0xF."
            CRV if value >= 0xF => self.reload_value = value,
            RREN if value <= 0xFF => {
                self.requests = value;
                self.requested = value;
            }
            CONFIG if value & !9 == 0 => self.configuration = value,
            RR..=RR_LAST => {
                if value == RELOAD && self.running && self.bites_at.is_none() {
                    self.requested &= !(1 << ((offset - RR) / 4));
                    if self.requested == 0 {
                        self.reload(context.now);
                    }
                }
            }
            _ => return None,
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        if offset != START {
            return None;
        }
        if self.configuration & CONFIG_SLEEP == 0 {
            let refusal = Refusal::Watchdog("paused while the CPU sleeps");
            return context.check(Err(refusal));
        }
        if !self.running {
            self.running = true;
            self.reload(context.now);
        }
        Some(())
    }

    fn next(&self) -> Option<u64> {
        [self.times_out_at, self.bites_at]
            .into_iter()
            .flatten()
            .min()
    }

    fn advance(&mut self, context: &mut Context) {
        if self.times_out_at.is_some_and(|at| at <= context.now) {
            self.times_out_at = None;
            self.bites_at = Some(context.now + low_frequency(2));
            context.raise(TIMEOUT);
        }
        if self.bites_at.is_some_and(|at| at <= context.now) {
            self.bites_at = None;
            self.bit = true;
        }
    }
}
