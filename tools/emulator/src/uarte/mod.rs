//! UARTE0 and UARTE1: nRF52840 Product Specification, section "UARTE". In the model, UARTE0 has only a receiver, and
//! UARTE1 only a transmitter. Hardware flow control is not modelled.
//!
//! This file models the parts that UARTE0 and UARTE1 share: enabling, pins, baud rate, character format, and EasyDMA's
//! buffer.

mod reception;
mod sampler;
mod transmission;

use crate::MICROSECOND;
use crate::peripheral::{RegisterFile as _, registers};
pub(crate) use reception::Reception;
pub(crate) use transmission::Transmission;

/// The offset of EasyDMA's first register, PTR, which MAXCNT and AMOUNT follow.
const RXD: u32 = 0x534;
const TXD: u32 = 0x544;

const ENABLE: u32 = 0x500;
const CONFIG: u32 = 0x56C;

const ENABLED: u32 = 8;
const CONFIG_PARITY: u32 = 7 << 1;
const CONFIG_TWO_STOP_BITS: u32 = 1 << 4;

registers! {
    0x500 enable: u32 = 0, [0, ENABLED];
    /// RTS, TXD, CTS, RXD.
    0x508 pins: [u32; 4] = [u32::MAX; 4], 0..;
    0x524 baud: u32 = 0x0400_0000, 1..;
    0x56C configuration: u32 = 0, 0..;
}

#[derive(Clone, Debug)]
struct Settings {
    modelled_configuration: u32,
    easy_dma: u32,
    /// PTR, MAXCNT and AMOUNT.
    pointer: u32,
    size: u32,
    amount: u32,
    registers: Registers,
}

/// An open EasyDMA transfer.
#[derive(Clone, Copy, Debug)]
struct Transfer {
    pointer: u32,
    size: u32,
    done: u32,
}

impl Settings {
    /// Creates the settings after a reset. `modelled_configuration` has the bits of CONFIG that may be
    /// set; `easy_dma` is [`RXD`] or [`TXD`].
    fn new(modelled_configuration: u32, easy_dma: u32) -> Self {
        Self {
            modelled_configuration,
            easy_dma,
            pointer: 0,
            size: 0,
            amount: 0,
            registers: Registers::default(),
        }
    }

    fn is_enabled(&self) -> bool {
        self.registers.enable == ENABLED
    }

    fn has_parity(&self) -> bool {
        self.registers.configuration & CONFIG_PARITY != 0
    }

    fn has_two_stop_bits(&self) -> bool {
        self.registers.configuration & CONFIG_TWO_STOP_BITS != 0
    }

    /// Returns a transfer of the buffer that PTR and MAXCNT describe.
    fn transfer(&self) -> Transfer {
        Transfer {
            pointer: self.pointer,
            size: self.size,
            done: 0,
        }
    }

    /// Returns the cycles of a bit. A bit always lasts whole cycles of 16 MHz, as the section's "actual rates"
    /// for the values of BAUDRATE show: for example, 115 108 baud for 0x01D60000.
    fn bit(&self) -> u64 {
        let cycles_of_16_mhz = (1 << 32) / u64::from(self.registers.baud);
        cycles_of_16_mhz.max(1) * (MICROSECOND / 16)
    }

    fn read(&mut self, offset: u32) -> Option<u32> {
        match offset.wrapping_sub(self.easy_dma) {
            0 => Some(self.pointer),
            4 => Some(self.size),
            8 => Some(self.amount),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset.wrapping_sub(self.easy_dma) {
            0 => self.pointer = value,
            4 if value <= 0xFFFF => self.size = value,
            _ if offset == CONFIG && value & !self.modelled_configuration != 0 => return None,
            _ => self.registers.write(offset, value)?,
        }
        Some(())
    }
}
