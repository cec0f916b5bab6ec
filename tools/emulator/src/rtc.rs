//! RTC1: nRF52840 Product Specification, section "RTC".
//!
//! A counter of 24 bits, at 32 768 Hz / (PRESCALER + 1). COMPARE\[n\] is raised when the count *becomes* CC\[n\], and
//! OVRFLW when the count becomes 0. Each of these events is raised only while it is enabled in INTEN. TICK, and EVTEN
//! for PPI, are not modelled and are rejected.
//!
//! Tasks take effect immediately. On silicon they take effect at the next edges of the low-frequency clock.
//! The model does not check that the firmware has started this clock.

use crate::CYCLES_PER_SECOND;
use crate::counter::Counter;
use crate::line::SerialLine;
use crate::peripheral::{Common, Context, Peripheral, RegisterFile as _, registers};

const START: u32 = 0x000;
const STOP: u32 = 0x004;
const CLEAR: u32 = 0x008;
const OVRFLW: u32 = 0x104;
const COMPARE: u32 = 0x140;
const COUNTER: u32 = 0x504;
const CC: u32 = 0x540;

const HERTZ: u64 = 32_768;
const MASK: u32 = 0xFF_FFFF;

registers! {
    0x508 prescaler: u32 = 0, 0..=0xFFF;
    0x540 compare: [u32; 4] = [0; 4], 0..=MASK;
}

#[derive(Clone, Debug)]
pub(crate) struct Rtc {
    registers: Registers,
    counter: Counter,
}

impl Rtc {
    pub(crate) fn new() -> Self {
        Self {
            registers: Registers::default(),
            counter: Counter::new(HERTZ, CYCLES_PER_SECOND, MASK),
        }
    }
}

impl Peripheral for Rtc {
    fn common(&self) -> Common {
        let events = [OVRFLW, COMPARE, COMPARE + 4, COMPARE + 8, COMPARE + 12];
        Common::new("RTC1", &events, &[]).raised_only_if_enabled()
    }

    fn read(&mut self, offset: u32, context: &Context) -> Option<u32> {
        match offset {
            COUNTER => Some(self.counter.at(context.now)),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        if offset < CC && self.counter.runs {
            // "When started, the prescaler cannot be changed."
            return None;
        }
        self.registers.write(offset, value)?;
        self.counter.cycles = CYCLES_PER_SECOND * (u64::from(self.registers.prescaler) + 1);
        if offset >= CC {
            // No event comes if the count already equals the new value, because the count does not change.
            self.counter.seen = context.now;
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            START | STOP => self.counter.run(offset == START, context.now),
            CLEAR => self.counter.set(0, context.now),
            _ => return None,
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.counter.next(self.registers.compare.iter().chain(&[0]))
    }

    fn advance(&mut self, context: &mut Context) {
        let count = self.counter.at(context.now);
        self.counter.seen = context.now;
        let compares = (COMPARE..).step_by(4).zip(self.registers.compare);
        for (event, compare) in compares.chain([(OVRFLW, 0)]) {
            if compare == count {
                context.raise(event);
            }
        }
    }
}
