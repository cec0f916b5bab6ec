//! UARTE1's transmitter, for firmware whose TX pin is wired to UARTE0's RX pin. Its receiver, and
//! hardware flow control, are not modelled.
//!
//! Each byte is fetched by EasyDMA when its start bit begins; TXDRDY comes at the end of its last
//! stop bit, and ENDTX with the last TXDRDY.

use super::settings::{CONFIG_PARITY, CONFIG_TWO_STOP_BITS, ENABLE, Settings, TXD};
use crate::error::Refusal;
use crate::peripheral::{Common, Context, Peripheral};

const STARTTX: u32 = 0x008;
const STOPTX: u32 = 0x00C;
const TXDRDY: u32 = 0x11C;
const ENDTX: u32 = 0x120;
const TXSTARTED: u32 = 0x150;
const TXSTOPPED: u32 = 0x158;

/// An EasyDMA transfer under way.
#[derive(Clone, Copy, Debug)]
struct Transfer {
    pointer: u32,
    size: u32,
    done: u32,
    /// When the byte is over that is being sent.
    ends_at: u64,
    stops: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct Transmitter {
    /// The pin that is wired to the line, as PSEL has it.
    pub(crate) wired_pin: Option<u32>,
    transfer: Option<Transfer>,
    settings: Settings,
}

impl Transmitter {
    pub(crate) fn new() -> Self {
        Self {
            wired_pin: None,
            transfer: None,
            settings: Settings::new(CONFIG_PARITY | CONFIG_TWO_STOP_BITS, TXD),
        }
    }

    fn start(&mut self, context: &mut Context) -> Result<(), Refusal> {
        if !self.settings.is_enabled() {
            return Ok(());
        }
        if self.transfer.is_some() {
            return Err(Refusal::Transmitter("STARTTX while it sends"));
        }
        if self.settings.size == 0 {
            return Err(Refusal::Transmitter("STARTTX with TXD.MAXCNT 0"));
        }
        context.raise(TXSTARTED);
        self.send(
            Transfer {
                pointer: self.settings.pointer,
                size: self.settings.size,
                done: 0,
                ends_at: 0,
                stops: false,
            },
            context,
        )
    }

    /// Puts the transfer's next byte on the line.
    fn send(&mut self, mut transfer: Transfer, context: &mut Context) -> Result<(), Refusal> {
        let mut byte = [0];
        let address = transfer.pointer + transfer.done;
        context.memory.dma_read(address, &mut byte)?;
        let [byte] = byte;
        let (bit, parity) = (self.settings.bit(), u64::from(self.settings.has_parity()));
        // Start bit, byte, parity bit if any; the line is high where it is not made low.
        let character = u32::from(byte) << 1 | (byte.count_ones() & 1) << 9;
        let [_, txd, ..] = self.settings.pins;
        if self.wired_pin == Some(txd) {
            let low = (0..9 + parity).filter(|n| character >> n & 1 == 0);
            let low = low.map(|n| (context.now + n * bit, bit));
            context.low.extend(low);
        }
        let stop_bits = 1 + u64::from(self.settings.has_two_stop_bits());
        transfer.ends_at = context.now + (9 + parity + stop_bits) * bit;
        self.transfer = Some(transfer);
        Ok(())
    }
}

impl Peripheral for Transmitter {
    fn common(&self) -> Common {
        Common::new("UARTE1", &[TXDRDY, ENDTX, TXSTARTED, TXSTOPPED], 0)
    }

    fn read(&self, offset: u32, _: u64) -> Option<u32> {
        self.settings.read(offset)
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        match offset {
            ENABLE if value == 0 && self.transfer.is_some() => {
                context.check::<()>(Err(Refusal::Transmitter("disabled while it sends")));
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
            STOPTX => match &mut self.transfer {
                Some(transfer) => transfer.stops = true,
                None => context.raise(TXSTOPPED),
            },
            _ => return None,
        }
        Some(())
    }

    fn next(&self) -> Option<u64> {
        self.transfer.map(|transfer| transfer.ends_at)
    }

    /// A byte is over. "If the ENDTX event has not already been generated when the UARTE transmitter
    /// has come to a stop, the UARTE will generate the ENDTX event explicitly."
    fn advance(&mut self, context: &mut Context) {
        let Some(mut transfer) = self.transfer.take() else {
            return;
        };
        transfer.done += 1;
        context.raise(TXDRDY);
        if transfer.done < transfer.size && !transfer.stops {
            let sent = self.send(transfer, context);
            context.check(sent);
            return;
        }
        self.settings.amount = transfer.done;
        context.raise(ENDTX);
        if transfer.stops {
            context.raise(TXSTOPPED);
        }
    }
}
