//! What the firmware's reception decides, without the hardware.
//!
//! The UARTE writes what it receives to two halves of a buffer by turns. When one is full it goes on
//! with the other by itself. [`Reception`] says which bytes may be read, in which order, and when the
//! UARTE must be started anew; [`Registers`] is the chip as it sees it.
//!
//! ```text
//!            ┌──────── a half is full: take it, then name it to follow the other ◄──┐
//!            ▼                                                                      │
//!      ┌───────────┐ ────────────────────────────────────────────────────────────►──┘
//! ───► │ Receiving │ ── silence: take what has come ──► (Receiving)
//!      └───────────┘ ◄──────────────────────────────────────────────────────────┐
//!            │ late handler, overrun, or a gap after a line error               │ emptied
//!            ▼                                                                  │
//!      ┌───────────┐           receiver has stopped               ┌───────────┐ │
//!      │ Stopping  ├─────────────────────────────────────────────►│ Flushing  ├─┘
//!      └───────────┘                                              └───────────┘
//!   Stopping, Flushing: after `PATIENCE` rounds the UARTE is switched off and on: Receiving.
//! ```
//!
//! **A half is named only when all of it has been taken.** Until then the UARTE, however late the
//! handler is, overwrites the other half and never the one that is read. So no byte is read while it
//! is written, and what is late shows at one place: if a second half was full before the first one
//! was named again, that second half is given up.
//!
//! **Counts.** TIMER1 counts bytes received, and keeps its count at each half's end, at each error and
//! when the line falls silent. A byte is stored before the line has been silent for three byte times
//! and before the next byte or error is over. After a line error counts may be too high, since the
//! specification does not say whether a byte that was not stored is counted: `doubt` says by how many.
//! The last `doubt` bytes are then left until others follow, or until a gap: there the UARTE is
//! stopped, which cuts no frame and tells how many bytes it has stored. So the last frame before a
//! silence comes that much later, until the UARTE has been started anew.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(kani)]
extern crate kani;

mod registers;
mod restart;
#[cfg(kani)]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    reason = "what goes wrong is what a harness would find"
)]
mod verification;

use framelock::LineEvent;

pub use registers::{Causes, Event, Half, Moment, Registers};

/// Where the reception is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    /// The UARTE stores bytes.
    Receiving,
    /// Until the receiver is off. `exact`: AMOUNT will say how many bytes are in the open half.
    Stopping {
        /// See above.
        exact: bool,
    },
    /// Until what it still holds is in memory.
    Flushing,
}

/// Rounds after which a UARTE that does not stop is switched off and on.
const PATIENCE: u32 = 8;

/// Errors for which the handler runs from one tick to the next. Later ones are seen when something else
/// happens.
const ERRORS_A_TICK: u32 = 8;

/// After a line error: ticks without a byte until the UARTE is stopped, to set the counts right. Longer
/// than any frame pauses, so that none is cut.
pub const QUIET_TICKS: u32 = 3;

/// Bytes that the UARTE holds at most.
pub const FIFO: u32 = 6;

/// How far what the UARTE has received has been taken. `HALF`: bytes of a half, at least 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reception<const HALF: u32> {
    state: State,
    /// The half that is being filled, how many bytes of it have been taken or left out, and the count
    /// of bytes when it was begun.
    open: Half,
    taken: u32,
    begun_at: u32,
    /// The other half is named to follow the open one.
    named: bool,
    /// Counts since `begun_at` may be too high by that many.
    doubt: u32,
    errors_seen: u32,
    /// So many errors interrupt until the next tick.
    errors_left: u32,
    /// In doubt: the count at the last tick, and for how many ticks it has been the same.
    count_at_tick: u32,
    quiet_for: u32,
    /// The count when the line was silent, if its bytes are still to be taken.
    silent_at: Option<u32>,
    /// While stopping: AMOUNT when it was looked at last; what the flush brings follows directly what
    /// was taken; rounds.
    amount: u32,
    follows: bool,
    waited: u32,
    late: u32,
    skipped: u32,
    rounds: u32,
}

/// Line errors that have not been reported.
struct Errors {
    causes: Causes,
    count: u32,
    /// So many bytes of the open half certainly came before the first of them; and only behind so many
    /// it is certain that a byte came after the last.
    first: u32,
    last: u32,
}

/// The UARTE must be stopped, to be started anew.
struct Stop {
    /// AMOUNT will say how many bytes are in the open half.
    exact: bool,
}

