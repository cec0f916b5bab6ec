//! The summary of a stream. It counts in 64 bits, because the receiver's 32-bit counters may wrap in a long recording.

use std::collections::BTreeMap;

use framelock::{Counters, Discarded, LineEvent};
use framelock_receiving::{AnyLine, Protocol};
use serde::Serialize;

/// The outcomes of all bytes of a stream: bytes = bytes in frames + discarded + pending.
#[derive(Debug, Default, Serialize)]
pub(super) struct Summary {
    pub(super) bytes: u64,
    /// The length of a frame, if the frames have setpoints. All such frames have the same length.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_length: Option<usize>,
    pub(super) frames: u64,
    /// The number of bytes in frames, if the frames have no setpoints.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_bytes: Option<u64>,
    pub(super) discarded: u64,
    pending: usize,
    discarded_by: DiscardedTotals,
    resynchronisations: u64,
    /// The number of line events of each kind in the input.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    line_events: BTreeMap<String, u64>,
    /// The number of frames of each kind, if there are several kinds.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    kinds: BTreeMap<String, u64>,
    /// The counters at the last update.
    #[serde(skip)]
    before: Counters,
}

impl Summary {
    pub(super) fn new(protocol: &Protocol) -> Self {
        let has_one_length = protocol.has_setpoints();
        Self {
            frame_length: has_one_length.then(|| protocol.longest()),
            frame_bytes: (!has_one_length).then_some(0),
            ..Self::default()
        }
    }

    /// Counts a frame of a kind.
    #[cold]
    pub(super) fn count_frame(&mut self, kind: &str) {
        *self.kinds.entry(kind.to_owned()).or_default() += 1;
    }

    /// Returns the names of the kinds of frames that have been counted, separated by commas.
    pub(super) fn kind_names(&self) -> String {
        let names: Vec<&str> = self.kinds.keys().map(String::as_str).collect();
        names.join(", ")
    }

    /// Counts a line event that the input records.
    pub(super) fn count_event(&mut self, event: LineEvent) {
        *self.line_events.entry(event.to_string()).or_default() += 1;
    }

    /// Adds the increase of each counter since the last update. At the end of the input, bytes that the receiver
    /// discards as `line_event` are counted as `end_of_input`.
    pub(super) fn update(&mut self, line: &AnyLine, is_end: bool) {
        let line_event = self.discarded_by.line_event;
        self.add(line.counters());
        self.pending = line.pending();
        if is_end {
            let totals = &mut self.discarded_by;
            totals.end_of_input =
                std::mem::replace(&mut totals.line_event, line_event) - line_event;
        }
    }

    /// Adds the increase of each counter since the last call. Each increase must be less than 2³².
    fn add(&mut self, now: &Counters) {
        let before = std::mem::replace(&mut self.before, *now);
        self.bytes += increase(now.bytes, before.bytes);
        self.frames += increase(now.frames, before.frames);
        if let Some(frame_bytes) = &mut self.frame_bytes {
            *frame_bytes += increase(now.frame_bytes, before.frame_bytes);
        }
        self.discarded += increase(now.discarded.total(), before.discarded.total());
        self.discarded_by.add(&now.discarded, &before.discarded);
        self.resynchronisations += increase(now.resynchronisations, before.resynchronisations);
    }
}

fn increase(now: u32, before: u32) -> u64 {
    now.wrapping_sub(before).into()
}

macro_rules! discarded_totals {
    ($($reason:ident)*) => {
        /// Totals of discarded bytes by reason.
        #[derive(Debug, Default, Serialize)]
        struct DiscardedTotals {
            $($reason: u64,)*
            end_of_input: u64,
        }

        impl DiscardedTotals {
            fn add(&mut self, now: &Discarded, before: &Discarded) {
                $(self.$reason += increase(now.$reason, before.$reason);)*
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
    broken_stuffing
    line_event
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_go_on_when_counters_wrap() {
        let (mut summary, mut counters) = (Summary::default(), Counters::ZERO);
        for _ in 0..3 {
            counters.bytes = counters.bytes.wrapping_add(u32::MAX);
            counters.discarded.line_event = counters.bytes;
            summary.add(&counters);
        }
        let expected = 3 * u64::from(u32::MAX);
        let totals = [
            summary.bytes,
            summary.discarded,
            summary.discarded_by.line_event,
        ];
        assert_eq!(totals, [expected; 3]);
    }
}
