//! Reads the board's state: memory, registers, outputs, and the trace of past events.

use std::sync::atomic::Ordering::Relaxed;

use super::{Board, Watch};
use crate::chip::Chip;
use crate::image::Image;
use crate::memory::Memory;
use crate::trace::{Pins, Trace};
use crate::{Error, Result};

impl Board {
    /// Returns the firmware's image.
    #[must_use]
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Returns flash and RAM.
    #[must_use]
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Reads a peripheral's register, with the same effects as a read by the firmware.
    ///
    /// # Errors
    /// Returns an error if the register is not modelled.
    pub fn register(&mut self, address: u32) -> Result<u32> {
        self.access(|chip| chip.read(address))
    }

    /// Writes a peripheral's register, with the same effects as a write by the firmware.
    ///
    /// # Errors
    /// Returns an error if the register or the value is not modelled, or if the model rejects the write.
    pub fn set_register(&mut self, address: u32, value: u32) -> Result<()> {
        self.access(|chip| chip.write(address, value))
    }

    fn access<T>(&mut self, access: impl FnOnce(&mut Chip) -> Option<T>) -> Result<T> {
        self.settle()?;
        self.shared.touched.store(true, Relaxed);
        let mut chip = self.shared.chip();
        let value = access(&mut chip);
        let refusal = chip.context.refusal.take();
        drop(chip);
        match refusal {
            Some(refusal) => Err(self.stopped(&refusal, self.pc)),
            None => Ok(value.expect("without a refusal")),
        }
    }

    /// Returns the address of the next instruction.
    #[must_use]
    pub fn pc(&self) -> u32 {
        self.pc
    }

    /// Returns the number of the exception whose handler runs, or 0 if no handler runs.
    #[must_use]
    pub fn exception(&self) -> u16 {
        self.exception
    }

    /// Returns the word at a symbol.
    ///
    /// # Errors
    /// Returns the same errors as [`Image::symbol`], and an error if the symbol is neither in flash nor in RAM.
    pub fn word(&self, symbol: &str) -> Result<u32> {
        let address = self.image.symbol(symbol)?.address;
        let nowhere = || Error(format!("`{symbol}` is not in memory"));
        self.memory.word(address).ok_or_else(nowhere)
    }

    /// Watches the word at a symbol from now on. Returns the number that identifies this watch in [`Trace::changes`].
    ///
    /// # Errors
    /// Returns the same errors as [`Board::word`].
    pub fn watch(&mut self, symbol: &str) -> Result<usize> {
        let address = self.image.symbol(symbol)?.address;
        let value = self.word(symbol)?;
        self.watches.push(Watch { address, value });
        Ok(self.watches.len() - 1)
    }

    /// Returns the current levels of the output pins.
    #[must_use]
    pub fn pins(&self) -> Pins {
        self.shared.chip().context.pins
    }

    /// Returns whether a debugger has access on a chip of build code F or later. A debugger has access if
    /// UICR.APPROTECT was 0x5A at the last reset and the firmware has since written 0x5A to APPROTECT.DISABLE. See
    /// section "Debug and trace", "Access port protection controlled by hardware and software".
    #[must_use]
    pub fn debug_port_is_open(&self) -> bool {
        self.shared.chip().debug_port_is_open()
    }

    /// Returns the events so far.
    pub fn trace(&mut self) -> &mut Trace {
        let mut chip = self.shared.chip();
        let context = &mut chip.context;
        (self.trace.pwm_periods).append(&mut context.pwm_periods);
        (self.trace.pin_changes).append(&mut context.pin_changes);
        (self.trace.deviations).append(&mut context.deviations);
        drop(chip);
        &mut self.trace
    }
}
