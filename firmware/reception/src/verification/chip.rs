//! The chip behind [`Registers`]: UARTE0's receiver, EasyDMA, the timers that count, and memory.
//!
//! It moves in small steps: [`Chance`] says which, and what it leads to. [`Motion`] says what the handler
//! reads if the chip moves while a round runs.

use super::motion::Motion;
use crate::Half;

/// Bytes of a half in the model.
pub(super) const HALF: u8 = 2;
/// Bytes that the model's FIFO holds.
pub(super) const FIFO: u8 = 3;
/// The model counts from 0 to 255. To the handler its counts wrap.
const BASE: u32 = u32::MAX - 100;

/// Before a step or a round the model's counts are less.
pub(super) const MANY: u8 = 150;

/// The handler's count for one of the model's.
pub(super) fn wide(count: u8) -> u32 {
    BASE.wrapping_add(count.into())
}

/// The model's count for one of the handler's, if it has it.
pub(super) fn narrow(count: u32) -> Option<u8> {
    count.wrapping_sub(BASE).try_into().ok()
}

/// A byte that was received. It is known by its number.
#[derive(Clone, Copy, PartialEq, Eq, kani::Arbitrary)]
pub(super) struct Byte {
    pub(super) number: u8,
    /// Something was lost just before it, or it is spoilt itself.
    pub(super) broken: bool,
}

/// EasyDMA.
#[derive(Clone, Copy, PartialEq, Eq, kani::Arbitrary)]
pub(super) enum Dma {
    Closed,
    Open,
    /// The last byte of a half is stored; ENDRX is to come.
    Full,
    /// ENDRX has come and triggered STARTRX; RXSTARTED is to come.
    Restarting,
}

/// What the chip does next.
#[derive(Clone, Copy, PartialEq, Eq, kani::Arbitrary)]
pub(super) enum Step {
    Arrive,
    Ready,
    Store,
    End,
    Restart,
    FallSilent,
    TimeOut,
    TimeOutUnasked,
    EndFlush,
}

/// The next step, and what nothing else decides about it.
#[expect(clippy::struct_excessive_bools, reason = "each decides one thing")]
#[derive(Clone, Copy, PartialEq, Eq, kani::Arbitrary)]
pub(super) struct Chance {
    pub(super) step: Step,
    /// The byte is spoilt; if so, it is stored (parity) or not, and then counted or not; RXDRDY comes
    /// before ERROR.
    is_spoilt: bool,
    is_stored: bool,
    is_counted: bool,
    is_counted_first: bool,
    /// ENDRX sets AMOUNT though there was no byte.
    sets_amount: bool,
}

#[expect(clippy::struct_excessive_bools, reason = "a chip's flags")]
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Chip {
    pub(super) chance: Chance,
    /// The chip moves while the handler runs.
    pub(super) motion: Option<Motion>,
    /// The number of the next byte, and whether something is lost before it.
    pub(super) number: u8,
    pub(super) broken: bool,
    pub(super) fifo: [Byte; FIFO as usize],
    pub(super) held: u8,
    /// RXDRDY of the last byte is to come.
    pub(super) ready_due: bool,
    /// The receiver is on; STOPRX has been triggered; FLUSHRX has.
    pub(super) runs: bool,
    pub(super) stopping: bool,
    pub(super) flushing: bool,

    pub(super) dma: Dma,
    /// PTR, and the half that is written; how many bytes of it are.
    pub(super) named: Half,
    pub(super) writing: Half,
    pub(super) done: u8,
    pub(super) short: bool,
    pub(super) amount: u8,
    pub(super) memory: [[Byte; HALF as usize]; 2],

    pub(super) started: bool,
    pub(super) ended: bool,
    /// How many ENDRX have come since it was cleared.
    pub(super) ends: u8,
    pub(super) timed_out: bool,
    pub(super) error: bool,
    pub(super) listening: bool,
    pub(super) overrun: bool,
    pub(super) silent: bool,
    pub(super) gap: bool,
    /// The silence has been noticed; as a gap too.
    pub(super) silence_seen: bool,
    pub(super) gap_seen: bool,

    pub(super) count: u8,
    pub(super) at_end: u8,
    pub(super) at_error: u8,
    pub(super) at_silence: u8,
    pub(super) errors: u8,

    /// The number of the byte that is next if none is left out; whether there was an event since the
    /// last byte; how many were handed on.
    pub(super) expected: u8,
    pub(super) reported: bool,
    pub(super) fed: u8,
}

impl Chip {
    /// After a reset.
    pub(super) fn new() -> Self {
        let count = kani::any_where(|&count| count < MANY);
        let nothing = Byte {
            number: u8::MAX,
            broken: false,
        };
        Self {
            chance: kani::any(),
            motion: None,
            number: 0,
            broken: false,
            fifo: [nothing; FIFO as usize],
            held: 0,
            ready_due: false,
            runs: false,
            stopping: false,
            flushing: false,
            dma: Dma::Closed,
            named: Half::First,
            writing: Half::First,
            done: 0,
            short: false,
            amount: 0,
            memory: [[nothing; HALF as usize]; 2],
            started: false,
            ended: false,
            ends: 0,
            timed_out: false,
            error: false,
            listening: true,
            overrun: false,
            silent: false,
            gap: false,
            silence_seen: true,
            gap_seen: true,
            count,
            at_end: count,
            at_error: count,
            at_silence: count,
            errors: 0,
            expected: 0,
            reported: true,
            fed: 0,
        }
    }

