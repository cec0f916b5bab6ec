//! UARTE0 and UARTE1: nRF52840 Product Specification, section "UARTE". In the model, UARTE0 has only a receiver, and
//! UARTE1 only a transmitter. Hardware flow control, AMOUNT and a second stop bit are not modelled.
//!
//! This file models the parts that UARTE0 and UARTE1 share: pins, baud rate, and EasyDMA's buffer.

mod reception;
mod sampler;
mod transmission;

use crate::MICROSECOND;
use crate::peripheral::{ANY, Access, Common, Register};
pub(crate) use reception::Reception;
pub(crate) use transmission::Transmission;

const ENABLE: u32 = 0x500;
const PSEL_TXD: u32 = 0x50C;
const PSEL_RXD: u32 = 0x514;
const BAUDRATE: u32 = 0x524;
const CONFIG: u32 = 0x56C;

const ENABLED: u32 = 8;
/// The value of CONFIG that adds an even parity bit to each byte.
const PARITY: u32 = 7 << 1;

/// An open EasyDMA transfer.
#[derive(Clone, Copy, Debug)]
struct Transfer {
    pointer: u32,
    size: u32,
    done: u32,
}

impl Transfer {
    /// Returns a transfer of the buffer that PTR and MAXCNT describe. `pointer` is the offset of PTR.
    fn of(common: &Common, pointer: u32) -> Self {
        Self {
            pointer: common[pointer],
            size: common[pointer + 4],
            done: 0,
        }
    }
}

/// Returns the registers, with the modelled values of ENABLE. `pointer` is the offset of PTR.
fn registers(pointer: u32, enable: Access) -> Vec<Register> {
    // RTS, TXD, CTS, RXD.
    let pins = [0x508, PSEL_TXD, 0x510, PSEL_RXD];
    let mut registers = pins.map(|offset| (offset, u32::MAX, ANY)).to_vec();
    registers.extend([
        (ENABLE, 0, enable),
        (BAUDRATE, 0x0400_0000, Access::Plain(1..=u32::MAX)),
        (CONFIG, 0, Access::Plain(0..=PARITY)),
        (pointer, 0, ANY),
        (pointer + 4, 0, Access::Plain(0..=0xFFFF)),
    ]);
    registers
}

/// Returns the cycles of a bit. A bit always lasts whole cycles of 16 MHz, as the section's "actual rates"
/// for the values of BAUDRATE show: for example, 115 108 baud for 0x01D60000.
fn bit(common: &Common) -> u64 {
    let cycles_of_16_mhz = (1 << 32) / u64::from(common[BAUDRATE]);
    cycles_of_16_mhz.max(1) * (MICROSECOND / 16)
}
