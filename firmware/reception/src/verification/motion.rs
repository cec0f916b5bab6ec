//! What the handler reads if the chip moves while it runs.
//!
//! The model's chip is the one at the round's *moment*: see [`interleaving`](super::interleaving). What the
//! handler reads before it is what was there at some earlier time; what it reads after, what is there later.
//! An access for which [`Motion`] cannot say how old or new it is fails.

use super::chip::{Chip, Dma, HALF, narrow};
use super::invariant::Handler;
use crate::{Event, Moment, State};

#[expect(clippy::struct_excessive_bools, reason = "as of a chip")]
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Motion {
    is_receiving: bool,
    /// The moment is within a round: when the handler reads the number of errors, or finds none.
    is_round: bool,
    is_past: bool,
    /// What had happened when the handler looked last, and when it last cleared each.
    then: Past,
    cleared: Past,
    /// How often RXSTARTED has come at the moment. For the open half it comes before the first ENDRX, and
    /// counts if it was not seen.
    starts: u8,
    unseen: u8,
    /// The count when the line was silent.
    silent_at: Option<u8>,
    has_seen_silence: bool,
    /// After the moment there are errors, the last one at this count.
    errs: bool,
    at_error: u8,
    /// After the moment a half has ended, at this count.
    has_ended: bool,
    at_end: u8,
    has_seen_start: bool,
}

/// How often something had happened.
#[derive(Clone, Copy, PartialEq, Eq, Default, kani::Arbitrary)]
struct Past {
    starts: u8,
    ends: u8,
    timed_out: bool,
}

/// How often RXSTARTED has come since the last one that the handler saw.
pub(super) fn starts(chip: &Chip, reception: &Handler) -> u8 {
    let waits = u8::from(chip.dma == Dma::Restarting);
    (chip.ends + u8::from(!reception.named)).wrapping_sub(waits)
}

impl Motion {
    /// The chip moves before the moment and after it.
    pub(super) fn around(chip: &Chip, reception: &Handler) -> Self {
        let motion = Self {
            is_receiving: reception.state == State::Receiving,
            is_round: true,
            is_past: false,
            then: Past::default(),
            cleared: Past::default(),
            starts: starts(chip, reception),
            unseen: u8::from(!reception.named),
            silent_at: reception.silent_at.and_then(narrow),
            has_seen_silence: false,
            errs: kani::any(),
            at_error: kani::any(),
            has_ended: false,
            at_end: kani::any(),
            has_seen_start: false,
        };
        let begun_at = narrow(reception.begun_at).unwrap_or_default();
        let next_end = begun_at + (chip.ends + 1) * HALF - 1;
        kani::assume(motion.at_error >= chip.at_error && motion.at_end >= next_end);
        motion
    }

    /// The moment is now.
    pub(super) fn from_here(chip: &Chip, reception: &Handler) -> Self {
        Self {
            is_past: true,
            is_round: false,
            ..Self::around(chip, reception)
        }
    }

    /// Time passes until the handler looks, and the moment is still to come.
    fn pass(&mut self, chip: &Chip) {
        let (before, then): (Past, Past) = (self.then, kani::any());
        let is_later = before.starts <= then.starts
            && before.ends <= then.ends
            && (!before.timed_out || then.timed_out);
        let is_past = then.ends <= chip.ends && (!then.timed_out || chip.timed_out);
        kani::assume(is_later && is_past);
        if self.is_receiving {
            // A half that has ended may wait for RXSTARTED.
            let most = then.ends + self.unseen;
            kani::assume(then.starts <= self.starts.min(most) && then.starts + 1 >= most);
        } else {
            // After RXTO no half ends.
            kani::assume(!then.timed_out || then.ends == chip.ends);
        }
        self.then = then;
    }
}

impl Chip {
    /// After the moment a half has ended, and the handler could know it.
    pub(super) fn has_ended(&self) -> bool {
        self.motion.is_some_and(|motion| motion.has_ended)
    }

    /// The handler knows that a half has begun.
    pub(super) fn has_seen_start(&self) -> bool {
        self.motion.is_some_and(|motion| motion.has_seen_start)
    }

