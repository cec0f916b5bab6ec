//! UARTE1's transmitter, for firmware whose TX pin is wired to UARTE0's RX pin.
//!
//! EasyDMA fetches each byte when its start bit begins. ENDTX comes at the end of the last byte's stop bit. STOPTX and
//! the other events are not modelled.

use super::{CONFIG, ENABLE, ENABLED, PSEL_TXD, Transfer, bit, registers};
use crate::line::SerialLine;
use crate::peripheral::{Access, Common, Context, Peripheral};

const STARTTX: u32 = 0x008;
const ENDTX: u32 = 0x120;
const TXD_PTR: u32 = 0x544;

#[derive(Debug)]
pub(crate) struct Transmission {
    common: Common,
    /// The open transfer, and the instant at which the current byte ends.
    sending: Option<(Transfer, u64)>,
}

impl Transmission {
    pub(crate) fn new() -> Self {
        // Disabling the transmitter is not modelled.
        let enable = Access::Plain(ENABLED..=ENABLED);
        let registers = registers(TXD_PTR, enable);
        Self {
            common: Common::new("UARTE1", 0x4002_8000, &[ENDTX], registers),
            sending: None,
        }
    }

    fn start(&mut self, context: &mut Context) -> Result<(), String> {
        if self.common[ENABLE] != ENABLED {
            return Ok(());
        }
        let transfer = Transfer::of(&self.common, TXD_PTR);
        if self.sending.is_some() || transfer.size == 0 {
            return Err("UARTE1: STARTTX while it sends, or with TXD.MAXCNT 0".to_owned());
        }
        self.send(transfer, context)
    }

    /// Puts the transfer's next byte on the line.
    fn send(&mut self, transfer: Transfer, context: &mut Context) -> Result<(), String> {
        let mut byte = [0];
        let address = transfer.pointer + transfer.done;
        context.memory.dma_read(address, &mut byte)?;
        let [byte] = byte;
        let (bit, parity) = (bit(&self.common), u64::from(self.common[CONFIG] != 0));
        // The start bit, the byte, and the parity bit, if any. The line is high except during bits that are 0.
        let character = u32::from(byte) << 1 | (byte.count_ones() & 1) << 9;
        if context.loopback_pin == Some(self.common[PSEL_TXD]) {
            for n in (0..9 + parity).filter(|n| character >> n & 1 == 0) {
                context.line.invert(context.now + n * bit, bit);
            }
        }
        self.sending = Some((transfer, context.now + (10 + parity) * bit));
        Ok(())
    }
}

impl Peripheral for Transmission {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        if offset != STARTTX {
            return None;
        }
        let started = self.start(context);
        context.check(started)
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.sending.map(|(_, ends_at)| ends_at)
    }

    /// Ends a byte. Sends the next byte, or raises ENDTX after the last one.
    fn advance(&mut self, context: &mut Context) {
        let Some((mut transfer, _)) = self.sending.take() else {
            return;
        };
        transfer.done += 1;
        if transfer.done < transfer.size {
            let sent = self.send(transfer, context);
            context.check(sent);
        } else {
            self.common.raise(ENDTX, context);
        }
    }
}
