//! UARTE1's transmitter, for firmware whose TX pin is wired to UARTE0's RX pin.
//!
//! EasyDMA fetches each byte when its start bit begins. TXDRDY comes at the end of the byte's last
//! stop bit, and ENDTX with the last TXDRDY.

use super::{CONFIG_PARITY, CONFIG_TWO_STOP_BITS, ENABLE, Settings, TXD, Transfer};
use crate::error::Refusal;
use crate::line::SerialLine;
use crate::peripheral::{Common, Context, Peripheral};

const STARTTX: u32 = 0x008;
const STOPTX: u32 = 0x00C;
const TXDRDY: u32 = 0x11C;
const ENDTX: u32 = 0x120;
const TXSTARTED: u32 = 0x150;
const TXSTOPPED: u32 = 0x158;

#[derive(Clone, Debug)]
pub(crate) struct Transmission {
    /// The open transfer, and the instant at which the current byte ends.
    sending: Option<(Transfer, u64)>,
    stops: bool,
    settings: Settings,
}

impl Transmission {
    pub(crate) fn new() -> Self {
        Self {
            sending: None,
            stops: false,
            settings: Settings::new(CONFIG_PARITY | CONFIG_TWO_STOP_BITS, TXD),
        }
    }

    fn start(&mut self, context: &mut Context) -> Result<(), Refusal> {
        if !self.settings.is_enabled() {
            return Ok(());
        }
        if self.sending.is_some() {
            return Err(Refusal::misused("UARTE1", "STARTTX while it sends"));
        }
        if self.settings.size == 0 {
            return Err(Refusal::misused("UARTE1", "STARTTX with TXD.MAXCNT 0"));
        }
        context.raise(TXSTARTED);
        self.stops = false;
        self.send(self.settings.transfer(), context)
    }

    /// Puts the transfer's next byte on the line.
    fn send(&mut self, transfer: Transfer, context: &mut Context) -> Result<(), Refusal> {
        let mut byte = [0];
        let address = transfer.pointer + transfer.done;
        context.memory.dma_read(address, &mut byte)?;
        let [byte] = byte;
        let (bit, parity) = (self.settings.bit(), u64::from(self.settings.has_parity()));
        // The start bit, the byte, and the parity bit, if any. The line is high except during bits that are 0.
        let character = u32::from(byte) << 1 | (byte.count_ones() & 1) << 9;
        let [_, txd, ..] = self.settings.registers.pins;
        if context.loopback_pin == Some(txd) {
            for n in (0..9 + parity).filter(|n| character >> n & 1 == 0) {
                context.line.invert(context.now + n * bit, bit);
            }
        }
        let stop_bits = 1 + u64::from(self.settings.has_two_stop_bits());
        let ends_at = context.now + (9 + parity + stop_bits) * bit;
        self.sending = Some((transfer, ends_at));
        Ok(())
    }
}

impl Peripheral for Transmission {
    fn common(&self) -> Common {
        Common::new("UARTE1", &[TXDRDY, ENDTX, TXSTARTED, TXSTOPPED], &[])
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        self.settings.read(offset)
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        match offset {
            ENABLE if value == 0 && self.sending.is_some() => {
                context.check::<()>(Err(Refusal::misused("UARTE1", "disabled while it sends")));
            }
            _ => return self.settings.write(offset, value),
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            STARTTX => {
                let started = self.start(context);
                context.check(started);
            }
            STOPTX if self.sending.is_some() => self.stops = true,
            STOPTX => context.raise(TXSTOPPED),
            _ => return None,
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.sending.map(|(_, ends_at)| ends_at)
    }

    /// Ends a byte. "If the ENDTX event has not already been generated when the UARTE transmitter
    /// has come to a stop, the UARTE will generate the ENDTX event explicitly."
    fn advance(&mut self, context: &mut Context) {
        let Some((mut transfer, _)) = self.sending.take() else {
            return;
        };
        transfer.done += 1;
        context.raise(TXDRDY);
        if transfer.done < transfer.size && !self.stops {
            let sent = self.send(transfer, context);
            context.check(sent);
            return;
        }
        self.settings.amount = transfer.done;
        context.raise(ENDTX);
        if self.stops {
            context.raise(TXSTOPPED);
        }
    }
}
