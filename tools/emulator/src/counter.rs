//! A counter driven by a clock, as in TIMER and RTC. It computes the count at an instant, and the next instant
//! at which the count reaches a value.

/// A wrapping counter that counts at a fixed rate while it runs.
#[derive(Clone, Debug)]
pub(crate) struct Counter {
    /// The rate: the counter advances by `counts` in `cycles` cycles of 64 MHz.
    pub(crate) counts: u64,
    pub(crate) cycles: u64,
    /// The highest count; 0 follows it.
    pub(crate) mask: u32,
    pub(crate) runs: bool,
    /// The count at `since`, or the current count if the counter is stopped.
    pub(crate) count: u32,
    since: u64,
    /// Counts that were reached up to this instant have been handled.
    pub(crate) seen: u64,
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
        }
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

    /// Returns the first instant after `seen` at which the count becomes one of these values.
    pub(crate) fn next<'a>(&self, values: impl Iterator<Item = &'a u32>) -> Option<u64> {
        if !self.runs {
            return None;
        }
        let following = self.at(self.seen).wrapping_add(1);
        let values = values.filter(|value| **value & !self.mask == 0);
        let more = values.map(|value| value.wrapping_sub(following) & self.mask);
        let elapsed = self.elapsed(self.seen) + u64::from(more.min()?) + 1;
        Some(self.since + (elapsed * self.cycles).div_ceil(self.counts))
    }
}