impl<const HALF: u32> Reception<HALF> {
    /// Nothing has begun: [`Self::begin`] is next.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            state: State::Receiving,
            open: Half::First,
            taken: 0,
            begun_at: 0,
            named: false,
            doubt: 0,
            errors_seen: 0,
            errors_left: ERRORS_A_TICK,
            count_at_tick: 0,
            quiet_for: 0,
            silent_at: None,
            amount: 0,
            follows: false,
            waited: 0,
            late: 0,
            skipped: 0,
            rounds: 0,
        }
    }

    /// How often the handler has run while receiving. The watchdog is fed only if it goes on.
    #[must_use]
    pub fn rounds(&self) -> u32 {
        self.rounds
    }

    /// How often the handler came too late.
    #[must_use]
    pub fn late(&self) -> u32 {
        self.late
    }

    /// Bytes that were received and left out, since it is not certain which they are.
    #[must_use]
    pub fn skipped(&self) -> u32 {
        self.skipped
    }

    /// Once a tick. Returns whether the handler must run, though nothing may have happened.
    pub fn tick(&mut self, registers: &mut impl Registers) -> bool {
        if self.state == State::Receiving && self.errors_left < ERRORS_A_TICK {
            self.errors_left = ERRORS_A_TICK;
            registers.listen_to_errors(true);
        }
        if self.doubt != 0 && self.state == State::Receiving {
            let count = registers.count(Moment::Now);
            self.quiet_for = if count == self.count_at_tick {
                self.quiet_for.saturating_add(1)
            } else {
                0
            };
            self.count_at_tick = count;
            if self.quiet_for >= QUIET_TICKS {
                self.stop(Stop { exact: self.named }, registers);
            }
        }
        self.state != State::Receiving
    }

    /// Starts the UARTE, which is off, with empty halves.
    pub fn begin(&mut self, registers: &mut impl Registers) {
        self.state = State::Receiving;
        self.open = Half::First;
        self.taken = 0;
        self.begun_at = registers.count(Moment::Now);
        self.named = false;
        self.doubt = 0;
        self.errors_left = ERRORS_A_TICK;
        self.quiet_for = 0;
        self.silent_at = None;
        registers.clear(Event::TimedOut);
        registers.clear(Event::Started);
        registers.clear(Event::Ended);
        registers.listen_to_errors(true);
        registers.start();
    }

    /// The handler: one round.
    #[inline]
    pub fn service(&mut self, registers: &mut impl Registers) {
        if self.state == State::Receiving {
            self.rounds = self.rounds.wrapping_add(1);
            if let Some(stop) = self.receive(registers) {
                self.stop(stop, registers);
            }
        } else {
            self.restart(registers);
        }
    }

    #[inline]
    fn receive(&mut self, registers: &mut impl Registers) -> Option<Stop> {
        // Nobody has stopped the UARTE: it means nothing, and must not come again and again.
        registers.clear(Event::TimedOut);
        // In this order: if the next half was started, the last one's end is seen too; if an error
        // came before the silence or the end, it is seen too.
        let started = registers.happened(Event::Started);
        let ended = registers.happened(Event::Ended);
        if registers.happened(Event::Silent) {
            self.silent_at = Some(registers.count(Moment::Silent));
        }
        let mut errors = self.errors(registers);
        if let Some(errors) = &errors
            && (errors.causes.overrun || !ended && registers.happened(Event::Ended))
        {
            // No count says which bytes are sound: at an overrun what was counted last still waits to
            // be stored; and if the half ended just now, the errors may be in the next one.
            report(errors, registers);
            return Some(Stop { exact: false });
        }

        if ended {
            if !self.named {
                // The full half was begun again, and is being overwritten.
                return Some(self.be_late());
            }
            let end = registers.count(Moment::End);
            let ends = self.ends(end);
            errors = self.take_full_half(errors, end, registers);
            if ends > 1 {
                return Some(self.be_late());
            }
        }
        if started {
            registers.name(self.open.other());
            self.named = true;
        }
        if (started || ended) && self.ends(registers.count(Moment::End)) > 0 {
            // The open half was full before the other was named: it may have been begun again.
            return Some(self.be_late());
        }
        if let Some(errors) = &errors {
            self.leave_out(errors, registers);
        }
        if let Some(count) = self.silent_at {
            let received = count.wrapping_sub(self.begun_at);
            if received > u32::MAX / 2 {
                // It was silent before the half that was just taken was full.
                self.silent_at = None;
            } else if self.named && received <= HALF.saturating_add(self.doubt) {
                self.silent_at = None;
                self.take(received.saturating_sub(self.doubt), registers);
            }
        }
        self.end_at_gap(registers)
    }

    /// In doubt: nothing goes on across a gap, so the UARTE can be stopped.
    #[inline]
    fn end_at_gap(&mut self, registers: &mut impl Registers) -> Option<Stop> {
        if registers.happened(Event::Gap) {
            if self.doubt != 0 {
                // No frame goes on across a gap: none is cut.
                return Some(Stop { exact: self.named });
            }
            registers.report(LineEvent::Idle);
        }
        None
    }

    /// Takes the open half, which is full, and goes on to the other. Returns errors that came behind
    /// the full one.
    #[inline]
    fn take_full_half(
        &mut self,
        errors: Option<Errors>,
        end: u32,
        registers: &mut impl Registers,
    ) -> Option<Errors> {
        // As counted. In doubt the end's own count says: the last byte may be counted after it.
        let counted = if self.doubt == 0 {
            HALF
        } else {
            end.wrapping_sub(self.begun_at)
        };
        let errors = errors.map(|errors| {
            let is_here = errors.first < counted;
            if is_here {
                self.leave_out(&errors, registers);
            }
            (is_here, errors)
        });
        self.take(HALF, registers);
        self.begun_at = if self.doubt == 0 {
            self.begun_at.wrapping_add(HALF)
        } else {
            end
        };
        self.doubt = self.doubt.min(1);
        self.open = self.open.other();
        self.taken = 0;
        self.named = false;
        let (is_here, errors) = errors?;
        let behind = Errors {
            first: errors.first.saturating_sub(counted),
            last: errors.last.saturating_sub(counted),
            ..errors
        };
        if is_here {
            // Reported already; nothing is handed on between them.
            self.skip(behind.last);
            self.doubt = self.doubt.saturating_add(errors.count);
            return None;
        }
        Some(behind)
    }

    /// How many halves have been full since the open one was begun, by the count at the last end: to
    /// the nearest, since the last byte may be counted only after the end.
    #[inline]
    fn ends(&self, end: u32) -> u32 {
        self.since_begun(end.wrapping_add(HALF / 2)) / HALF
    }

    /// How many bytes had been counted since the open half was begun. A count from before is none.
    #[inline]
    pub(crate) fn since_begun(&self, count: u32) -> u32 {
        let since = count.wrapping_sub(self.begun_at);
        if since > u32::MAX / 2 { 0 } else { since }
    }

    #[cold]
    #[inline(never)]
    fn be_late(&mut self) -> Stop {
        self.late = self.late.wrapping_add(1);
        Stop { exact: false }
    }

    /// Hands on the bytes of the open half up to `to`, all of which have been stored.
    #[inline(never)]
    fn take(&mut self, to: u32, registers: &mut impl Registers) {
        if !self.named {
            // What is in it may be overwritten.
            return self.skip(to);
        }
        if to > self.taken {
            registers.feed(self.open, self.taken, to);
            self.taken = to;
        }
    }

    /// Leaves out the bytes of the open half up to `to`.
    #[cold]
    #[inline(never)]
    fn skip(&mut self, to: u32) {
        let to = to.min(HALF);
        if to > self.taken {
            self.skipped = self.skipped.wrapping_add(to.wrapping_sub(self.taken));
            self.taken = to;
        }
    }

    /// Reports errors, behind the bytes that came before the first of them. What may have come between
    /// them is left out. From here on counts may be too high.
    #[cold]
    #[inline(never)]
    fn leave_out(&mut self, errors: &Errors, registers: &mut impl Registers) {
        self.take(errors.first.min(HALF), registers);
        self.skip(errors.last);
        report(errors, registers);
        self.doubt = self.doubt.saturating_add(errors.count);
    }

    #[inline]
    fn errors(&mut self, registers: &mut impl Registers) -> Option<Errors> {
        if !registers.happened(Event::Error) {
            return None;
        }
        self.read_errors(registers)
    }

    #[cold]
    #[inline(never)]
    fn read_errors(&mut self, registers: &mut impl Registers) -> Option<Errors> {
        // Errors without a pause would leave no time for anything else.
        self.errors_left = self.errors_left.saturating_sub(1);
        if self.errors_left == 0 {
            registers.listen_to_errors(false);
        }
        let causes = registers.causes();
        let total = registers.errors();
        let at = self.since_begun(registers.count(Moment::Error));
        // One that comes just now is left for the next round; but the place may be its own.
        let another = registers.errors() != total;
        let count = total.wrapping_sub(self.errors_seen);
        self.errors_seen = total;
        let first = if count == 1 && !another {
            at.saturating_sub(self.doubt)
        } else {
            0
        };
        // None: it came between the clearing of the event and the reading of the causes, last time.
        (count != 0).then_some(Errors {
            causes,
            count,
            first,
            last: at,
        })
    }
}

impl<const HALF: u32> Default for Reception<HALF> {
    fn default() -> Self {
        Self::new()
    }
}

fn report(errors: &Errors, registers: &mut impl Registers) {
    let Causes {
        overrun,
        parity,
        framing,
        line_break,
    } = errors.causes;
    for (present, event) in [
        (overrun, LineEvent::Overrun),
        (parity, LineEvent::Parity),
        (framing, LineEvent::Framing),
        (line_break, LineEvent::Break),
    ] {
        if present {
            registers.report(event);
        }
    }
    if errors.causes == Causes::default() {
        // Its cause was read together with an earlier one of its kind.
        registers.report(LineEvent::Framing);
    }
}
