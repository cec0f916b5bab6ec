//! TIMER0 to TIMER2: nRF52840 Product Specification, section "TIMER".
//!
//! A timer of 32 bits counts cycles of 16 MHz / 2^PRESCALER, or triggers of the COUNT task in counter mode.
//! COMPARE\[n\] is raised when the count *becomes* CC\[n\]; a capture copies the count to CC\[n\].

use crate::MICROSECOND;
use crate::counter::{COMPARES, Counter};
use crate::line::SerialLine;
use crate::peripheral::{Common, Context, Peripheral, Short};

const START: u32 = 0x000;
const STOP: u32 = 0x004;
const COUNT: u32 = 0x008;
const CLEAR: u32 = 0x00C;
const CAPTURE: u32 = 0x040;
const CC: u32 = 0x540;

const MODE: u32 = 0x504;
const BITMODE: u32 = 0x508;
const PRESCALER: u32 = 0x510;
const BITS_32: u32 = 3;

#[derive(Debug)]
pub(crate) struct Timer {
    common: Common,
    running: bool,
    /// The counter. It runs in timer mode only; in counter mode the COUNT task advances it.
    pub(crate) counter: Counter,
}

impl Timer {
    pub(crate) fn new(name: &'static str, base: u32) -> Self {
        let counter = Counter::new(1, MICROSECOND, u32::MAX);
        let clear = (0..).zip(COMPARES).map(|(n, at)| (1 << n, at, CLEAR));
        let stop = (8..).zip(COMPARES).map(|(n, at)| (1 << n, at, STOP));
        let shorts: Vec<Short> = clear.chain(stop).collect();
        let plain = [(MODE, 0, 0..=2), (BITMODE, 0, 0..=3), (PRESCALER, 4, 0..=9)];
        Self {
            common: Common::new(name, base, &COMPARES, &shorts, &plain),
            running: false,
            counter,
        }
    }
}

impl Peripheral for Timer {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        (self.common.load(offset)).or_else(|| self.counter.compare(offset).copied())
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        if offset >= CC {
            return self.counter.set_compare(offset, value, context.now);
        }
        if offset >= MODE && self.running {
            // "The timer must be stopped": changes of these registers are not modelled while the timer runs.
            return None;
        }
        self.common.store(offset, value)?;
        self.counter.cycles = (MICROSECOND / 16) << self.common[PRESCALER];
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        let now = context.now;
        match offset {
            // Timers of fewer bits are not modelled.
            START if self.common[BITMODE] != BITS_32 => return None,
            START => {
                if !self.running {
                    self.running = true;
                    self.counter.run(self.common[MODE] == 0, now);
                }
            }
            STOP => {
                self.running = false;
                self.counter.run(false, now);
            }
            // "The COUNT task has no effect in timer mode."
            COUNT => {
                if self.running && self.common[MODE] != 0 {
                    self.counter.count = self.counter.count.wrapping_add(1);
                    self.advance(context);
                }
            }
            CLEAR => self.counter.set(0, now),
            CAPTURE.. => {
                let count = self.counter.at(now);
                return self.counter.set_compare(offset - CAPTURE + CC, count, now);
            }
            _ => return None,
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.counter.next()
    }

    fn advance(&mut self, context: &mut Context) {
        let (_, events) = self.counter.reached(context.now);
        context.raised.extend(events);
    }
}
