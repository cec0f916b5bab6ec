//! What can be seen of the board: memory, registers, outputs, what handlers cost.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering::Relaxed;

use super::{Board, Change, Reset, Watch};
use crate::chip::Pins;
use crate::error::{Error, Result};
use crate::handlers::{Activation, HandlerTotals};
use crate::image::Image;
use crate::memory::Memory;
use crate::pwm::Period;

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
    ///
    /// If it is not modelled.
    pub fn register(&mut self, address: u32) -> Result<u32> {
        let mut chip = self.shared.chip();
        chip.advance(self.now);
        if let Some(value) = chip.read(address) {
            return Ok(value);
        }
        let refusal = chip.refusal.take();
        drop(chip);
        let pc = self.pc;
        Err(refusal.map_or(Error::Lockup { pc }, |refusal| self.refused(refusal, pc)))
    }

    /// Writes a register of a peripheral, as the firmware would now: for tests without firmware.
    ///
    /// # Errors
    ///
    /// If it is not modelled.
    pub fn set_register(&mut self, address: u32, value: u32) -> Result<()> {
        self.settle()?;
        self.shared.touched.store(true, Relaxed);
        let done = self.shared.chip().write(address, value);
        let refusal = self.shared.chip().refusal.take();
        match (done, refusal) {
            (_, Some(refusal)) => Err(self.refused(refusal, self.pc)),
            _ => Ok(()),
        }
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
    ///
    /// If there is no such symbol.
    pub fn word(&self, symbol: &str) -> Result<u32> {
        let address = self.image.symbol(symbol)?.address;
        let nowhere = || Error::Image(format!("`{symbol}` is not in memory"));
        self.memory.word(address).ok_or_else(nowhere)
    }

    /// Watches the word at a symbol from now on. Returns the watch's number for
    /// [`Board::changes`].
    ///
    /// # Errors
    ///
    /// If there is no such symbol.
    pub fn watch(&mut self, symbol: &str) -> Result<usize> {
        let address = self.image.symbol(symbol)?.address;
        let value = self.word(symbol)?;
        self.watches.push(Watch {
            address,
            value,
            changes: Vec::new(),
        });
        Ok(self.watches.len() - 1)
    }

    /// All changes of a watched word so far.
    #[must_use]
    pub fn changes(&self, watch: usize) -> &[Change] {
        self.watches.get(watch).map_or(&[], |watch| &watch.changes)
    }

    /// The same, and forgets them: for long runs.
    pub fn take_changes(&mut self, watch: usize) -> Vec<Change> {
        let watch = self.watches.get_mut(watch);
        watch.map_or_else(Vec::new, |watch| std::mem::take(&mut watch.changes))
    }

    /// Every PWM period so far, the one that has begun included.
    #[must_use]
    pub fn pwm_periods(&self) -> Vec<Period> {
        self.shared.chip().pwm.periods.clone()
    }

    /// The same, and forgets them: for long runs.
    pub fn take_pwm_periods(&mut self) -> Vec<Period> {
        std::mem::take(&mut self.shared.chip().pwm.periods)
    }

    /// Every change of the output pins so far, and when.
    #[must_use]
    pub fn pin_changes(&self) -> Vec<(u64, Pins)> {
        self.shared.chip().pin_changes.clone()
    }

    /// The same, and forgets them: for long runs.
    pub fn take_pin_changes(&mut self) -> Vec<(u64, Pins)> {
        std::mem::take(&mut self.shared.chip().pin_changes)
    }

    /// The output pins as they are.
    #[must_use]
    pub fn pins(&self) -> Pins {
        self.shared.chip().pins()
    }

    /// Every reset so far; power-on is none.
    #[must_use]
    pub fn resets(&self) -> &[Reset] {
        &self.resets
    }

    /// What the handlers cost so far, by exception number: 16 + n for interrupt n.
    #[must_use]
    pub fn handlers(&self) -> &BTreeMap<u16, HandlerTotals> {
        &self.handlers.totals
    }

    /// Keeps every single run of a handler from now on.
    pub fn keep_activations(&mut self) {
        self.handlers.kept.get_or_insert_default();
    }

    /// The runs of handlers that were kept.
    #[must_use]
    pub fn activations(&self) -> &[Activation] {
        self.handlers.kept.as_deref().unwrap_or_default()
    }
}
