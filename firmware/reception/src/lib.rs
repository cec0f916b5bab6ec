//! Decides which of the received bytes reach the firmware's receiver. Accesses the hardware only through [`Registers`].
//!
//! Each transfer of EasyDMA stores one byte, and ENDRX is the event at its end. At each ENDRX the handler reads the
//! byte, starts the next transfer, and hands the byte on to the receiver or drops it. A transfer is also started when
//! the UARTE is switched on. No other code starts a transfer, so no byte is overwritten before it is read, unless the
//! chip loses or duplicates an ENDRX. Bytes that arrive between two transfers wait in the UARTE's FIFO.
//!
//! A *round* is one run of the handler. A *tick* is one call of [`Reception::tick`] by the main loop. A byte *waits* if
//! it is in the FIFO. A gap is a silence that ends a frame. It is measured from STARTRX, or from a later line error, to
//! the round that reads the timer. So it includes the duration of the byte that ends the silence, and the delay of the
//! round. For a silence of S, choose `GAP` as the sum of S and the duration of a byte. Then rounds that are not late
//! report every silence longer than S, and none that is shorter. A late round may report a gap on a line without
//! pauses. Such a gap costs the frame that it ends, and is counted.
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
//!  in Receiving and Draining, at a gap: report it
//! ```
//!
//! **Draining.** No register tells between which bytes an error occurred. The reception therefore reports the error and
//! drops every byte that it reads from then on, until a transfer has been open for `NONE_WAITS` without storing a byte.
//! At that point the FIFO is empty, so every later byte was received after the error. No byte is handed on during the
//! drain, so a single report separates the bytes before the error from the bytes after it.
//!
//! **Events only wake.** The decisions of a round depend only on state that persists until the round reads it: the
//! timer, the byte in memory, ERRORSRC, ENDRX and RXTO. All other events only wake the handler. The main loop requests
//! a round at each tick. So if one of these other events is lost, duplicated or late, a decision is delayed by at most
//! one tick. A lost ENDRX is noticed in memory: a byte that lies there from one tick to the next was never read. An
//! ENDRX that comes twice before the next transfer counts once. A duplicate after STARTRX causes a spurious byte.
//!
//! **Stopping.** After a lost ENDRX, the UARTE is switched off and on. Before the UARTE is switched off, its receiver
//! must be stopped. So the reception triggers STOPRX, and RXTO follows five byte times after STOPRX. No handler has to
//! wait for RXTO, because RXTO causes an interrupt. If RXTO is lost, the wait ends in the first round that finds twice
//! the time `GAP` elapsed since STOPRX. If RXTO comes too early, the UARTE is switched off while its receiver still
//! runs. Bytes that arrive while the reception is stopping are lost, but the loss has already been reported.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(kani)]
extern crate kani;
// Kani prints the texts of assertions only for the macros of `std`.
#[cfg(kani)]
#[macro_use]
extern crate std;
#[cfg(kani)]
mod verification;

use framelock::LineEvent;

/// The value in memory while no byte is stored there. Any value would do. A received byte with this value goes
/// unnoticed only if its ENDRX is lost, and even then only until the FIFO overruns.
pub const NO_BYTE: u8 = 0xEE;

/// The largest number of line errors that may interrupt between two ticks. Further errors cause no interrupt, so that a
/// flood of errors leaves time for other code. The reception notices further errors before it hands on the next byte,
/// or at the tick. It reports several errors of one kind as one.
pub const ERRORS_A_TICK: u8 = 32;

/// After this number of restarts in a row without a byte, the reception counts as broken.
const MOST_RESTARTS: u16 = 8;

/// The bit of ERRORSRC for an overrun: a byte was lost because the FIFO was full.
const OVERRUN: u32 = 1;
/// The line events, in the order of ERRORSRC's bits.
const EVENTS: [LineEvent; 4] = [
    LineEvent::Overrun,
    LineEvent::Parity,
    LineEvent::Framing,
    LineEvent::Break,
];

/// The hardware's registers, and the receiver that takes the bytes.
pub trait Registers {
    /// Returns the timer's count: the time since the timer was last set to 0.
    fn open_for(&mut self) -> u32;
    /// Sets the timer to 0.
    fn restart_timer(&mut self);
    /// Returns whether ENDRX has come since [`start`](Self::start), which clears it.
    fn ended(&mut self) -> bool;
    /// Clears ERROR, then reads ERRORSRC and clears the causes that it has read. Must not write to ERRORSRC if no cause
    /// was set, because any write may clear all causes.
    fn take_causes(&mut self) -> u32;
    /// Returns the byte in memory, or [`NO_BYTE`] if no byte is stored there.
    fn byte(&mut self) -> u8;
    /// Writes [`NO_BYTE`] to memory, clears ENDRX, opens a transfer (STARTRX), and sets the timer to 0.
    fn start(&mut self);
    /// Clears RXTO, stops the receiver (STOPRX), and sets the timer to 0. Only RXTO interrupts from here on.
    fn stop(&mut self);
    /// Returns whether RXTO has come since [`stop`](Self::stop).
    fn stopped(&mut self) -> bool;
    /// Switches the UARTE off and on, which empties the FIFO. Then clears ERRORSRC and opens a transfer.
    fn start_anew(&mut self);
    /// Sets which events cause interrupts. `to_errors` switches the interrupt at ERROR on or off. `to_none_waits`
    /// switches another interrupt on or off, which comes when the timer reaches `NONE_WAITS`. From here on ENDRX causes
    /// interrupts, and RXTO does not.
    fn listen(&mut self, to_errors: bool, to_none_waits: bool);
    /// Hands on a byte to the receiver.
    fn push(&mut self, byte: u8);
    /// Reports an event that follows all bytes handed on so far.
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

/// The part of the state that is cleared when a byte is read. It fits into a word, so that one instruction clears it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct SinceByte {
    /// Whether the current gap was reported.
    in_gap: bool,
    /// Whether a byte lay in memory at the last tick and no transfer was started since.
    lay_there: bool,
    restarts: u16,
}