    /// What the handler sees of an event, if the chip alone does not say it.
    pub(super) fn look(&mut self, event: Event) -> Option<bool> {
        let mut motion = self.motion?;
        if motion.is_past {
            return self.look_again(event);
        }
        motion.pass(self);
        let Motion { then, cleared, .. } = &mut motion;
        let seen = match event {
            Event::Started => {
                let seen = then.starts > cleared.starts;
                cleared.starts = then.starts;
                motion.has_seen_start |= seen;
                seen
            }
            Event::Ended => {
                let seen = then.ends > cleared.ends;
                cleared.ends = then.ends;
                seen
            }
            Event::TimedOut => {
                let seen = then.timed_out && !cleared.timed_out;
                cleared.timed_out = then.timed_out;
                seen
            }
            // If there was a silence, the handler's state has its count at the moment.
            Event::Silent => {
                motion.has_seen_silence = motion.silent_at.is_some() && kani::any();
                motion.has_seen_silence
            }
            Event::Gap => kani::any(),
            Event::Error => self.error,
        };
        self.motion = Some(motion);
        if event == Event::Error {
            if seen {
                self.error = kani::any();
            } else {
                self.moment();
            }
        }
        Some(seen)
    }

    /// After the moment.
    fn look_again(&mut self, event: Event) -> Option<bool> {
        let is_round = self.motion?.is_round;
        match event {
            Event::Ended => self.ends_meanwhile().then_some(true),
            Event::TimedOut => {
                assert!(
                    !self.stopping,
                    "RXTO that was asked for is not cleared unseen"
                );
                // Unasked it may come again.
                let seen = self.timed_out;
                self.timed_out = self.short && kani::any();
                Some(seen)
            }
            // The end of a round is a round of its own.
            Event::Gap if is_round => Some(false),
            Event::Gap => None,
            Event::Started | Event::Silent | Event::Error => {
                assert!(
                    !self.runs,
                    "what came since the moment is not cleared unseen"
                );
                None
            }
        }
    }

    /// The moment has come: the events are those that the handler has not cleared.
    fn moment(&mut self) {
        let Some(motion) = &mut self.motion else {
            return;
        };
        let Past {
            starts,
            ends,
            timed_out,
        } = motion.cleared;
        motion.is_past = true;
        self.ends -= ends;
        self.ended = self.ends > 0;
        if motion.is_receiving {
            self.started = starts < motion.starts;
        }
        self.timed_out = if motion.is_receiving {
            kani::any()
        } else {
            self.timed_out && !timed_out
        };
    }

    /// For what may be done sooner than the handler does it, and not later.
    pub(super) fn must_be_past(&self) {
        let is_past = self.motion.is_none_or(|motion| motion.is_past);
        assert!(is_past, "not before the moment");
    }

    /// Whether a half has ended since the moment. Another may, until a full half starts no other.
    pub(super) fn ends_meanwhile(&mut self) -> bool {
        self.must_be_past();
        let short = self.short;
        self.motion.as_mut().is_some_and(|motion| {
            motion.has_ended |= motion.is_receiving && short && kani::any();
            motion.has_ended
        })
    }

    /// The count that the handler reads; `count` is the one at the moment.
    pub(super) fn count_meanwhile(&mut self, moment: Moment, count: u8) -> u8 {
        let Some(motion) = self.motion else {
            return count;
        };
        if moment == Moment::Error {
            self.must_be_past();
        }
        match moment {
            Moment::End if self.ends_meanwhile() => motion.at_end,
            Moment::Error if motion.errs => motion.at_error,
            Moment::Silent => {
                let is_seen = motion.has_seen_silence && !motion.is_past;
                assert!(is_seen, "it is read when the silence was seen");
                motion.silent_at.unwrap_or(count)
            }
            Moment::Now => {
                assert!(!motion.is_round || !self.runs, "it does not stay as it is");
                count
            }
            Moment::End | Moment::Error => count,
        }
    }

    /// How many errors the handler reads. The moment is when it does so first.
    pub(super) fn errors_meanwhile(&mut self) -> u8 {
        match self.motion {
            Some(motion) if !motion.is_past => {
                self.moment();
                self.errors
            }
            Some(motion) => self.errors + u8::from(motion.errs),
            None => self.errors,
        }
    }
}
