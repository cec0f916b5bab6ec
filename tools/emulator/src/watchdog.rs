//! The watchdog: nRF52840 Product Specification, section "WDT".
//!
//! The watchdog counts down from CRV at 32 768 Hz. When all enabled reload requests have come, the watchdog starts
//! again from CRV. Once started, it runs until a reset. The watchdog resets the chip two cycles of the 32.768 kHz clock
//! after TIMEOUT. The model supports only settings in which the watchdog also runs while the CPU sleeps.

use crate::CYCLES_PER_SECOND;
use crate::error::Refusal;
use crate::line::SerialLine;
use crate::peripheral::{Common, Context, Peripheral, RegisterFile as _, registers};

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
const CONFIG_HALT: u32 = 1 << 3;

registers! {
    // "The minimum value is 0xF."
    0x504 reload_value: u32 = u32::MAX, 0xF..;
    0x508 requests: u32 = 1, ..=0xFF;
    0x50C configuration: u32 = CONFIG_SLEEP, [0, 1, 8, 9];
}

/// Converts cycles of the 32.768 kHz clock to CPU cycles, rounded down.
fn low_frequency(cycles: u64) -> u64 {
    cycles * CYCLES_PER_SECOND / 32_768
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Watchdog {
    registers: Registers,
    /// The reload requests that have not come yet, if the watchdog runs.
    requested: u32,
    times_out_at: Option<u64>,
    bites_at: Option<u64>,
    running: bool,
    /// Whether the chip must be reset now.
    pub(crate) bit: bool,
}

impl Watchdog {
    fn reload(&mut self, now: u64) {
        self.requested = self.registers.requests;
        let timeout = low_frequency(u64::from(self.registers.reload_value) + 1);
        self.times_out_at = Some(now + timeout);
    }

    /// Pauses for this number of cycles, in which a debugger halts the core. If CONFIG says so, it runs on instead.
    pub(crate) fn pause(&mut self, cycles: u64) {
        if self.registers.configuration & CONFIG_HALT == 0 {
            for at in [&mut self.times_out_at, &mut self.bites_at] {
                *at = at.map(|at| at + cycles);
            }
        }
    }
}

impl Peripheral for Watchdog {
    fn common(&self) -> Common {
        Common::new("WDT", &[TIMEOUT], &[])
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        match offset {
            RUNSTATUS => Some(u32::from(self.running)),
            REQSTATUS if self.running => Some(self.requested),
            REQSTATUS => Some(self.registers.requests),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        match offset {
            // "Can only be changed before the watchdog is started." Later writes have no effect.
            CRV | RREN | CONFIG if self.running => {}
            RR..=RR_LAST => {
                if value == RELOAD && self.running && self.bites_at.is_none() {
                    self.requested &= !(1 << ((offset - RR) / 4));
                    if self.requested == 0 {
                        self.reload(context.now);
                    }
                }
            }
            _ => return self.registers.write(offset, value),
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        if offset != START {
            return None;
        }
        if self.registers.configuration & CONFIG_SLEEP == 0 {
            let refusal = Refusal::misused("WDT", "paused while the CPU sleeps");
            return context.check(Err(refusal));
        }
        if !self.running {
            self.running = true;
            self.reload(context.now);
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        let due = [self.times_out_at, self.bites_at];
        due.into_iter().flatten().min()
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
