//! A counter driven by a clock, with compare registers, as in TIMER and RTC. It computes the count at an instant, and the
//! next instant at which the count reaches a value.

/// The offset of the first compare register.
const CC: u32 = 0x540;
/// The events of the compare registers.
pub(crate) const COMPARES: [u32; 4] = [0x140, 0x144, 0x148, 0x14C];

/// A wrapping counter that counts at a fixed rate while it runs.
#[derive(Clone, Debug)]
pub(crate) struct Counter {
    /// The rate: the counter advances by `counts` in `cycles` cycles of 64 MHz.
    counts: u64,
    pub(crate) cycles: u64,
    /// The highest count; 0 follows it.
    mask: u32,
    pub(crate) runs: bool,
    /// The count at `since`, or the current count if the counter is stopped.
    pub(crate) count: u32,
    since: u64,
    /// Counts that were reached up to this instant have been handled.
    pub(crate) seen: u64,
    /// The values of CC. An event is raised when the count *becomes* one of them.
    compares: [u32; 4],
}

impl Counter {
    pub(crate) fn new(counts: u64, cycles: u64, mask: u32) -> Self {
        Self {
            counts,
            cycles,
            mask,
            runs: false,
            count: 0,
            since: 0,
            seen: 0,
            compares: [0; 4],
        }
    }

    /// Returns the compare register at this offset.
    pub(crate) fn compare(&mut self, offset: u32) -> Option<&mut u32> {
        let place = offset.checked_sub(CC)? / 4;
        self.compares.get_mut(place as usize)
    }

    /// Sets the compare register at this offset. No event comes if the count already equals the new value, because the
    /// count does not change.
    pub(crate) fn set_compare(&mut self, offset: u32, value: u32, now: u64) -> Option<()> {
        *self.compare(offset)? = value;
        self.seen = now;
        Some(())
    }

    /// Returns the number of counts from `since` to `now`.
    fn elapsed(&self, now: u64) -> u64 {
        (now - self.since) * self.counts / self.cycles
    }

    /// Returns the count at `now`.
    pub(crate) fn at(&self, now: u64) -> u32 {
        if !self.runs {
            return self.count;
        }
        #[expect(clippy::cast_possible_truncation, reason = "counts wrap")]
        let elapsed = self.elapsed(now) as u32;
        self.count.wrapping_add(elapsed) & self.mask
    }

    /// Sets the count.
    pub(crate) fn set(&mut self, count: u32, now: u64) {
        self.count = count;
        self.since = now;
        self.seen = now;
    }

    /// Starts or stops the counter.
    pub(crate) fn run(&mut self, runs: bool, now: u64) {
        self.set(self.at(now), now);
        self.runs = runs;
    }

    /// Moves the count and the compare registers forward by this number of counts.
    pub(crate) fn skip(&mut self, counts: u32) {
        for count in self.compares.iter_mut().chain([&mut self.count]) {
            *count = count.wrapping_add(counts) & self.mask;
        }
    }

    /// Returns the first instant after `seen` at which the count becomes 0 or the value of a compare register.
    pub(crate) fn next(&self) -> Option<u64> {
        if !self.runs {
            return None;
        }
        let following = self.at(self.seen).wrapping_add(1);
        let values = self.compares.iter().chain(&[0]);
        let values = values.filter(|value| **value & !self.mask == 0);
        let more = values.map(|value| value.wrapping_sub(following) & self.mask);
        let elapsed = self.elapsed(self.seen) + u64::from(more.min()?) + 1;
        Some(self.since + (elapsed * self.cycles).div_ceil(self.counts))
    }

    /// Returns the count at `now`, and the events of this count. From here on, the count has been handled.
    pub(crate) fn reached(&mut self, now: u64) -> (u32, impl Iterator<Item = u32>) {
        self.seen = now;
        let count = self.at(now);
        let compares = COMPARES.into_iter().zip(&self.compares);
        let reached = compares.filter(move |(_, compare)| **compare == count);
        (count, reached.map(|(event, _)| event))
    }
}
