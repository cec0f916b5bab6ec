//! What the firmware's reception decides, without the hardware: which bytes the receiver sees.
//!
//! EasyDMA brings one byte at a time. At each ENDRX the handler reads the byte, starts the next transfer,
//! and the receiver makes one step. Nothing else starts a transfer, so no byte is overwritten before
//! it is read; what comes meanwhile waits in the UARTE's FIFO.
//!
//! ```text
//!            ┌───────────┐    line error: report it    ┌──────────┐
//!  begin ──► │ Receiving │ ──────────────────────────► │ Draining │ ◄─┐ line error: report it
//!        ┌─► │           │ ◄────────────────────────── │          │ ──┘
//!        │   └───────────┘       no byte waits         └──────────┘ ◄─┐
//!        └─────┘   │                                     │  ▲   └─────┘
//!  ENDRX: start    │ ENDRX was lost: report an overrun   │  │   ENDRX: start the next transfer, drop the byte
//!  the next        ▼                                     ▼  │
//!  transfer,     ┌──────────────────────────────────────────┐
//!  hand the      │                 Stopping                 │
//!  byte on       └──────────────────────────────────────────┘  RXTO: switch off and on, start
//!
//!  in Receiving and Draining: a gap: report it
//! ```
//!
//! **Draining.** No register says between which bytes an error came. So it is reported, and all that
//! comes out from then on is dropped, until a transfer has been open for `NONE_WAITS` and has brought
//! nothing: then the FIFO is empty, and every later byte comes behind the error. Nothing is handed on
//! meanwhile, so the one report stands between the bytes of both sides.
//!
//! **Events only wake.** What a round does is decided by what stays until it is taken: the time, ERRORSRC,
//! ENDRX. The main loop asks for a round at each tick, so any other event that is lost, doubled or late
//! costs a tick at most. For ENDRX the memory tells: a byte that lies there for a tick was never seen; one that
//! comes again is cleared before the next transfer.
//!
//! **Stopping.** After a lost ENDRX the UARTE is switched off and on. A running receiver is stopped first: STOPRX,
//! then RXTO, five byte times later. No handler waits for RXTO; it interrupts. If RXTO is lost, the first tick
//! after twice `GAP` ends the wait. RXTO may also come too early: then the UARTE is switched off while it runs.
//! Bytes that arrive meanwhile are lost, after the report.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(kani)]
extern crate kani;
#[cfg(kani)]
mod verification;

use framelock::LineEvent;

/// What memory holds when the byte was taken out. It may be any value: a byte that looks the same is
/// missed only if its ENDRX is lost too, and then until the FIFO is full.
pub const NO_BYTE: u8 = 0xEE;

/// Line errors that interrupt from one tick to the next. Later ones wake nobody, so a flood of errors
/// leaves time for all else; they are seen with the next byte, before it is handed on, or at the tick.
/// Several of them count as one.
pub const ERRORS_A_TICK: u8 = 32;

/// Restarts without a byte between them, after which the reception does not work.
const MOST_RESTARTS: u16 = 8;

/// ERRORSRC: a byte was lost since the FIFO was full.
const OVERRUN: u32 = 1;
/// By the bits of ERRORSRC.
const EVENTS: [LineEvent; 4] = [
    LineEvent::Overrun,
    LineEvent::Parity,
    LineEvent::Framing,
    LineEvent::Break,
];

/// The hardware, and the receiver that takes the bytes.
pub trait Registers {
    /// The timer: for how long the transfer has been open.
    fn open_for(&mut self) -> u32;
    /// Sets the timer to 0.
    fn restart_timer(&mut self);
    /// Whether ENDRX has come since [`start`](Self::start), which clears it.
    fn ended(&mut self) -> bool;
    /// Clears ERROR, then reads ERRORSRC and clears the causes that were read. If there are none, it writes nothing:
    /// any write may clear all causes.
    fn take_causes(&mut self) -> u32;
    /// What memory holds.
    fn byte(&mut self) -> u8;
    /// Writes [`NO_BYTE`] to memory, clears ENDRX, opens a transfer (STARTRX), and sets the timer to 0.
    fn start(&mut self);
    /// Clears RXTO, stops the receiver (STOPRX), and sets the timer to 0. Only RXTO interrupts from here on.
    fn stop(&mut self);
    /// Whether RXTO has come since [`stop`](Self::stop).
    fn stopped(&mut self) -> bool;
    /// Switches the UARTE off and on, which empties the FIFO, clears ERRORSRC, and starts.
    fn start_anew(&mut self);
    /// Sets whether ERROR interrupts, and the timer at `NONE_WAITS`. ENDRX does, RXTO does not.
    fn listen(&mut self, to_errors: bool, to_none_waits: bool);
    /// Hands on a byte.
    fn push(&mut self, byte: u8);
    /// Reports an event behind the bytes handed on.
    fn report(&mut self, event: LineEvent);
}

/// The states of the diagram above.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum State {
    #[default]
    Receiving,
    Draining,
    Stopping,
}

