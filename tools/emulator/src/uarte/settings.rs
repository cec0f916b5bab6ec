//! What both UARTEs have: enabling, pins, baud rate, the form of a character, and where EasyDMA finds
//! or puts the bytes. Hardware flow control is not modelled.

use crate::time::MICROSECOND;

/// The first of EasyDMA's registers: PTR, then MAXCNT and AMOUNT.
pub(super) const RXD: u32 = 0x534;
pub(super) const TXD: u32 = 0x544;

pub(super) const ENABLE: u32 = 0x500;
const PSEL_RTS: u32 = 0x508;
const PSEL_RXD: u32 = 0x514;
const BAUDRATE: u32 = 0x524;
const CONFIG: u32 = 0x56C;

const ENABLED: u32 = 8;
pub(super) const CONFIG_PARITY: u32 = 7 << 1;
pub(super) const CONFIG_TWO_STOP_BITS: u32 = 1 << 4;

#[derive(Clone, Debug)]
pub(super) struct Settings {
    modelled_configuration: u32,
    easy_dma: u32,
    pub(super) pointer: u32,
    pub(super) size: u32,
    pub(super) amount: u32,
    configuration: u32,
    enable: u32,
    /// RTS, TXD, CTS, RXD.
    pub(super) pins: [u32; 4],
    baud: u32,
}

impl Settings {
    /// As after a reset; `modelled_configuration` are the bits of CONFIG that may be set, `easy_dma` is
    /// [`RXD`] or [`TXD`].
    pub(super) fn new(modelled_configuration: u32, easy_dma: u32) -> Self {
        Self {
            modelled_configuration,
            easy_dma,
            pointer: 0,
            size: 0,
            amount: 0,
            configuration: 0,
            enable: 0,
            pins: [u32::MAX; 4],
            baud: 0x0400_0000,
        }
    }

    pub(super) fn is_enabled(&self) -> bool {
        self.enable == ENABLED
    }

    pub(super) fn has_parity(&self) -> bool {
        self.configuration & CONFIG_PARITY != 0
    }

    pub(super) fn has_two_stop_bits(&self) -> bool {
        self.configuration & CONFIG_TWO_STOP_BITS != 0
    }

    /// Cycles of a bit. The "actual rates" that the section lists beside the values of BAUDRATE are
    /// those of whole cycles of 16 MHz: 115 108 baud for 0x01D60000.
    pub(super) fn bit(&self) -> u64 {
        let cycles_of_16_mhz = (1 << 32) / u64::from(self.baud.max(1));
        cycles_of_16_mhz.max(1) * (MICROSECOND / 16)
    }

    pub(super) fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            _ if offset == self.easy_dma => self.pointer,
            _ if offset == self.easy_dma + 4 => self.size,
            _ if offset == self.easy_dma + 8 => self.amount,
            ENABLE => self.enable,
            PSEL_RTS..=PSEL_RXD => *self.pins.get(((offset - PSEL_RTS) / 4) as usize)?,
            BAUDRATE => self.baud,
            CONFIG => self.configuration,
            _ => return None,
        })
    }

    pub(super) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            _ if offset == self.easy_dma => self.pointer = value,
            _ if offset == self.easy_dma + 4 && value <= 0xFFFF => self.size = value,
            ENABLE if value == 0 || value == ENABLED => self.enable = value,
            PSEL_RTS..=PSEL_RXD => {
                *self.pins.get_mut(((offset - PSEL_RTS) / 4) as usize)? = value;
            }
            BAUDRATE if value != 0 => self.baud = value,
            CONFIG if value & !self.modelled_configuration == 0 => self.configuration = value,
            _ => return None,
        }
        Some(())
    }
}
