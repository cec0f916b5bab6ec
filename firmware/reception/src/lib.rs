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
//!        └─────┘                                            └─────────┘
//!  ENDRX: start the next transfer, hand the byte on    ENDRX: start the next transfer, drop the byte
//!
//!  in both: a gap: report it. ENDRX was lost: report an overrun, switch the UARTE off and on, drain
//! ```
//!
//! **Draining.** No register says between which bytes an error came. So it is reported, and all that
//! comes out from then on is dropped, until a transfer has been open for `NONE_WAITS` and has brought
//! nothing: then the FIFO is empty, and every later byte comes behind the error. Nothing is handed on
//! meanwhile, so the one report stands between the bytes of both sides.
//!
//! **Events only wake.** What a round does is decided by what stays until it is taken: the time, ERRORSRC,
//! ENDRX. The main loop asks for a round at each tick, so any other event that is lost, doubled or late
//! costs a tick at most. For ENDRX the memory tells: a byte that lies there for a tick was never seen.
#![no_std]
#![cfg_attr(
    kani,
    allow(
        clippy::field_reassign_with_default,
        clippy::struct_excessive_bools,
        reason = "a harness says what is any, one thing after the other"
    )
)]
#![forbid(unsafe_code)]

#[cfg(kani)]
extern crate kani;

#[cfg(kani)]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::indexing_slicing,
    reason = "what goes wrong is what a harness would find"
)]
mod verification;

use framelock::LineEvent;

/// What memory holds when the byte was taken out. It may be any value: a byte that looks the same is
/// missed only if its ENDRX is lost too, and then until the FIFO is full.
pub const NO_BYTE: u8 = 0xEE;

/// Line errors that interrupt from one tick to the next. Later ones wake nobody, so a flood of errors
/// leaves time for all else; they are seen with the next byte, before it is handed on, or at the tick.
/// Several of them count as one.
pub const ERRORS_A_TICK: u8 = 32;

/// Signs in a row that ENDRX was lost, with which the reception does not work.
const MOST_SIGNS: u8 = 16;

/// ERRORSRC: a byte was lost since the FIFO was full.
const OVERRUN: u32 = 1;
/// ERRORSRC: the line was low for longer than a byte.
const BREAK: u32 = 8;
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
    /// Whether ENDRX has come; clears it if so.
    fn ended(&mut self) -> bool;
    /// Whether ERRORSRC says anything.
    fn has_failed(&mut self) -> bool;
    /// Clears ERROR, then reads ERRORSRC and clears what was read.
    fn take_causes(&mut self) -> u32;
    /// What memory holds.
    fn byte(&mut self) -> u8;
    /// Writes [`NO_BYTE`] to memory, opens a transfer (STARTRX), sets the timer to 0.
    fn start(&mut self);
    /// Switches the UARTE off and on, which empties the FIFO; clears ENDRX, and starts.
    fn start_anew(&mut self);
    /// Whether ERROR interrupts.
    fn listen_to_errors(&mut self, listen: bool);
    /// Whether the timer interrupts at `NONE_WAITS`. At `GAP` it always does.
    fn listen_to_timer(&mut self, listen: bool);
    /// Whether the line is low.
    fn is_low(&mut self) -> bool;
    /// Hands on a byte.
    fn push(&mut self, byte: u8);
    /// Reports an event behind the bytes handed on.
    fn report(&mut self, event: LineEvent);
}

/// What is counted. Counts wrap.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Rounds of the handler.
    pub rounds: u32,
    /// Bytes that were received and dropped, since they may have come before an error.
    pub skipped: u32,
    /// How often the UARTE was switched off and on, since an ENDRX was lost.
    pub restarts: u32,
    /// Ticks at which the line was still low after a break.
    pub break_ticks: u32,
}

/// What has been seen since the last byte came out.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct SinceByte {
    /// The gap was reported.
    gap: bool,
    in_break: bool,
    /// Signs that an ENDRX was lost.
    signs: u8,
}

/// The reception. `NONE_WAITS`: in this time a byte that waits in the FIFO is stored once a transfer is
/// open. `GAP`: after this time without a byte no frame goes on (L1).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Reception<const NONE_WAITS: u32, const GAP: u32> {
    draining: bool,
    since_byte: SinceByte,
    errors: u8,
    counts: Counts,
}

