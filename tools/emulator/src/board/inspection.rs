//! What can be seen of the board: memory, registers, outputs, what happened.

use std::sync::atomic::Ordering::Relaxed;

use super::{Board, Watch};
use crate::chip::Chip;
use crate::error::{Error, Result};
use crate::gpio::Pins;
use crate::image::Image;
use crate::memory::Memory;
use crate::trace::Trace;

impl Board {
    /// The image.
    #[must_use]
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Flash and RAM.
    #[must_use]
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// A register of a peripheral, as the firmware would read it now.
    ///
    /// # Errors
    /// If it is not modelled.
    pub fn register(&mut self, address: u32) -> Result<u32> {
        self.access(|chip| chip.read(address))
    }

    /// Writes a register of a peripheral, as the firmware would now: for tests without firmware.
    ///
    /// # Errors
    /// If it is not modelled.
    pub fn set_register(&mut self, address: u32, value: u32) -> Result<()> {
        self.access(|chip| chip.write(address, value))
    }

    fn access<T: Default>(&mut self, access: impl FnOnce(&mut Chip) -> Option<T>) -> Result<T> {
        self.settle()?;
        self.shared.touched.store(true, Relaxed);
        let mut chip = self.shared.chip();
        let value = access(&mut chip).unwrap_or_default();
        let refusal = chip.context.refusal.take();
        drop(chip);
        refusal.map_or(Ok(value), |refusal| Err(self.refused(refusal, self.pc)))
    }

    /// The next instruction.
    #[must_use]
    pub fn pc(&self) -> u32 {
        self.pc
    }

    /// The exception whose handler runs, 0 if none.
    #[must_use]
    pub fn exception(&self) -> u16 {
        self.exception
    }

    /// The word at a symbol.
    ///
    /// # Errors
    /// If there is no such symbol.
    pub fn word(&self, symbol: &str) -> Result<u32> {
        let address = self.image.symbol(symbol)?.address;
        let nowhere = || Error::Image(format!("`{symbol}` is not in memory"));
        self.memory.word(address).ok_or_else(nowhere)
    }

    /// Watches the word at a symbol from now on. Returns the number by which [`Trace::changes`] knows
    /// it.
    ///
    /// # Errors
    /// If there is no such symbol.
    pub fn watch(&mut self, symbol: &str) -> Result<usize> {
        let address = self.image.symbol(symbol)?.address;
        let value = self.word(symbol)?;
        self.watches.push(Watch { address, value });
        Ok(self.watches.len() - 1)
    }

    /// The output pins as they are.
    #[must_use]
    pub fn pins(&self) -> Pins {
        self.shared.chip().context.pins
    }

    /// Whether the firmware has turned the instruction cache on.
    #[must_use]
    pub fn instruction_cache_is_on(&self) -> bool {
        self.shared.chip().nonvolatile.caches()
    }

    /// Whether a debugger gets in, on a chip of build code F or later: UICR.APPROTECT was 0x5A at
    /// the last reset, and the firmware has written 0x5A to APPROTECT.DISABLE since. Section "Debug
    /// and trace", "Access port protection controlled by hardware and software".
    #[must_use]
    pub fn debug_port_is_open(&self) -> bool {
        self.shared.chip().debug_port_is_open()
    }

    /// What happened so far.
    pub fn trace(&mut self) -> &mut Trace {
        let mut chip = self.shared.chip();
        let context = &mut chip.context;
        (self.trace.pwm_periods).append(&mut context.pwm_periods);
        (self.trace.pin_changes).append(&mut context.pin_changes);
        drop(chip);
        &mut self.trace
    }
}
