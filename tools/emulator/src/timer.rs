//! TIMER0 to TIMER4: nRF52840 Product Specification, section "TIMER".
//!
//! A timer counts cycles of 16 MHz / 2^PRESCALER, or triggers of the COUNT task in counter mode.
//! COMPARE\[n\] is raised when the count *becomes* CC\[n\]; a capture copies the count to CC\[n\].

use crate::MICROSECOND;
use crate::counter::Counter;
use crate::line::SerialLine;
use crate::peripheral::{Common, Context, Peripheral, RegisterFile as _, Short, registers};

const START: u32 = 0x000;
const STOP: u32 = 0x004;
const COUNT: u32 = 0x008;
const CLEAR: u32 = 0x00C;
const SHUTDOWN: u32 = 0x010;
const CAPTURE: u32 = 0x040;
const COMPARE: u32 = 0x140;
const CC: u32 = 0x540;

registers! {
    0x504 mode: u32 = 0, 0..=2;
    0x508 bitmode: u32 = 0, 0..=3;
    0x510 prescaler: u32 = 4, 0..=9;
    0x540 compare: Vec<u32> = Vec::new(), 0..;
}

#[derive(Clone, Debug)]
pub(crate) struct Timer {
    name: &'static str,
    registers: Registers,
    running: bool,
    /// The counter. It runs in timer mode only; in counter mode the COUNT task advances it.
    counter: Counter,
}

impl Timer {
    /// Creates a timer with `compares` compare registers: 4 for TIMER0 to TIMER2, 6 for TIMER3 and
    /// TIMER4.
    pub(crate) fn new(name: &'static str, compares: usize) -> Self {
        let compare = vec![0; compares];
        Self {
            name,
            registers: Registers {
                compare,
                ..Registers::default()
            },
            running: false,
            counter: Counter::new(1, MICROSECOND, 0xFFFF),
        }
    }

    /// Moves the count and the compare registers forward by this number of counts.
    pub(crate) fn skip(&mut self, counts: u32) {
        let mask = self.counter.mask;
        let all = self.registers.compare.iter_mut();
        for count in all.chain([&mut self.counter.count]) {
            *count = count.wrapping_add(counts) & mask;
        }
    }

    fn raise_compares(&self, count: u32, context: &mut Context) {
        for (event, compare) in (COMPARE..).step_by(4).zip(&self.registers.compare) {
            if *compare == count {
                context.raise(event);
            }
        }
    }
}

impl Peripheral for Timer {
    fn common(&self) -> Common {
        let compares = self.registers.compare.len();
        let events: Vec<u32> = (COMPARE..).step_by(4).take(compares).collect();
        let clear = (0..).zip(&events).map(|(n, at)| (1 << n, *at, CLEAR));
        let stop = (8..).zip(&events).map(|(n, at)| (1 << n, *at, STOP));
        let shorts: Vec<Short> = clear.chain(stop).collect();
        Common::new(self.name, &events, &shorts)
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        self.registers.read(offset)
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        if offset < CC && self.running {
            // "The timer must be stopped": changes of the other registers are not modelled while the timer runs.
            return None;
        }
        self.registers.write(offset, value)?;
        self.counter.mask = match self.registers.bitmode {
            1 => 0xFF,
            2 => 0xFF_FFFF,
            3 => u32::MAX,
            _ => 0xFFFF,
        };
        self.counter.cycles = (MICROSECOND / 16) << self.registers.prescaler;
        if offset >= CC {
            // No event comes if the count already equals the new value, because the count does not change.
            self.counter.seen = context.now;
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        let now = context.now;
        match offset {
            START => {
                if !self.running {
                    self.running = true;
                    self.counter.run(self.registers.mode == 0, now);
                }
            }
            STOP | SHUTDOWN => {
                self.running = false;
                self.counter.run(false, now);
                if offset == SHUTDOWN {
                    self.counter.set(0, now);
                }
            }
            // "The COUNT task has no effect in timer mode."
            COUNT => {
                if self.running && self.registers.mode != 0 {
                    self.counter.count = self.counter.count.wrapping_add(1) & self.counter.mask;
                    self.raise_compares(self.counter.count, context);
                }
            }
            CLEAR => self.counter.set(0, now),
            CAPTURE.. => {
                let compare = (offset - CAPTURE) / 4;
                *self.registers.compare.get_mut(compare as usize)? = self.counter.at(now);
                self.counter.seen = now;
            }
            _ => return None,
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.counter.next(self.registers.compare.iter())
    }

    fn advance(&mut self, context: &mut Context) {
        self.counter.seen = context.now;
        self.raise_compares(self.counter.at(context.now), context);
    }
}
