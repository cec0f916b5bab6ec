//! What the naive reference makes of a stream, in the core's words.

use framelock::motion::Setpoint;
use framelock::{Counters, DiscardReason, Found, LineEvent};
use framelock_proofs::reference::{Format, whole_buffer};

/// What a parser must report of a stream that it takes after a reset.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Outcome {
    /// In order. Bytes that are discarded one behind the other for the same reason stand once.
    pub(crate) found: Vec<Found<Setpoint>>,
    /// Bytes at the end that may yet become a frame.
    pub(crate) pending: usize,
}

impl Outcome {
    /// By the reference.
    pub(crate) fn expected<F: Format>(bytes: &[u8]) -> Self {
        let mut outcome = Self::default();
        outcome.pending = whole_buffer::<F>(bytes, |found| {
            outcome.add(found.map(Setpoint::from));
        });
        outcome
    }

    pub(crate) fn add(&mut self, found: Found<Setpoint>) {
        add(&mut self.found, found);
    }

    /// Each setpoint with the index of its frame's last byte.
    pub(crate) fn frames(&self) -> Vec<(usize, Setpoint)> {
        let mut end = 0;
        let frame = |found: &Found<Setpoint>| {
            end += found.bytes();
            found.message().map(|setpoint| (end - 1, setpoint))
        };
        self.found.iter().filter_map(frame).collect()
    }
}

/// Adds what is found next; bytes that are discarded for the same reason as those before go with them.
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

/// Returns a number of bytes as the counters have it. The streams are short.
pub(crate) fn as_counter(bytes: usize) -> u32 {
    u32::try_from(bytes).expect("fewer than 4 GiB")
}

/// What must be counted.
#[derive(Default)]
pub(crate) struct Counted {
    pub(crate) counters: Counters,
    /// Bytes were discarded since the last frame.
    lost: bool,
}

impl Counted {
    /// The bytes since the last line event, and what became of them.
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
            DiscardReason::ChecksumMismatch => &mut discarded.checksum_mismatch,
            DiscardReason::LineEvent => &mut discarded.line_event,
            other => panic!("no counter for {other}"),
        } += as_counter(count);
        self.lost |= count > 0;
    }

    /// The line event behind them. What it discards is counted by [`Self::discarded`].
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
