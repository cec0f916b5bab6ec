//! RTC1: nRF52840 Product Specification, section "RTC".
//!
//! A counter of 24 bits, at 32 768 Hz / (PRESCALER + 1). COMPARE\[n\] is raised when the count *becomes*
//! CC\[n\], OVRFLW when it becomes 0; each only while INTEN has it. TICK, and EVTEN for PPI, are not
//! modelled, and refused.
//!
//! Tasks take effect at once, on silicon at the next edges of the low-frequency clock. That the firmware
//! has started this clock is not checked.

use crate::peripheral::{Common, Context, Peripheral};
use crate::time::CYCLES_PER_SECOND;

const START: u32 = 0x000;
const STOP: u32 = 0x004;
const CLEAR: u32 = 0x008;
const OVRFLW: u32 = 0x104;
const COMPARE: u32 = 0x140;
const COUNTER: u32 = 0x504;
const PRESCALER: u32 = 0x508;
const CC: u32 = 0x540;

const HERTZ: u64 = 32_768;
const MASK: u32 = 0xFF_FFFF;

#[derive(Clone, Debug, Default)]
pub(crate) struct Rtc {
    prescaler: u32,
    compare: [u32; 4],
    running: bool,
    /// The count at `since`; while it does not run, the count.
    count: u32,
    since: u64,
    /// Events up to this instant have been raised.
    seen: u64,
}

impl Rtc {
    /// Counts from `since` to that instant.
    fn counts(&self, now: u64) -> u64 {
        (now - self.since) * HERTZ / (CYCLES_PER_SECOND * (u64::from(self.prescaler) + 1))
    }

    fn at(&self, now: u64) -> u32 {
        if !self.running {
            return self.count;
        }
        #[expect(clippy::cast_possible_truncation, reason = "counts wrap")]
        let counts = self.counts(now) as u32;
        self.count.wrapping_add(counts) & MASK
    }

    /// Makes `now` the instant from which it counts on.
    fn rebase(&mut self, count: u32, now: u64) {
        self.count = count;
        self.since = now;
        self.seen = now;
    }
}

impl Peripheral for Rtc {
    fn common(&self) -> Common {
        let events = [OVRFLW, COMPARE, COMPARE + 4, COMPARE + 8, COMPARE + 12];
        Common::new("RTC1", &events, 0).raised_only_if_enabled()
    }

    fn read(&self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            COUNTER => Some(self.at(now)),
            PRESCALER => Some(self.prescaler),
            CC.. => self.compare.get(((offset - CC) / 4) as usize).copied(),
            _ => None,
        }
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        match offset {
            // "When started, the prescaler cannot be changed."
            PRESCALER if value <= 0xFFF && !self.running => self.prescaler = value,
            CC.. if value <= MASK => {
                *self.compare.get_mut(((offset - CC) / 4) as usize)? = value;
                // A value that the count already has is not one that it becomes.
                self.seen = context.now;
            }
            _ => return None,
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            START | STOP => {
                self.rebase(self.at(context.now), context.now);
                self.running = offset == START;
            }
            CLEAR => self.rebase(0, context.now),
            _ => return None,
        }
        Some(())
    }

    fn next(&self) -> Option<u64> {
        if !self.running {
            return None;
        }
        // The next count is one that it becomes, and so on.
        let count = self.at(self.seen).wrapping_add(1);
        let values = self.compare.iter().chain(&[0]);
        let more = values.map(|value| value.wrapping_sub(count) & MASK).min()?;
        let counts = self.counts(self.seen) + u64::from(more) + 1;
        let cycles = CYCLES_PER_SECOND * (u64::from(self.prescaler) + 1);
        Some(self.since + (counts * cycles).div_ceil(HERTZ))
    }

    fn advance(&mut self, context: &mut Context) {
        let count = self.at(context.now);
        self.seen = context.now;
        if count == 0 {
            context.raise(OVRFLW);
        }
        for (event, compare) in (COMPARE..).step_by(4).zip(self.compare) {
            if compare == count {
                context.raise(event);
            }
        }
    }
}
