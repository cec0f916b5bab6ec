//! The naive reference's result for a stream, in the core's types, and counts of outcomes.

use std::collections::BTreeMap;

use framelock::motion::Setpoint;
use framelock::{Counters, DiscardReason, Found, LineEvent};
use framelock_proofs::reference::{NaiveFormat, whole_buffer};

/// The result of a parser for a stream that begins after a reset.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Outcome {
    /// The findings in order. Consecutive bytes discarded for the same reason are one finding.
    pub(crate) found: Vec<Found<Setpoint>>,
    /// The number of pending bytes: bytes at the end of the stream that may still become part of a frame.
    pub(crate) pending: usize,
}

impl Outcome {
    /// Returns the reference's result.
    pub(crate) fn expected<F: NaiveFormat>(bytes: &[u8]) -> Self {
        let mut outcome = Self::default();
        outcome.pending = whole_buffer::<F>(bytes, |found| {
            outcome.add(found.map(Setpoint::from));
        });
        outcome
    }

    pub(crate) fn add(&mut self, found: Found<Setpoint>) {
        add(&mut self.found, found);
    }

    /// Returns each setpoint with the index of its frame's last byte.
    pub(crate) fn frames(&self) -> Vec<(usize, Setpoint)> {
        let mut end = 0;
        let frame = |found: &Found<Setpoint>| {
            end += found.bytes();
            found.message().map(|setpoint| (end - 1, setpoint))
        };
        self.found.iter().filter_map(frame).collect()
    }
}

/// The number of times that each outcome and each situation occurred: in a corpus, or in a test with random inputs.
#[derive(Debug, Default)]
pub struct Occurred(BTreeMap<&'static str, u64>);

impl Occurred {
    /// The state before any outcome has occurred.
    pub const NOTHING: Self = Self(BTreeMap::new());

    /// Counts an outcome.
    pub fn count(&mut self, outcome: &'static str, times: impl Into<u64>) {
        *self.0.entry(outcome).or_default() += times.into();
    }

    /// Adds a line's counters to the counts of the outcomes.
    pub fn count_all(&mut self, counters: &Counters) {
        let (discarded, events) = (&counters.discarded, &counters.events);
        for (outcome, times) in [
            ("frame", counters.frames),
            ("resynchronisation", counters.resynchronisations),
            ("no sync", discarded.no_sync),
            ("broken sync", discarded.broken_sync),
            ("bad header", discarded.bad_header),
            ("too long", discarded.too_long),
            ("unknown message", discarded.unknown_message),
            ("checksum mismatch", discarded.checksum_mismatch),
            ("wrong terminator", discarded.wrong_terminator),
            ("broken stuffing", discarded.broken_stuffing),
            ("discarded by a line event", discarded.line_event),
            ("framing error", events.framing),
            ("parity error", events.parity),
            ("overrun", events.overrun),
            ("break", events.line_break),
            ("idle gap", events.idle),
        ] {
            self.count(outcome, times);
        }
    }

    /// Returns the outcomes that occurred, in alphabetical order.
    pub fn present(&self) -> Vec<&'static str> {
        let present = self.0.iter().filter(|(_, times)| **times > 0);
        present.map(|(outcome, _)| *outcome).collect()
    }

    /// Returns the outcomes that were passed to [`count`](Self::count) but never occurred, in alphabetical order.
    pub fn missing(&self) -> Vec<&'static str> {
        self.rarer_than(1)
    }

    /// Returns the outcomes that were passed to [`count`](Self::count) but occurred fewer than `times` times, in
    /// alphabetical order.
    pub fn rarer_than(&self, times: u64) -> Vec<&'static str> {
        let rare = self.0.iter().filter(|(_, count)| **count < times);
        rare.map(|(outcome, _)| *outcome).collect()
    }
}

/// Adds the next finding. Joins discarded bytes with the bytes discarded before them, if both have the same reason.
pub(crate) fn add<Message>(all: &mut Vec<Found<Message>>, found: Found<Message>) {
    if let Found::Discarded {
        count: more, why, ..
    } = found
        && let Some(Found::Discarded {
            count, why: before, ..
        }) = all.last_mut()
        && *before == why
    {
        *count += more;
    } else {
        all.push(found);
    }
}

/// Converts a number of bytes to the type of the counters. The number fits, because the streams are short.
pub(crate) fn as_counter(bytes: usize) -> u32 {
    u32::try_from(bytes).expect("fewer than 4 GiB")
}

/// The counters that a line must report.
#[derive(Default)]
pub(crate) struct Counted {
    pub(crate) counters: Counters,
    /// True if bytes were discarded since the last frame.
    lost: bool,
}

impl Counted {
    /// Adds the bytes since the last line event and their outcomes to the counters.
    pub(crate) fn add<Message>(&mut self, bytes: usize, found: &[Found<Message>]) {
        self.counters.bytes += as_counter(bytes);
        for found in found {
            match *found {
                Found::Frame { length, .. } => {
                    self.counters.frames += 1;
                    self.counters.frame_bytes += as_counter(length);
                    self.counters.resynchronisations += u32::from(self.lost);
                    self.lost = false;
                }
                Found::Discarded { count, why, .. } => self.discarded(count, why),
            }
        }
    }

    pub(crate) fn discarded(&mut self, count: usize, why: DiscardReason) {
        let discarded = &mut self.counters.discarded;
        *match why {
            DiscardReason::NoSync => &mut discarded.no_sync,
            DiscardReason::BrokenSync => &mut discarded.broken_sync,
            DiscardReason::BadHeader => &mut discarded.bad_header,
            DiscardReason::TooLong => &mut discarded.too_long,
            DiscardReason::UnknownMessage => &mut discarded.unknown_message,
            DiscardReason::WrongTerminator => &mut discarded.wrong_terminator,
            DiscardReason::BrokenStuffing => &mut discarded.broken_stuffing,
            DiscardReason::ChecksumMismatch => &mut discarded.checksum_mismatch,
            DiscardReason::LineEvent => &mut discarded.line_event,
            other => panic!("no counter for {other}"),
        } += as_counter(count);
        self.lost |= count > 0;
    }

    /// Counts the line event that follows the bytes, but not the bytes that the event discards.
    pub(crate) fn line_event(&mut self, event: LineEvent) {
        let events = &mut self.counters.events;
        *match event {
            LineEvent::Framing => &mut events.framing,
            LineEvent::Parity => &mut events.parity,
            LineEvent::Overrun => &mut events.overrun,
            LineEvent::Break => &mut events.line_break,
            LineEvent::Idle => &mut events.idle,
            other => panic!("no counter for {other:?}"),
        } += 1;
    }
}