/// Since the last byte came. It fills a word, so that it is cleared by one instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct SinceByte {
    /// The gap was reported.
    in_gap: bool,
    /// At the last tick a byte lay in memory, and no transfer was started since.
    lay_there: bool,
    restarts: u16,
}

/// The reception. `NONE_WAITS`: in this time a byte that waits in the FIFO is stored once a transfer is
/// open. `GAP`: after this time without a byte no frame goes on (L1).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Reception<const NONE_WAITS: u32, const GAP: u32> {
    state: State,
    since_byte: SinceByte,
    /// Since the last tick: how many line errors, and whether a round was.
    errors: u8,
    served: bool,
    /// Bytes that were received and dropped, since they may have come before an error. Counts wrap.
    pub skipped: u32,
    /// How often the UARTE was switched off and on, since an ENDRX was lost.
    pub restarts: u32,
}

impl<const NONE_WAITS: u32, const GAP: u32> Reception<NONE_WAITS, GAP> {
    /// Starts the UARTE, which has just been switched on.
    pub fn begin(registers: &mut impl Registers) -> Self {
        let reception = Self::default();
        reception.listen(registers);
        registers.start();
        reception
    }

    /// The handler: one round.
    #[inline]
    pub fn service(&mut self, registers: &mut impl Registers) {
        self.served = true;
        // In this order: if the time is over and then there is no ENDRX, no byte has waited; if the byte is
        // there and then there is no error, it came before any.
        let open_for = registers.open_for();
        if self.state == State::Stopping {
            return self.wait_for_stop(open_for, registers);
        }
        let ended = registers.ended();
        let byte = registers.byte();
        let causes = registers.take_causes();
        if open_for >= GAP && !self.since_byte.in_gap {
            self.since_byte.in_gap = true;
            registers.report(LineEvent::Idle);
        }
        if ended {
            registers.start();
            self.since_byte = SinceByte::default();
        }
        if causes != 0 {
            self.fail(ended, open_for, causes, registers);
        } else if self.state == State::Receiving {
            if ended {
                registers.push(byte);
            }
        } else if ended {
            self.skipped = self.skipped.wrapping_add(1);
        } else if open_for >= NONE_WAITS && byte == NO_BYTE {
            self.state = State::Receiving;
            self.listen(registers);
        }
    }

    /// Once a tick, with the handler held off; a round follows. Returns whether the reception works: if there
    /// are no rounds, or one ENDRX after another is lost, it does not, and nothing but a reset may help.
    pub fn tick(&mut self, registers: &mut impl Registers) -> bool {
        self.errors = 0;
        if self.state != State::Stopping {
            self.listen(registers);
            let lies_there = registers.byte() != NO_BYTE;
            let lay_there = core::mem::replace(&mut self.since_byte.lay_there, lies_there);
            // The first time its ENDRX may be about to come, or to be handled.
            if lay_there && lies_there && !registers.ended() {
                registers.report(LineEvent::Overrun);
                self.stop(registers);
            }
        }
        core::mem::take(&mut self.served) && self.since_byte.restarts < MOST_RESTARTS
    }

    /// A line error. The byte that came out with it, if one did, may be from before it.
    #[cold]
    #[inline(never)]
    fn fail(&mut self, ended: bool, open_for: u32, causes: u32, registers: &mut impl Registers) {
        self.errors = self.errors.saturating_add(1);
        self.skipped = self.skipped.wrapping_add(ended.into());
        // A full FIFO fills an open transfer, so ENDRX must have come by now: the time was over before, and if
        // the handler was interrupted since, ENDRX comes before the overrun.
        let is_full = causes & OVERRUN != 0 && open_for >= NONE_WAITS;
        if is_full && !ended && !registers.ended() {
            self.stop(registers);
        } else {
            self.drain(registers);
        }
        // Behind it, so that the time is over before the next byte comes.
        for (bit, event) in (0..).zip(EVENTS) {
            if causes >> bit & 1 == 1 {
                registers.report(event);
            }
        }
    }

    /// From now on what comes out is dropped, until none has waited for the time that begins now.
    fn drain(&mut self, registers: &mut impl Registers) {
        self.state = State::Draining;
        registers.restart_timer();
        self.listen(registers);
    }

    /// An ENDRX was lost.
    fn stop(&mut self, registers: &mut impl Registers) {
        self.state = State::Stopping;
        self.restarts = self.restarts.wrapping_add(1);
        self.since_byte.restarts = self.since_byte.restarts.saturating_add(1);
        registers.stop();
    }

    /// Starts the UARTE anew when the receiver has stopped.
    #[cold]
    #[inline(never)]
    fn wait_for_stop(&mut self, waited: u32, registers: &mut impl Registers) {
        if registers.stopped() || waited / 2 >= GAP {
            self.state = State::Draining;
            self.since_byte.lay_there = false;
            registers.start_anew();
            self.listen(registers);
        }
    }

    /// After too many errors only the tick wakes.
    fn listen(&self, registers: &mut impl Registers) {
        let few = self.errors < ERRORS_A_TICK;
        registers.listen(few, few && self.state == State::Draining);
    }
}
