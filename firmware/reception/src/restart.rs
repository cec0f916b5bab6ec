//! Stopping the UARTE, emptying it, and starting it anew.

use framelock::LineEvent;

use crate::{Event, FIFO, Moment, PATIENCE, Reception, Registers, State, Stop, report};

impl<const HALF: u32> Reception<HALF> {
    /// Stops the UARTE, to start it anew.
    #[cold]
    #[inline(never)]
    pub(crate) fn stop(&mut self, Stop { exact }: Stop, registers: &mut impl Registers) {
        self.amount = registers.amount();
        registers.listen_to_errors(false);
        registers.last_half();
        // If the open half has ended meanwhile, AMOUNT will be the other's.
        let exact = exact && !registers.happened(Event::Ended);
        registers.clear(Event::TimedOut);
        registers.stop();
        self.state = State::Stopping { exact };
        self.follows = false;
        self.waited = 0;
    }

    /// A round while the UARTE stops or is flushed: in the end it is started anew.
    #[cold]
    #[inline(never)]
    pub(crate) fn restart(&mut self, registers: &mut impl Registers) {
        registers.clear(Event::Started);
        // In this order: the end that comes before the time-out is not taken for the flush's, and the
        // errors before the end are seen.
        let timed_out = registers.happened(Event::TimedOut);
        let ended = registers.happened(Event::Ended);
        registers.clear(Event::Silent);
        registers.clear(Event::Gap);
        let errors = self.errors(registers);
        if let Some(errors) = &errors {
            // Where, nobody knows: nothing that comes follows what was taken.
            report(errors, registers);
            self.follows = false;
        }
        let mut is_over = false;
        match self.state {
            State::Receiving => {}
            State::Stopping { exact } => {
                let exact = exact && errors.is_none();
                if ended && exact {
                    self.take_stored(registers);
                }
                self.state = State::Stopping {
                    exact: exact && !ended,
                };
                if timed_out {
                    registers.flush();
                    self.state = State::Flushing;
                }
            }
            State::Flushing => {
                if ended {
                    let flushed = registers.amount();
                    // If nothing was left it is as before.
                    if self.follows && flushed != self.amount && flushed <= FIFO {
                        registers.feed_flushed(flushed);
                    }
                }
                is_over = ended;
            }
        }
        self.waited = self.waited.wrapping_add(1);
        if !is_over && self.waited >= PATIENCE {
            registers.switch_off_and_on();
            is_over = true;
        }
        if is_over {
            self.begin_again(registers);
        }
    }

    /// Takes what has been stored in the open half, which AMOUNT says.
    fn take_stored(&mut self, registers: &mut impl Registers) {
        let stored = registers.amount();
        let received = self.since_begun(registers.count(Moment::End));
        // If nothing was stored, AMOUNT may be as before; but then only spoilt bytes were counted, and
        // the one that may wait in the FIFO.
        if stored != self.amount || received > self.doubt.saturating_add(1) {
            self.take(stored.min(HALF), registers);
            self.amount = stored;
            self.follows = true;
        }
    }

    /// Starts the UARTE anew. What came since the last byte that was taken is lost, and what came while
    /// it was off was not even counted.
    pub(crate) fn begin_again(&mut self, registers: &mut impl Registers) {
        let taken = self.begun_at.wrapping_add(self.taken);
        let lost = registers.count(Moment::Now).wrapping_sub(taken);
        if lost <= u32::MAX / 2 {
            self.skipped = self.skipped.wrapping_add(lost);
        }
        registers.report(LineEvent::Overrun);
        self.begin(registers);
    }
}
