//! What is sent to the board, and what tests do to it.

use std::sync::atomic::Ordering::Relaxed;

use rsemu::cpu::arm::v7m::xpsr;

use super::{Board, STUCK, core};
use crate::assumptions::Assumptions;
use crate::chip::ResetCause;
use crate::error::{Error, Result};
use crate::line::{Line, Symbol};
use crate::trace::Reset;

impl Board {
    /// Changes the line or its sender: baud rate, parity, noise.
    pub fn line<T>(&mut self, change: impl FnOnce(&mut Line) -> T) -> T {
        self.shared.touched.store(true, Relaxed);
        change(&mut self.shared.chip().context.line)
    }

    /// Sends bytes, back to back, after what is being sent already. Returns when the last stop bit
    /// will be over, in cycles.
    pub fn send(&mut self, bytes: &[u8]) -> u64 {
        let symbols: Vec<Symbol> = bytes.iter().copied().map(Symbol::Byte).collect();
        self.send_symbols(&symbols)
    }

    /// Sends symbols, which need not be right. Returns when the last will be over, in cycles.
    pub fn send_symbols(&mut self, symbols: &[Symbol]) -> u64 {
        let now = self.now;
        self.line(|line| {
            for symbol in symbols {
                line.send(now, *symbol);
            }
            line.free_at()
        })
    }

    /// Sets what is not known for certain about the chip, from now on.
    pub fn assume(&mut self, assumptions: Assumptions) {
        self.slowness = assumptions.slowness;
        self.shared.chip().context.assumptions = assumptions;
    }

    /// Wires the line to another pin than P0.08: 32 * port + pin.
    pub fn wire_line_to(&mut self, pin: u32) {
        self.shared.chip().context.line_pin = pin;
    }

    /// Wires that pin to the line as well: what UARTE1 sends there is heard by UARTE0. It is a wire
    /// instead of the sender, which should be silent.
    pub fn wire_loopback(&mut self, pin: u32) {
        self.shared.chip().context.loopback_pin = Some(pin);
    }

    /// Breaks the crystal: it does not start from now on.
    pub fn break_crystal(&mut self) {
        self.shared.chip().context.crystal_startup = None;
    }

    /// Takes the core away from the firmware at that instant, for that many cycles, as if a handler of
    /// the highest priority ran for that time. The peripherals go on. A core that sleeps stays asleep
    /// for that time.
    pub fn hold_off(&mut self, at: u64, cycles: u64) {
        let place = self.hold_offs.partition_point(|(other, _)| *other <= at);
        self.hold_offs.insert(place, (at, cycles));
    }

    /// Resets the chip as its reset pin does.
    pub fn reset(&mut self) {
        self.reset_for(ResetCause::Pin);
    }

    /// Lets the supply fall too low for a moment: a reset that says as little as power-on, with RAM as it was.
    pub fn brown_out(&mut self) {
        self.reset_for(ResetCause::BrownOut);
    }

    pub(super) fn reset_for(&mut self, cause: ResetCause) {
        let at = self.now;
        {
            let mut chip = self.shared.chip();
            chip.context.now = at;
            chip.reset(cause);
        }
        self.shared.touched.store(true, Relaxed);
        self.trace.resets.push(Reset { at, cause });
        self.core = core(&self.space);
        self.see_core();
        self.handlers.reset();
        self.lines = 0;
        self.asleep = false;
        self.booted = false;
    }

    /// Writes over flash or RAM, as a debugger does; code included.
    ///
    /// # Errors
    /// If the range is in neither.
    pub fn patch(&mut self, address: u32, bytes: &[u8]) -> Result<()> {
        let outside = || Error::Image(format!("nothing to patch at {address:#010x}"));
        self.memory.write(address, bytes).ok_or_else(outside)
    }

    /// Catches the main loop in an endless one, interrupts enabled, until the next reset: what the
    /// watchdog is for. A core that sleeps is caught when an interrupt wakes it.
    ///
    /// # Errors
    /// As [`Board::run_for`]: it runs until no handler is active.
    pub fn stick_main_loop(&mut self) -> Result<()> {
        let (address, code) = STUCK;
        self.patch(address, &code)?;
        while self.exception != 0 || !self.booted {
            self.step(u64::MAX)?;
        }
        let mut registers = self.core.regs();
        if let Some(pc) = registers.r.last_mut() {
            *pc = address;
        }
        registers.xpsr &= !xpsr::IT_MASK;
        registers.primask = false;
        self.core.set_regs(registers);
        self.see_core();
        Ok(())
    }

    /// Lets faults be the firmware's business: its handlers run, where by default a fault ends the
    /// emulation with an error.
    pub fn let_faults_be_handled(&mut self) {
        self.faults_stop = false;
    }
}
