//! TIMER0 to TIMER4: nRF52840 Product Specification, section "TIMER".
//!
//! A timer counts 16 MHz / 2^PRESCALER, or in counter mode the COUNT task. COMPARE\[n\] is raised
//! when the count *becomes* CC\[n\]; a capture copies the count to CC\[n\].

use crate::peripheral::{Common, Context, Peripheral};
use crate::time::MICROSECOND;

const START: u32 = 0x000;
const STOP: u32 = 0x004;
const COUNT: u32 = 0x008;
const CLEAR: u32 = 0x00C;
const SHUTDOWN: u32 = 0x010;
const CAPTURE: u32 = 0x040;
const COMPARE: u32 = 0x140;
const MODE: u32 = 0x504;
const BITMODE: u32 = 0x508;
const PRESCALER: u32 = 0x510;
const CC: u32 = 0x540;

/// CPU cycles of one cycle of the 16 MHz clock.
const PCLK16M: u64 = MICROSECOND / 16;

#[derive(Clone, Debug)]
pub(crate) struct Timer {
    name: &'static str,
    mode: u32,
    bitmode: u32,
    prescaler: u32,
    compare: Vec<u32>,
    running: bool,
    /// The count at `since`; while it does not run, the count.
    count: u32,
    /// While it runs as a timer: when the count was `count`.
    since: u64,
    /// Compares up to this instant have been raised.
    seen: u64,
}

impl Timer {
    /// `compares`: 4 for TIMER0 to TIMER2, 6 for TIMER3 and TIMER4.
    pub(crate) fn new(name: &'static str, compares: u32) -> Self {
        Self {
            name,
            mode: 0,
            bitmode: 0,
            prescaler: 4,
            compare: vec![0; compares as usize],
            running: false,
            count: 0,
            since: 0,
            seen: 0,
        }
    }

    /// The highest count.
    fn mask(&self) -> u32 {
        match self.bitmode {
            1 => 0xFF,
            2 => 0xFF_FFFF,
            3 => u32::MAX,
            _ => 0xFFFF,
        }
    }

    /// Cycles from one count to the next.
    fn tick(&self) -> u64 {
        PCLK16M << self.prescaler
    }

    fn counts_time(&self) -> bool {
        self.running && self.mode == 0
    }

    /// What it counts at that instant.
    fn at(&self, now: u64) -> u32 {
        if !self.counts_time() {
            return self.count;
        }
        let ticks = (now - self.since) / self.tick();
        #[expect(clippy::cast_possible_truncation, reason = "counts wrap")]
        let ticks = ticks as u32;
        self.count.wrapping_add(ticks) & self.mask()
    }

    /// The first instant after `seen` at which the count becomes that value.
    fn becomes(&self, value: u32) -> Option<u64> {
        if value & !self.mask() != 0 {
            return None;
        }
        let ticks = u64::from(value.wrapping_sub(self.count) & self.mask());
        let round = (u64::from(self.mask()) + 1) * self.tick();
        let mut at = self.since + ticks * self.tick();
        // The count at `since` itself was there before; so is all up to `seen`.
        while at <= self.seen.max(self.since) {
            at += round;
        }
        Some(at)
    }

    /// Makes `now` the instant from which it counts on.
    fn rebase(&mut self, count: u32, now: u64) {
        self.count = count;
        self.since = now;
        self.seen = now;
    }

    fn raise_compares(&self, count: u32, context: &mut Context) {
        for (event, compare) in (COMPARE..).step_by(4).zip(&self.compare) {
            if *compare == count {
                context.raise(event);
            }
        }
    }
}

impl Peripheral for Timer {
    fn common(&self) -> Common {
        let events: Vec<u32> = (COMPARE..).step_by(4).take(self.compare.len()).collect();
        let clear_and_stop = ((1 << self.compare.len()) - 1) * 0x101;
        Common::new(self.name, &events, clear_and_stop)
    }

    fn read(&self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            MODE => Some(self.mode),
            BITMODE => Some(self.bitmode),
            PRESCALER => Some(self.prescaler),
            CC.. => self.compare.get(((offset - CC) / 4) as usize).copied(),
            _ => None,
        }
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        match offset {
            // "The timer must be stopped": these three while it runs are not modelled.
            MODE if value <= 2 && !self.running => self.mode = value,
            BITMODE if value <= 3 && !self.running => self.bitmode = value,
            PRESCALER if value <= 9 && !self.running => self.prescaler = value,
            CC.. => {
                *self.compare.get_mut(((offset - CC) / 4) as usize)? = value;
                // A value that the count already has is not one that it becomes.
                self.seen = context.now;
            }
            _ => return None,
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        let now = context.now;
        match offset {
            START => {
                if !self.running {
                    self.running = true;
                    self.rebase(self.count, now);
                }
            }
            STOP => {
                self.count = self.at(now);
                self.running = false;
            }
            SHUTDOWN => {
                self.running = false;
                self.count = 0;
            }
            // "The COUNT task has no effect in timer mode."
            COUNT => {
                if self.running && self.mode != 0 {
                    self.count = self.count.wrapping_add(1) & self.mask();
                    self.raise_compares(self.count, context);
                }
            }
            CLEAR => self.rebase(0, now),
            CAPTURE.. => {
                let count = self.at(now);
                *self.compare.get_mut(((offset - CAPTURE) / 4) as usize)? = count;
                self.seen = now;
            }
            _ => return None,
        }
        Some(())
    }

    fn shorted(&self, event: u32, shorts: u32) -> [Option<u32>; 2] {
        let n = (event - COMPARE) / 4;
        [
            (shorts >> n & 1 == 1).then_some(CLEAR),
            (shorts >> (8 + n) & 1 == 1).then_some(STOP),
        ]
    }

    fn next(&self) -> Option<u64> {
        if !self.counts_time() {
            return None;
        }
        self.compare.iter().filter_map(|cc| self.becomes(*cc)).min()
    }

    fn advance(&mut self, context: &mut Context) {
        if !self.counts_time() {
            return;
        }
        let count = self.at(context.now);
        self.seen = context.now;
        self.raise_compares(count, context);
    }
}
