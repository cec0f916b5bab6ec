//! TIMER0 to TIMER2 and RTC1: nRF52840 Product Specification, sections "TIMER" and "RTC".
//!
//! A timer of 32 bits counts cycles of 16 MHz / 2^PRESCALER, or triggers of the COUNT task in counter mode. The RTC has
//! 24 bits and counts at 32 768 Hz. COMPARE\[n\] is raised when the counter counts to CC\[n\], and the RTC's OVRFLW
//! when it wraps to 0. A CLEAR raises neither. A capture copies the count to CC\[n\]. The only modelled shorts are
//! those from COMPARE\[n\] to CLEAR. The RTC's STOP, PRESCALER and TICK, and its EVTEN for PPI, are not modelled.
//!
//! The RTC's tasks take effect immediately. On silicon they take effect at the next edges of the low-frequency clock.
//! The model does not check that the firmware has started this clock.

use crate::line::SerialLine;
use crate::peripheral::{ANY, Access, Common, Context, Peripheral};
use crate::{CYCLES_PER_SECOND, MICROSECOND};

const START: u32 = 0x000;
const STOP: u32 = 0x004;
/// The tasks of a timer.
const COUNT: u32 = 0x008;
const CLEAR: u32 = 0x00C;
const CAPTURE: u32 = 0x040;
/// The RTC's task, event and register.
const RTC_CLEAR: u32 = 0x008;
const OVRFLW: u32 = 0x104;
const COUNTER: u32 = 0x504;

const SHORTS: u32 = 0x200;
const MODE: u32 = 0x504;
const BITMODE: u32 = 0x508;
const PRESCALER: u32 = 0x510;
const BITS_32: u32 = 3;
/// The first of four compare registers, and their events.
const CC: u32 = 0x540;
const COMPARES: [u32; 4] = [0x140, 0x144, 0x148, 0x14C];

/// A wrapping counter, which counts at a fixed rate or counts triggers of the COUNT task.
#[derive(Debug)]
pub(crate) struct Counter {
    common: Common,
    is_rtc: bool,
    /// The highest count; 0 follows it.
    mask: u32,
    running: bool,
    /// The count at `since`, or the current count if the counter does not count time.
    count: u32,
    since: u64,
    /// Counts that were reached up to this instant have been handled.
    seen: u64,
}

impl Counter {
    pub(crate) fn timer(name: &'static str, base: u32) -> Self {
        let registers = [
            (SHORTS, 0, Access::Plain(0..=0xF)),
            (MODE, 0, Access::Plain(0..=2)),
            (BITMODE, 0, Access::Plain(0..=3)),
            (PRESCALER, 4, Access::Plain(0..=9)),
        ];
        let compares = [0, 4, 8, 12].map(|n| (CC + n, 0, ANY));
        let registers = registers.into_iter().chain(compares);
        Self::new(Common::new(name, base, &COMPARES, registers), u32::MAX)
    }

    pub(crate) fn rtc() -> Self {
        let mask = 0xFF_FFFF;
        let compares = [0, 4, 8, 12].map(|n| (CC + n, 0, Access::Plain(0..=mask)));
        let events = [&[OVRFLW], &COMPARES[..]].concat();
        let mut common = Common::new("RTC1", 0x4001_1000, &events, compares);
        common.raised_only_if_enabled = true;
        Self::new(common, mask)
    }

    fn new(common: Common, mask: u32) -> Self {
        Self {
            is_rtc: common.raised_only_if_enabled,
            common,
            mask,
            running: false,
            count: 0,
            since: 0,
            seen: 0,
        }
    }

    fn counts_time(&self) -> bool {
        self.running && (self.is_rtc || self.common[MODE] == 0)
    }

    /// Returns the rate as `(counts, cycles)`: the counter advances by `counts` in `cycles` of the 64 MHz clock.
    fn rate(&self) -> (u64, u64) {
        if self.is_rtc {
            (32_768, CYCLES_PER_SECOND)
        } else {
            (1, (MICROSECOND / 16) << self.common[PRESCALER])
        }
    }