impl<const NONE_WAITS: u32, const GAP: u32> Reception<NONE_WAITS, GAP> {
    /// What was counted.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Starts the UARTE, which has just been switched on.
    pub fn begin(&mut self, registers: &mut impl Registers) {
        registers.listen_to_errors(true);
        registers.start();
    }

    /// The handler: one round.
    #[inline]
    pub fn service(&mut self, registers: &mut impl Registers) {
        self.counts.rounds = self.counts.rounds.wrapping_add(1);
        // In this order: if the time is over and then there is no ENDRX, no byte has waited; if ENDRX has
        // come and then there is no error, the byte came before any.
        let open_for = registers.open_for();
        if open_for >= GAP && !self.since_byte.gap {
            self.since_byte.gap = true;
            registers.report(LineEvent::Idle);
        }
        let ended = registers.ended();
        let causes = if ended && !registers.has_failed() {
            0
        } else {
            registers.take_causes()
        };
        if causes != 0 {
            self.fail(ended, causes, registers);
        } else if ended {
            let byte = registers.byte();
            registers.start();
            self.since_byte = SinceByte::default();
            if self.draining {
                self.counts.skipped = self.counts.skipped.wrapping_add(1);
            } else {
                registers.push(byte);
            }
        } else if self.draining && open_for >= NONE_WAITS && registers.byte() == NO_BYTE {
            self.draining = false;
            registers.listen_to_timer(false);
        }
    }

    /// Once a tick, with the handler held off; a round follows. Returns whether the reception works: if
    /// one ENDRX after another is lost it does not, and nothing but a reset may help.
    pub fn tick(&mut self, registers: &mut impl Registers) -> bool {
        if self.errors >= ERRORS_A_TICK {
            registers.listen_to_errors(true);
            registers.listen_to_timer(self.draining);
        }
        self.errors = 0;
        if self.since_byte.in_break {
            self.since_byte.in_break = registers.is_low();
            let is_low = u32::from(self.since_byte.in_break);
            self.counts.break_ticks = self.counts.break_ticks.wrapping_add(is_low);
        }
        if registers.byte() != NO_BYTE {
            self.since_byte.signs = self.since_byte.signs.saturating_add(1);
            // The first time its ENDRX may be about to come, or to be handled.
            if self.since_byte.signs > 1 {
                registers.report(LineEvent::Overrun);
                self.drain(registers);
                self.start_anew(registers);
            }
        }
        self.since_byte.signs < MOST_SIGNS
    }

    /// A line error. A byte that came out with it may be from before it.
    #[cold]
    #[inline(never)]
    fn fail(&mut self, ended: bool, causes: u32, registers: &mut impl Registers) {
        self.errors = self.errors.saturating_add(1);
        if self.errors >= ERRORS_A_TICK {
            registers.listen_to_errors(false);
        }
        self.drain(registers);
        if ended {
            self.counts.skipped = self.counts.skipped.wrapping_add(1);
            self.since_byte = SinceByte::default();
            registers.start();
        } else if causes & OVERRUN != 0 {
            // The FIFO was full though a transfer was open: it had ended, and ENDRX was lost.
            self.since_byte.signs = self.since_byte.signs.saturating_add(1);
            self.start_anew(registers);
        } else {
            registers.restart_timer();
        }
        // Behind it, so that the time is over before the next byte comes.
        for (bit, event) in (0..).zip(EVENTS) {
            if causes >> bit & 1 == 1 {
                registers.report(event);
            }
        }
        self.since_byte.gap = false;
        self.since_byte.in_break |= causes & BREAK != 0;
    }

    #[cold]
    fn start_anew(&mut self, registers: &mut impl Registers) {
        self.counts.restarts = self.counts.restarts.wrapping_add(1);
        registers.start_anew();
    }

    /// From now on what comes out is dropped, and the end of the time that follows wakes. After too many
    /// errors only the tick does.
    fn drain(&mut self, registers: &mut impl Registers) {
        self.draining = true;
        registers.listen_to_timer(self.errors < ERRORS_A_TICK);
    }
}
