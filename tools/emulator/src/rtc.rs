//! RTC1: nRF52840 Product Specification, section "RTC".
//!
//! A counter of 24 bits, at 32 768 Hz. COMPARE\[n\] is raised when the count *becomes* CC\[n\], and OVRFLW when the count
//! becomes 0. Each of these events is raised only while it is enabled in INTEN. STOP, PRESCALER, TICK, and EVTEN for PPI,
//! are not modelled and are rejected.
//!
//! Tasks take effect immediately. On silicon they take effect at the next edges of the low-frequency clock.
//! The model does not check that the firmware has started this clock.

use crate::CYCLES_PER_SECOND;
use crate::counter::{COMPARES, Counter};
use crate::line::SerialLine;
use crate::peripheral::{Common, Context, Peripheral};

const START: u32 = 0x000;
const CLEAR: u32 = 0x008;
const OVRFLW: u32 = 0x104;
const COUNTER: u32 = 0x504;

const HERTZ: u64 = 32_768;
const MASK: u32 = 0xFF_FFFF;

#[derive(Debug)]
pub(crate) struct Rtc {
    common: Common,
    counter: Counter,
}

impl Rtc {
    pub(crate) fn new() -> Self {
        let counter = Counter::new(HERTZ, CYCLES_PER_SECOND, MASK);
        let events = [&[OVRFLW], &COMPARES[..]].concat();
        let mut common = Common::new("RTC1", 0x4001_1000, &events, &[], &[]);
        common.raised_only_if_enabled = true;
        Self { common, counter }
    }
}

impl Peripheral for Rtc {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&mut self, offset: u32, context: &Context) -> Option<u32> {
        match offset {
            COUNTER => Some(self.counter.at(context.now)),
            _ => (self.common.load(offset)).or_else(|| self.counter.compare(offset).copied()),
        }
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        let done = self.common.store(offset, value);
        done.or_else(|| self.counter.set_compare(offset, value & MASK, context.now))
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            START => self.counter.run(true, context.now),
            CLEAR => self.counter.set(0, context.now),
            _ => return None,
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.counter.next()
    }

    fn advance(&mut self, context: &mut Context) {
        let (count, events) = self.counter.reached(context.now);
        context.raised.extend(events);
        if count == 0 {
            context.raise(OVRFLW);
        }
    }
}
