//! Counts in 64 bits, because the receiver's 32-bit counters may wrap in a long recording.

use framelock::{Counters, Discarded};
use serde::Serialize;

/// Totals of a line's counters. They do not wrap.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Totals {
    pub(super) bytes: u64,
    pub(super) frames: u64,
    pub(super) frame_bytes: u64,
    pub(super) discarded: DiscardedTotals,
    pub(super) resynchronisations: u64,
    /// The counters at the last call of `add`.
    before: Counters,
}

impl Totals {
    /// Adds the increase of each counter since the last call. Each increase must be less than 2³².
    pub(super) fn add(&mut self, now: &Counters) {
        let Self { before, .. } = *self;
        self.bytes += increase(now.bytes, before.bytes);
        self.frames += increase(now.frames, before.frames);
        self.frame_bytes += increase(now.frame_bytes, before.frame_bytes);
        self.discarded.add(&now.discarded, &before.discarded);
        self.resynchronisations += increase(now.resynchronisations, before.resynchronisations);
        self.before = *now;
    }

    /// Adds the increase of each counter at the end of the input. The receiver discards the remaining pending bytes
    /// there, and these are counted as `end_of_input`.
    pub(super) fn add_end(&mut self, now: &Counters) {
        let before = self.discarded.line_event;
        self.add(now);
        let discarded = &mut self.discarded;
        discarded.end_of_input = discarded.line_event - before;
        discarded.line_event = before;
    }
}

fn increase(now: u32, before: u32) -> u64 {
    now.wrapping_sub(before).into()
}

macro_rules! discarded_totals {
    ($($reason:ident)*) => {
        /// Totals of discarded bytes by reason.
        #[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
        pub(super) struct DiscardedTotals {
            $($reason: u64,)*
            end_of_input: u64,
        }

        impl DiscardedTotals {
            fn add(&mut self, now: &Discarded, before: &Discarded) {
                $(self.$reason += increase(now.$reason, before.$reason);)*
            }

            /// Returns the sum of all totals.
            pub(super) const fn total(&self) -> u64 {
                self.end_of_input $(+ self.$reason)*
            }
        }
    };
}
discarded_totals!(
    no_sync
    broken_sync
    bad_header
    too_long
    unknown_message
    checksum_mismatch
    wrong_terminator
    line_event
);

#[cfg(test)]
mod tests {
    use super::Totals;
    use framelock::Counters;

    #[test]
    fn totals_go_on_when_counters_wrap() {
        let (mut totals, mut counters) = (Totals::default(), Counters::ZERO);
        for _ in 0..3 {
            counters.bytes = counters.bytes.wrapping_add(u32::MAX);
            counters.discarded.line_event = counters.bytes;
            totals.add(&counters);
        }
        assert_eq!(totals.bytes, 3 * u64::from(u32::MAX));
        assert_eq!(totals.discarded.total(), totals.bytes);
    }
}