    /// Returns the number of counts from `since` to `now`.
    fn elapsed(&self, now: u64) -> u64 {
        let (counts, cycles) = self.rate();
        (now - self.since) * counts / cycles
    }

    /// Returns the count at `now`.
    fn at(&self, now: u64) -> u32 {
        if !self.counts_time() {
            return self.count;
        }
        #[expect(clippy::cast_possible_truncation, reason = "counts wrap")]
        let elapsed = self.elapsed(now) as u32;
        self.count.wrapping_add(elapsed) & self.mask
    }

    fn set(&mut self, count: u32, now: u64) {
        self.count = count;
        self.since = now;
        self.seen = now;
    }

    /// Sets a compare register. No event comes if the count already equals the new value, because the count does not
    /// change.
    fn set_compare(&mut self, offset: u32, value: u32, now: u64) -> Option<()> {
        self.seen = now;
        self.common.store(offset, value)
    }
}

impl Peripheral for Counter {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&mut self, offset: u32, context: &Context) -> Option<u32> {
        match offset {
            COUNTER if self.is_rtc => Some(self.at(context.now)),
            _ => self.common.load(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        match offset {
            CC.. => self.set_compare(offset, value, context.now),
            // "The timer must be stopped": changes of these registers are not modelled while the timer runs.
            MODE.. if self.running => None,
            _ => self.common.store(offset, value),
        }
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        let now = context.now;
        match offset {
            // Timers of fewer bits are not modelled.
            START if !self.is_rtc && self.common[BITMODE] != BITS_32 => return None,
            START => {
                self.set(self.at(now), now);
                self.running = true;
            }
            RTC_CLEAR if self.is_rtc => self.set(0, now),
            _ if self.is_rtc => return None,
            STOP => {
                self.set(self.at(now), now);
                self.running = false;
            }
            // "The COUNT task has no effect in timer mode."
            COUNT => {
                if self.running && !self.counts_time() {
                    self.count = self.count.wrapping_add(1);
                    self.advance(context);
                }
            }
            CLEAR => self.set(0, now),
            CAPTURE.. => return self.set_compare(offset - CAPTURE + CC, self.at(now), now),
            _ => return None,
        }
        Some(())
    }

    /// Returns the first instant after `seen` at which the count becomes 0 or the value of a compare register.
    fn next(&self, _: &SerialLine) -> Option<u64> {
        if !self.counts_time() {
            return None;
        }
        let following = self.at(self.seen).wrapping_add(1);
        let compares = [0, 4, 8, 12].map(|n| self.common[CC + n]).into_iter();
        let more = compares
            .chain([0])
            .map(|value| value.wrapping_sub(following) & self.mask);
        let elapsed = self.elapsed(self.seen) + u64::from(more.min()?) + 1;
        let (counts, cycles) = self.rate();
        Some(self.since + (elapsed * cycles).div_ceil(counts))
    }

    /// Raises the events of the current count, and performs their shorts.
    fn advance(&mut self, context: &mut Context) {
        self.seen = context.now;
        let count = self.at(context.now);
        for (n, event) in (0..).zip(COMPARES) {
            if self.common[CC + 4 * n] == count {
                self.common.raise(event, context);
                if !self.is_rtc && self.common[SHORTS] >> n & 1 == 1 {
                    self.set(0, context.now);
                }
            }
        }
        if self.is_rtc && count == 0 {
            self.common.raise(OVRFLW, context);
        }
    }

    fn skip(&mut self, counts: u32) {
        let skipped = |count: u32| count.wrapping_add(counts) & self.mask;
        self.count = skipped(self.count);
        for offset in [0, 4, 8, 12].map(|n| CC + n) {
            self.common.set(offset, skipped(self.common[offset]));
        }
    }
}
