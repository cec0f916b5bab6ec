//! What the naive reference makes of a stream, in the core's words.

use framelock::{Counters, Event, LineEvent, Mismatch, Setpoint};
use framelock_proofs::reference::{self, Format, Policy, whole_buffer};

/// What a parser must report of a stream that it takes after a reset.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Outcome {
    /// In order. Bytes that are dropped one behind the other for the same reason are one event.
    pub(crate) events: Vec<Event<Setpoint>>,
    /// Bytes at the end that may yet become a frame.
    pub(crate) pending: usize,
}

impl Outcome {
    /// By the reference.
    pub(crate) fn expected<F: Format>(bytes: &[u8], policy: Policy) -> Self {
        let mut outcome = Self::default();
        outcome.pending = whole_buffer::<F>(bytes, policy, |event| {
            outcome.add(match event {
                reference::Event::Frame { index, setpoint } => Event::Frame {
                    index,
                    message: setpoint.into(),
                },
                reference::Event::Dropped { count, place } => Event::Dropped {
                    count,
                    why: match place {
                        0 => Mismatch::NoSync,
                        1 => Mismatch::BrokenSync,
                        place if place == F::LENGTH => Mismatch::Check,
                        _ => Mismatch::Terminator,
                    },
                },
            });
        });
        outcome
    }

    pub(crate) fn add(&mut self, event: Event<Setpoint>) {
        if let Event::Dropped { count: more, why } = event
            && let Some(Event::Dropped { count, why: before }) = self.events.last_mut()
            && *before == why
        {
            *count += more;
        } else {
            self.events.push(event);
        }
    }

    /// Each setpoint with the index of its frame's last byte.
    pub(crate) fn frames(&self) -> Vec<(usize, Setpoint)> {
        let frame = |event: &Event<Setpoint>| match *event {
            Event::Frame { index, message } => Some((index, message)),
            Event::Dropped { .. } => None,
        };
        self.events.iter().filter_map(frame).collect()
    }
}

/// What must be counted.
#[derive(Default)]
pub(crate) struct Counted {
    pub(crate) counters: Counters,
    /// Bytes were dropped since the last frame.
    lost: bool,
}

impl Counted {
    /// The bytes since the last line event, and what became of them in frames of so many bytes.
    pub(crate) fn add(&mut self, bytes: usize, frame_length: usize, outcome: &Outcome) {
        self.counters.bytes += bytes;
        for event in &outcome.events {
            match *event {
                Event::Frame { .. } => self.frame(frame_length),
                Event::Dropped { count, why } => self.dropped(count, why),
            }
        }
    }

    pub(crate) fn frame(&mut self, length: usize) {
        self.counters.frames += 1;
        self.counters.frame_bytes += length;
        self.counters.resynchronisations += usize::from(self.lost);
        self.lost = false;
    }

    pub(crate) fn dropped(&mut self, count: usize, why: Mismatch) {
        let discarded = &mut self.counters.discarded;
        *match why {
            Mismatch::NoSync => &mut discarded.no_sync,
            Mismatch::BrokenSync => &mut discarded.broken_sync,
            Mismatch::Header => &mut discarded.header,
            Mismatch::Terminator => &mut discarded.terminator,
            Mismatch::Check => &mut discarded.check,
            Mismatch::LineEvent => &mut discarded.line_event,
        } += count;
        self.lost |= count > 0;
    }

    /// The line event behind them. What it drops is told by [`Self::dropped`].
    pub(crate) fn line_event(&mut self, event: LineEvent) {
        let events = &mut self.counters.events;
        *match event {
            LineEvent::Framing => &mut events.framing,
            LineEvent::Parity => &mut events.parity,
            LineEvent::Overrun => &mut events.overrun,
            LineEvent::Break => &mut events.line_break,
            LineEvent::Idle => &mut events.idle,
        } += 1;
    }
}
