//! Functions that send bytes to the board, and that change the board and its line.

use std::sync::atomic::Ordering::Relaxed;

use rsemu::cpu::arm::v7m::xpsr;

use super::{Board, STUCK, core};
use crate::assumptions::Assumptions;
use crate::chip::TIMER0;
use crate::line::{SerialLine, Symbol};
use crate::nonvolatile::UICR;
use crate::trace::{Reset, ResetCause};
use crate::watchdog::WATCHDOG;
use crate::{Error, Result};

impl Board {
    /// Changes the line or its sender: baud rate, symbols, noise.
    pub fn line<T>(&mut self, change: impl FnOnce(&mut SerialLine) -> T) -> T {
        self.shared.touched.store(true, Relaxed);
        change(&mut self.shared.chip().context.line)
    }

    /// Sends bytes back to back, after all bytes that were sent before. Returns the end of the last stop bit, in
    /// cycles.
    pub fn send(&mut self, bytes: &[u8]) -> u64 {
        let symbols: Vec<Symbol> = bytes.iter().copied().map(Symbol::Byte).collect();
        self.send_symbols(&symbols)
    }

    /// Sends symbols, which may be faulty. Returns the end of the last symbol, in cycles.
    pub fn send_symbols(&mut self, symbols: &[Symbol]) -> u64 {
        let now = self.now;
        self.line(|line| {
            for symbol in symbols {
                line.send(now, *symbol);
            }
            line.free_at()
        })
    }

    /// Sets the uncertain parts of the chip's behaviour, from now on.
    pub fn assume(&mut self, assumptions: Assumptions) {
        self.slowness = assumptions.slowness;
        let mut chip = self.shared.chip();
        chip.context.assumptions = assumptions;
        let is_slow = assumptions.slowness > 100;
        chip.context.deviates("slowness", is_slow);
    }

    /// Wires the line to `pin` (32 * port + pin) instead of P0.08.
    pub fn wire_line_to(&mut self, pin: u32) {
        self.shared.chip().context.line_pin = pin;
    }

    /// Wires `pin` to the line as well, so that UARTE0 receives the bytes that UARTE1 sends on this pin. UARTE1 then
    /// takes the place of the sender, so the sender should be silent.
    pub fn wire_loopback(&mut self, pin: u32) {
        self.shared.chip().context.loopback_pin = Some(pin);
    }

    /// Breaks the crystal, so that it does not start from now on.
    pub fn break_crystal(&mut self) {
        self.shared.chip().context.crystal_startup = None;
    }

    /// Interrupts the firmware for `cycles` from the instant `at` on, as a long handler of the highest priority would.
    /// During this time the peripherals keep running, and a sleeping core stays asleep.
    pub fn hold_off(&mut self, at: u64, cycles: u64) {
        let place = self.hold_offs.partition_point(|(other, _)| *other <= at);
        self.hold_offs.insert(place, (at, cycles));
    }

    /// Halts the core for `cycles` from now on, as a debugger does. During this time the peripherals keep running, but
    /// the watchdog pauses. On silicon the watchdog runs on if WDT.CONFIG.HALT is 1, which is not modelled.
    pub fn halt_for(&mut self, cycles: u64) {
        self.shared.chip().unit(WATCHDOG).pause(cycles);
        self.shared.touched.store(true, Relaxed);
        self.hold_off(self.now, cycles);
    }

    /// Moves TIMER0 forward by this number of counts, together with its compare registers, so the time until its next
    /// events does not change. Tests use this function to reach the wrap of a count without emulating the time until
    /// then.
    ///
    /// # Errors
    /// Returns the same errors as [`Board::run_for`], because events may be due now.
    pub fn skip_counts(&mut self, counts: u32) -> Result<()> {
        self.settle()?;
        self.shared.touched.store(true, Relaxed);
        self.shared.chip().unit(TIMER0).skip(counts);
        Ok(())
    }

    /// Breaks bits of a word of UICR, given by its offset: from now on, writing the word does not clear these bits.
    pub fn break_uicr(&mut self, offset: u32, bits: u32) {
        let mut chip = self.shared.chip();
        chip.unit(UICR).common().break_bits(offset, bits);
    }

    /// Resets the chip by its reset pin.
    pub fn reset(&mut self) {
        self.reset_for(ResetCause::Pin);
    }

    /// Lets the supply voltage drop too low for a moment. This resets the chip without a cause in RESETREAS,
    /// like power-on, but RAM keeps its contents.
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
        self.handlers.clear();
        self.lines = 0;
        self.asleep = false;
        self.booted = false;
    }

    /// Overwrites flash or RAM, including code, as a debugger does.
    ///
    /// # Errors
    /// Returns an error if the range is neither in flash nor in RAM.
    pub fn patch(&mut self, address: u32, bytes: &[u8]) -> Result<()> {
        let outside = || Error(format!("nothing to patch at {address:#010x}"));
        self.memory.write(address, bytes).ok_or_else(outside)
    }

    /// Replaces the main loop with an endless loop until the next reset. Interrupts are enabled in this loop. Tests
    /// check the watchdog with it. If the core sleeps, the endless loop begins when an interrupt wakes the core.
    ///
    /// # Errors
    /// Returns the same errors as [`Board::run_for`], because the board runs until no handler is active.
    pub fn stick_main_loop(&mut self) -> Result<()> {
        let (address, code) = STUCK;
        self.patch(address, &code)?;
        while self.exception != 0 || !self.booted {
            self.step(u64::MAX)?;
        }
        let mut registers = self.core.regs();
        let [.., pc] = &mut registers.r;
        *pc = address;
        registers.xpsr &= !xpsr::IT_MASK;
        registers.primask = false;
        self.core.set_regs(registers);
        self.see_core();
        Ok(())
    }

    /// Lets the firmware's own handlers handle faults, and lets a lockup reset the chip. By default a fault or a lockup
    /// ends the emulation with an error.
    pub fn let_faults_be_handled(&mut self) {
        self.faults_stop = false;
    }
}
