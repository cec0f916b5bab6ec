//! What the handler reads of the chip, and writes.

use framelock::LineEvent;

use super::chip::{Byte, Chip, Dma, FIFO, HALF, wide};
use crate::{Causes, Event, Half, Moment, Registers};

impl Chip {
    /// The handler hands on a byte.
    fn hand_on(&mut self, byte: Byte) {
        assert!(self.expected <= byte.number, "S1: in order, none twice");
        let follows = byte.number == self.expected && !byte.broken;
        assert!(follows || self.reported, "S2: a loss is reported");
        self.expected = byte.number.wrapping_add(1);
        self.reported = false;
        self.fed = self.fed.wrapping_add(1);
    }
}

impl Registers for Chip {
    fn happened(&mut self, event: Event) -> bool {
        if let Some(seen) = self.look(event) {
            return seen;
        }
        let flag = match event {
            Event::Started => &mut self.started,
            Event::Ended => {
                self.ends = 0;
                &mut self.ended
            }
            Event::TimedOut => &mut self.timed_out,
            Event::Error => &mut self.error,
            Event::Silent => &mut self.silent,
            Event::Gap => &mut self.gap,
        };
        core::mem::take(flag)
    }

    fn count(&mut self, moment: Moment) -> u32 {
        let count = match moment {
            Moment::Now => self.count,
            Moment::End => self.at_end,
            Moment::Error => self.at_error,
            Moment::Silent => self.at_silence,
        };
        wide(self.count_meanwhile(moment, count))
    }

    fn errors(&mut self) -> u32 {
        wide(self.errors_meanwhile())
    }

    fn causes(&mut self) -> Causes {
        Causes {
            overrun: core::mem::take(&mut self.overrun),
            ..Causes::default()
        }
    }

    fn amount(&mut self) -> u32 {
        self.ends_meanwhile();
        self.amount.into()
    }

    fn listen_to_errors(&mut self, listen: bool) {
        self.listening = listen;
    }

    fn name(&mut self, half: Half) {
        self.ends_meanwhile();
        self.named = half;
    }

    fn start(&mut self) {
        self.must_be_past();
        let is_off = !self.runs && !self.stopping && !self.flushing && self.dma == Dma::Closed;
        assert!(is_off, "the UARTE is started when it is off");
        self.held = 0;
        self.runs = true;
        self.short = true;
        self.named = Half::First;
        self.dma = Dma::Restarting;
        self.restart();
    }

    fn last_half(&mut self) {
        self.ends_meanwhile();
        self.short = false;
    }

    fn stop(&mut self) {
        self.must_be_past();
        self.stopping = true;
    }

    fn flush(&mut self) {
        self.must_be_past();
        assert!(!self.runs, "the UARTE is flushed when the receiver is off");
        self.flushing = true;
    }

    fn switch_off_and_on(&mut self) {
        self.must_be_past();
        self.runs = false;
        self.stopping = false;
        self.flushing = false;
        self.short = false;
        self.ready_due = false;
        self.dma = Dma::Closed;
    }

    fn feed(&mut self, half: Half, from: u32, to: u32) {
        assert!(from <= to && to <= HALF.into(), "bytes of the half");
        self.must_be_past();
        for at in 0..HALF {
            if from <= at.into() && u32::from(at) < to {
                assert!(self.named != half, "S1: it cannot be overwritten");
                let is_stored = self.writing != half || at < self.done;
                assert!(is_stored, "S1: it is stored");
                let [first, second] = self.memory;
                self.hand_on(match half {
                    Half::First => first[usize::from(at)],
                    Half::Second => second[usize::from(at)],
                });
            }
        }
    }

    fn feed_flushed(&mut self, count: u32) {
        assert!(count <= self.held.into(), "S1: it is stored");
        self.must_be_past();
        for at in 0..FIFO {
            if u32::from(at) < count {
                self.hand_on(self.fifo[at as usize]);
            }
        }
    }

    fn report(&mut self, event: LineEvent) {
        let _ = event;
        self.reported = true;
    }
}
