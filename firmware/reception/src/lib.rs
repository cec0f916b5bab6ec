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
//! costs a tick at most. For ENDRX the memory tells: a byte that lies there for a tick was never seen; one that
//! comes again is cleared before the next transfer.
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

/// Signs in a row that ENDRX was lost, with which the reception does not work.
const MOST_SIGNS: u8 = 16;

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
    /// Clears ERROR, then reads ERRORSRC and clears what was read.
    fn take_causes(&mut self) -> u32;
    /// What memory holds.
    fn byte(&mut self) -> u8;
    /// Writes [`NO_BYTE`] to memory, clears ENDRX, opens a transfer (STARTRX), and sets the timer to 0.
    fn start(&mut self);
    /// Switches the UARTE off and on, which empties the FIFO, and starts.
    fn start_anew(&mut self);
    /// Whether ERROR interrupts, and the timer at `NONE_WAITS`. ENDRX always does.
    fn listen(&mut self, to_errors: bool, to_none_waits: bool);
    /// Hands on a byte.
    fn push(&mut self, byte: u8);
    /// Reports an event behind the bytes handed on.
    fn report(&mut self, event: LineEvent);
}

/// Since the last byte came.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct SinceByte {
    /// The gap was reported.
    in_gap: bool,
    /// Signs that an ENDRX was lost.
    signs: u8,
}

/// The reception. `NONE_WAITS`: in this time a byte that waits in the FIFO is stored once a transfer is
/// open. `GAP`: after this time without a byte no frame goes on (L1).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Reception<const NONE_WAITS: u32, const GAP: u32> {
    draining: bool,
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
        // In this order: if the time is over and then there is no ENDRX, no byte has waited; if ENDRX has
        // come and then there is no error, the byte came before any.
        let open_for = registers.open_for();
        let ended = registers.ended();
        let causes = registers.take_causes();
        let byte = registers.byte();
        if ended {
            registers.start();
        }
        if open_for >= GAP && !self.since_byte.in_gap {
            self.since_byte.in_gap = true;
            registers.report(LineEvent::Idle);
        }
        if ended {
            self.since_byte = SinceByte::default();
        }
        if causes != 0 {
            self.fail(ended, causes, registers);
        } else if !self.draining {
            if ended {
                registers.push(byte);
            }
        } else if ended {
            self.skipped = self.skipped.wrapping_add(1);
        } else if open_for >= NONE_WAITS && byte == NO_BYTE {
            self.draining = false;
            self.listen(registers);
        }
    }

    /// Once a tick, with the handler held off; a round follows. Returns whether the reception works: if there
    /// are no rounds, or one ENDRX after another is lost, it does not, and nothing but a reset may help.
    pub fn tick(&mut self, registers: &mut impl Registers) -> bool {
        self.errors = 0;
        self.listen(registers);
        if registers.byte() != NO_BYTE {
            self.since_byte.signs = self.since_byte.signs.saturating_add(1);
            // The first time its ENDRX may be about to come, or to be handled.
            if self.since_byte.signs > 1 {
                registers.report(LineEvent::Overrun);
                self.drain(true, registers);
            }
        }
        core::mem::take(&mut self.served) && self.since_byte.signs < MOST_SIGNS
    }

    /// A line error. The byte that came out with it, if one did, may be from before it.
    #[cold]
    #[inline(never)]
    fn fail(&mut self, ended: bool, causes: u32, registers: &mut impl Registers) {
        self.errors = self.errors.saturating_add(1);
        // If the FIFO was full though a transfer was open, it had ended, and ENDRX was lost.
        let lost_end = !ended && causes & OVERRUN != 0;
        self.since_byte.signs = self.since_byte.signs.saturating_add(lost_end.into());
        self.skipped = self.skipped.wrapping_add(ended.into());
        self.drain(lost_end, registers);
        // Behind it, so that the time is over before the next byte comes.
        for (bit, event) in (0..).zip(EVENTS) {
            if causes >> bit & 1 == 1 {
                registers.report(event);
            }
        }
    }

    /// From now on what comes out is dropped, until none has waited for the time that begins now.
    fn drain(&mut self, lost_end: bool, registers: &mut impl Registers) {
        self.draining = true;
        if lost_end {
            self.restarts = self.restarts.wrapping_add(1);
            registers.start_anew();
        }
        registers.restart_timer();
        self.listen(registers);
    }

    /// After too many errors only the tick wakes.
    fn listen(&self, registers: &mut impl Registers) {
        let few = self.errors < ERRORS_A_TICK;
        registers.listen(few, few && self.draining);
    }
}