    /// One thing happens, if it can.
    pub(super) fn step(&mut self) {
        match self.chance.step {
            Step::Arrive => self.arrive(),
            Step::Ready => self.ready(),
            Step::Store => self.store(),
            Step::End => self.end(),
            Step::Restart => self.restart(),
            Step::FallSilent => self.fall_silent(),
            Step::TimeOut => self.time_out(),
            Step::TimeOutUnasked => self.time_out_unasked(),
            Step::EndFlush => self.end_flush(),
        }
    }

    /// A byte comes. All that the one before has led to has happened, so EasyDMA does not stall.
    pub(super) fn arrive(&mut self) {
        let in_time = match self.dma {
            Dma::Open => self.held == 0,
            Dma::Full | Dma::Restarting => false,
            Dma::Closed => true,
        };
        if !in_time {
            return;
        }
        self.ready();
        if !self.runs {
            // Nobody hears it.
            self.broken = true;
            return;
        }
        if self.held == FIFO {
            self.overrun = true;
            return self.spoil();
        }
        if self.chance.is_spoilt {
            if !self.chance.is_stored {
                return self.spoil();
            }
            // Parity: it is stored.
            self.broken = true;
            self.accept();
            return self.fail();
        }
        self.accept();
    }

    fn accept(&mut self) {
        let byte = Byte {
            number: self.number,
            broken: self.broken,
        };
        for at in 0..FIFO {
            if at == self.held {
                self.fifo[usize::from(at)] = byte;
            }
        }
        self.held = self.held.wrapping_add(1);
        self.number = self.number.wrapping_add(1);
        self.broken = false;
        self.ready_due = true;
    }

    /// It is not stored; and perhaps counted.
    fn spoil(&mut self) {
        self.broken = true;
        self.ready_due = self.chance.is_counted;
        self.fail();
    }

    /// ERROR. RXDRDY may have come before.
    fn fail(&mut self) {
        // Without the spoilt byte.
        self.at_error = self.count;
        if self.chance.is_counted_first {
            self.ready();
        }
        self.error = true;
        self.errors = self.errors.wrapping_add(1);
    }

    /// RXDRDY.
    pub(super) fn ready(&mut self) {
        if self.ready_due {
            self.ready_due = false;
            self.count = self.count.wrapping_add(1);
            self.silence_seen = false;
            self.gap_seen = false;
        }
    }

    /// EasyDMA stores a byte.
    pub(super) fn store(&mut self) {
        if self.dma != Dma::Open || self.held == 0 {
            return;
        }
        for half in [Half::First, Half::Second] {
            for at in 0..HALF {
                if half == self.writing && at == self.done {
                    self.memory[half as usize][usize::from(at)] = self.fifo[0];
                }
            }
        }
        self.fifo[0] = self.fifo[1];
        self.fifo[1] = self.fifo[2];
        self.held = self.held.wrapping_sub(1);
        self.done = self.done.wrapping_add(1);
        if self.done == HALF {
            self.dma = Dma::Full;
        }
    }

    /// ENDRX of a full half; or of one that is stopped, perhaps with bytes left in the FIFO.
    pub(super) fn end(&mut self) {
        if self.dma == Dma::Full || self.stopping && self.dma == Dma::Open {
            self.say_ended(self.done);
            self.dma = if self.short {
                Dma::Restarting
            } else {
                Dma::Closed
            };
        }
    }

    /// ENDRX. If there was no byte AMOUNT may keep its value.
    fn say_ended(&mut self, amount: u8) {
        if amount > 0 || self.chance.sets_amount {
            self.amount = amount;
        }
        self.ended = true;
        self.ends = self.ends.wrapping_add(1);
        self.at_end = self.count;
    }

    /// RXSTARTED.
    pub(super) fn restart(&mut self) {
        if self.dma == Dma::Restarting {
            self.writing = self.named;
            self.done = 0;
            self.dma = Dma::Open;
            self.started = true;
        }
    }

    /// Three byte times of silence; and then a gap.
    pub(super) fn fall_silent(&mut self) {
        let is_settled = match self.dma {
            Dma::Open => self.held == 0,
            Dma::Closed => true,
            Dma::Full | Dma::Restarting => false,
        };
        if self.ready_due || !is_settled {
            return;
        }
        if !self.silence_seen {
            self.silence_seen = true;
            self.silent = true;
            self.at_silence = self.count;
        } else if !self.gap_seen {
            self.gap_seen = true;
            self.gap = true;
        }
    }

    /// RXTO.
    pub(super) fn time_out(&mut self) {
        if self.stopping && self.dma == Dma::Closed {
            self.ready();
            self.stopping = false;
            self.runs = false;
            self.timed_out = true;
        }
    }

    /// RXTO while nobody has stopped the UARTE.
    pub(super) fn time_out_unasked(&mut self) {
        if self.short {
            self.timed_out = true;
        }
    }

    /// ENDRX of the flush.
    pub(super) fn end_flush(&mut self) {
        if self.flushing {
            self.flushing = false;
            self.say_ended(self.held);
        }
    }

    /// No interrupt comes before something happens.
    pub(super) fn is_quiet(&self) -> bool {
        let error = self.error && self.listening;
        !(self.started || self.ended || self.timed_out || error || self.silent || self.gap)
    }
}