/// The state of the reception.
///
/// If a byte waits in the FIFO when a transfer is opened, the UARTE stores it within `NONE_WAITS` (assumption A1).
/// `GAP` is the timer's count from which a round reports a gap: the length of a silence plus the duration of the byte
/// after the silence.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Reception<const NONE_WAITS: u32, const GAP: u32> {
    state: State,
    since_byte: SinceByte,
    /// The number of rounds with line errors since the last tick.
    errors: u8,
    /// Whether there was a round since the last tick.
    served: bool,
    /// Number of bytes that were received and dropped because they may have come before an error. The count wraps.
    pub skipped: u32,
    /// How often the UARTE was switched off and on because an ENDRX was lost.
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

    /// Performs one round. The handler calls it.
    #[inline]
    pub fn service(&mut self, registers: &mut impl Registers) {
        self.served = true;
        // The order of these reads matters. Read the timer first: if `NONE_WAITS` had elapsed, and neither ENDRX nor a
        // byte in memory has come, no byte was waiting. Read the byte before ERRORSRC: if ERRORSRC still shows no
        // error, the byte was stored before any error.
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

    /// Performs a tick. The caller must prevent rounds during the call, and request a round after it. Returns whether
    /// the reception works. It does not work if there was no round since the last tick, or if one ENDRX after another
    /// is lost. In these cases only a reset can help.
    pub fn tick(&mut self, registers: &mut impl Registers) -> bool {
        self.errors = 0;
        if self.state != State::Stopping {
            self.listen(registers);
            let lies_there = registers.byte() != NO_BYTE;
            let lay_there = core::mem::replace(&mut self.since_byte.lay_there, lies_there);
            // A byte that is seen at only one tick may have just been stored, so its ENDRX may still come.
            if lay_there && lies_there && !registers.ended() {
                registers.report(LineEvent::Overrun);
                self.stop(registers);
            }
        }
        core::mem::take(&mut self.served) && self.since_byte.restarts < MOST_RESTARTS
    }

    /// Handles a line error. A byte that was read in the same round is dropped, because it may have been received
    /// before the error.
    #[cold]
    #[inline(never)]
    fn fail(&mut self, ended: bool, open_for: u32, causes: u32, registers: &mut impl Registers) {
        self.errors = self.errors.saturating_add(1);
        self.skipped = self.skipped.wrapping_add(ended.into());
        // A transfer that has been open for `NONE_WAITS` ends before the FIFO overruns (A4). So its ENDRX came before
        // the overrun, or is late or lost. `ended` may have been read too early, so read ENDRX again. If ENDRX has
        // still not come, it counts as lost.
        let is_full = causes & OVERRUN != 0 && open_for >= NONE_WAITS;
        if is_full && !ended && !registers.ended() {
            self.stop(registers);
        } else {
            self.drain(registers);
        }
        // Report last, so that the drain begins early, and `NONE_WAITS` elapses before the next byte comes.
        for (bit, event) in (0..).zip(EVENTS) {
            if causes >> bit & 1 == 1 {
                registers.report(event);
            }
        }
    }

    /// Starts the drain: bytes are dropped until a transfer has been open for `NONE_WAITS` without a byte. The timer
    /// measures this time from now on.
    fn drain(&mut self, registers: &mut impl Registers) {
        self.state = State::Draining;
        registers.restart_timer();
        self.listen(registers);
    }

    /// Stops the receiver after a lost ENDRX.
    fn stop(&mut self, registers: &mut impl Registers) {
        self.state = State::Stopping;
        self.restarts = self.restarts.wrapping_add(1);
        self.since_byte.restarts = self.since_byte.restarts.saturating_add(1);
        registers.stop();
    }

    /// Restarts the UARTE if the receiver has stopped, or if the wait for RXTO has timed out.
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

    /// Sets which events interrupt. After too many errors, line errors and the timer do not interrupt again before the
    /// next tick.
    fn listen(&self, registers: &mut impl Registers) {
        let few = self.errors < ERRORS_A_TICK;
        registers.listen(few, few && self.state == State::Draining);
    }
}
