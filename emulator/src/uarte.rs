//! UARTE0's receiver: nRF52840 Product Specification, section "UARTE".
//!
//! EasyDMA reception with double-buffered RXD.PTR and RXD.MAXCNT, a FIFO of six bytes, the shorts
//! from ENDRX, stopping and flushing, and all four causes of ERROR. The transmitter and hardware
//! flow control are not modelled: their registers are refused, the PSEL of unused pins apart.
//!
//! Where the specification is silent, [`Assumptions`] says what is assumed.

mod assumptions;
mod receiver;

use std::collections::VecDeque;

use crate::error::Refusal;
use crate::line::Line;
use crate::peripheral::{Common, Context, Peripheral};
use crate::time::MICROSECOND;
pub use assumptions::Assumptions;
use receiver::{Heard, Receiver};

const STARTRX: u32 = 0x000;
const STOPRX: u32 = 0x004;
const FLUSHRX: u32 = 0x02C;
const RXDRDY: u32 = 0x108;
const ENDRX: u32 = 0x110;
const ERROR: u32 = 0x124;
const RXTO: u32 = 0x144;
const RXSTARTED: u32 = 0x14C;
const ERRORSRC: u32 = 0x480;
const ENABLE: u32 = 0x500;
const PSEL_RTS: u32 = 0x508;
const PSEL_TXD: u32 = 0x50C;
const PSEL_CTS: u32 = 0x510;
const PSEL_RXD: u32 = 0x514;
const BAUDRATE: u32 = 0x524;
const RXD_PTR: u32 = 0x534;
const RXD_MAXCNT: u32 = 0x538;
const RXD_AMOUNT: u32 = 0x53C;
const CONFIG: u32 = 0x56C;

const SHORT_ENDRX_STARTRX: u32 = 1 << 5;
const SHORT_ENDRX_STOPRX: u32 = 1 << 6;
const OVERRUN: u32 = 1;
const PARITY: u32 = 1 << 1;
const FRAMING: u32 = 1 << 2;
const BREAK: u32 = 1 << 3;
const ENABLED: u32 = 8;
const CONFIG_PARITY: u32 = 7 << 1;

/// Bytes that the receiver holds while no transfer is open.
const FIFO: usize = 6;
/// Character times from STOPRX to RXTO: up to four more bytes are received, then it times out.
const STOP_AFTER: u64 = 5;

/// An open EasyDMA transfer.
#[derive(Clone, Copy, Debug)]
struct Transfer {
    pointer: u32,
    size: u32,
    done: u32,
}

#[derive(Clone, Debug)]
pub(crate) struct Uarte {
    pub(crate) assumptions: Assumptions,
    pub(crate) line: Line,
    /// The pin to which the line is wired, as PSEL has it.
    pub(crate) line_pin: u32,
    receiver: Receiver,
    transfer: Option<Transfer>,
    /// Bytes, and from when on EasyDMA may take them.
    fifo: VecDeque<(u64, u8)>,
    stops_at: Option<u64>,
    error_source: u32,
    enable: u32,
    /// RTS, TXD, CTS, RXD.
    pins: [u32; 4],
    baud: u32,
    configuration: u32,
    pointer: u32,
    size: u32,
    amount: u32,
}

impl Uarte {
    pub(crate) fn new(line_pin: u32) -> Self {
        Self {
            assumptions: Assumptions::default(),
            line: Line::new(),
            line_pin,
            receiver: Receiver::new(),
            transfer: None,
            fifo: VecDeque::new(),
            stops_at: None,
            error_source: 0,
            enable: 0,
            pins: [u32::MAX; 4],
            baud: 0x0400_0000,
            configuration: 0,
            pointer: 0,
            size: 0,
            amount: 0,
        }
    }

    /// Cycles of a bit. The "actual rates" that the section lists beside the values of BAUDRATE are
    /// those of whole cycles of 16 MHz: 115 108 baud for 0x01D60000.
    fn bit(&self) -> u64 {
        let cycles_of_16_mhz = (1 << 32) / u64::from(self.baud.max(1));
        cycles_of_16_mhz.max(1) * (MICROSECOND / 16)
    }

    fn start(&mut self, context: &mut Context) -> Result<(), Refusal> {
        if self.enable != ENABLED {
            return Ok(());
        }
        if self.transfer.is_some() {
            return Err(Refusal::StartWhileReceiving);
        }
        if self.size == 0 {
            return Err(Refusal::EmptyTransfer);
        }
        // Both ends of the buffer must be RAM.
        let mut byte = [0];
        context.memory.dma_read(self.pointer, &mut byte)?;
        context
            .memory
            .dma_read(self.pointer + self.size - 1, &mut byte)?;
        self.transfer = Some(Transfer {
            pointer: self.pointer,
            size: self.size,
            done: 0,
        });
        self.stops_at = None;
        let connected = self.pins.last() == Some(&self.line_pin);
        if !self.receiver.runs() && connected {
            let parity = self.configuration & CONFIG_PARITY != 0;
            self.line.forget_before(context.now);
            self.receiver.start(context.now, self.bit(), parity);
        }
        context.raise(RXSTARTED);
        Ok(())
    }

    /// After RXTO: what is left in the FIFO goes to RXD.PTR. AMOUNT keeps its old value when nothing
    /// is left, which drivers in the field work around.
    fn flush(&mut self, context: &mut Context) -> Result<(), Refusal> {
        if self.receiver.runs() {
            return Err(Refusal::FlushWhileReceiving);
        }
        let room = (self.size as usize).min(self.fifo.len());
        let bytes: Vec<u8> = self.fifo.drain(..room).map(|(_, byte)| byte).collect();
        context.memory.dma_write(self.pointer, &bytes)?;
        if let Ok(amount @ 1..) = u32::try_from(bytes.len()) {
            self.amount = amount;
        }
        context.raise(ENDRX);
        Ok(())
    }

    fn error(&mut self, cause: u32, context: &mut Context) {
        self.error_source |= cause;
        context.raise(ERROR);
    }

    fn hear(&mut self, heard: Heard, context: &mut Context) {
        match heard {
            Heard::FramingError => {
                if self.assumptions.ready_on_framing_error {
                    context.raise(RXDRDY);
                }
                self.error(FRAMING, context);
            }
            Heard::Break => self.error(BREAK, context),
            Heard::Byte { byte, parity_error } => {
                if self.fifo.len() >= FIFO {
                    if self.assumptions.ready_on_overrun {
                        context.raise(RXDRDY);
                    }
                    return self.error(OVERRUN, context);
                }
                self.fifo
                    .push_back((context.now + self.assumptions.dma_lag, byte));
                context.raise(RXDRDY);
                if parity_error {
                    self.error(PARITY, context);
                }
            }
        }
    }

    /// Moves one byte from the FIFO to RAM, if it is time.
    fn transfer_byte(&mut self, now: u64, context: &mut Context) {
        let (Some(mut transfer), Some((ready, byte))) = (self.transfer, self.fifo.front().copied())
        else {
            return;
        };
        if ready > now {
            return;
        }
        self.fifo.pop_front();
        let address = transfer.pointer + transfer.done;
        let written = context.memory.dma_write(address, &[byte]);
        context.check(written);
        transfer.done += 1;
        self.transfer = Some(transfer);
        if transfer.done == transfer.size {
            self.end_transfer(context);
        }
    }

    fn end_transfer(&mut self, context: &mut Context) {
        if let Some(transfer) = self.transfer.take() {
            self.amount = transfer.done;
            context.raise(ENDRX);
        }
    }

    /// RXTO. What is in the FIFO goes into the open transfer as far as there is room, and the
    /// transfer ends, full or not.
    fn stopped(&mut self, context: &mut Context) {
        self.stops_at = None;
        while self.transfer.is_some() && !self.fifo.is_empty() {
            self.transfer_byte(u64::MAX, context);
        }
        self.end_transfer(context);
        self.receiver.stop();
        context.raise(RXTO);
    }

    fn disable(&mut self) {
        self.receiver.stop();
        self.transfer = None;
        self.fifo.clear();
        self.stops_at = None;
    }
}

impl Peripheral for Uarte {
    fn common(&self) -> Common {
        let events = [RXDRDY, ENDRX, ERROR, RXTO, RXSTARTED];
        Common::new("UARTE0", &events, SHORT_ENDRX_STARTRX | SHORT_ENDRX_STOPRX)
    }

    fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            ERRORSRC => self.error_source,
            ENABLE => self.enable,
            PSEL_RTS..=PSEL_RXD => *self.pins.get(((offset - PSEL_RTS) / 4) as usize)?,
            BAUDRATE => self.baud,
            RXD_PTR => self.pointer,
            RXD_MAXCNT => self.size,
            RXD_AMOUNT => self.amount,
            CONFIG => self.configuration,
            _ => return None,
        })
    }

    fn write(&mut self, offset: u32, value: u32, _: &mut Context) -> Option<()> {
        match offset {
            // "A '1' clears."
            ERRORSRC => self.error_source &= !value,
            ENABLE if value == 0 || value == ENABLED => {
                self.enable = value;
                if value == 0 {
                    self.disable();
                }
            }
            PSEL_RTS | PSEL_TXD | PSEL_CTS | PSEL_RXD => {
                *self.pins.get_mut(((offset - PSEL_RTS) / 4) as usize)? = value;
            }
            BAUDRATE if value != 0 => self.baud = value,
            RXD_PTR => self.pointer = value,
            RXD_MAXCNT if value <= 0xFFFF => self.size = value,
            // No flow control, one stop bit.
            CONFIG if value & !CONFIG_PARITY == 0 => self.configuration = value,
            _ => return None,
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        let outcome = match offset {
            STARTRX => self.start(context),
            STOPRX => {
                if self.transfer.is_some() || self.receiver.runs() {
                    let character = 10 * self.bit();
                    let stops_at = context.now + STOP_AFTER * character;
                    self.stops_at.get_or_insert(stops_at);
                }
                Ok(())
            }
            FLUSHRX => self.flush(context),
            _ => return None,
        };
        context.check(outcome);
        Some(())
    }

    fn shorted(&self, event: u32, shorts: u32) -> [Option<u32>; 2] {
        let short = |bit, task| (event == ENDRX && shorts & bit != 0).then_some(task);
        [
            short(SHORT_ENDRX_STARTRX, STARTRX),
            short(SHORT_ENDRX_STOPRX, STOPRX),
        ]
    }

    fn next(&self) -> Option<u64> {
        let byte = self
            .transfer
            .and(self.fifo.front())
            .map(|(ready, _)| *ready);
        let heard = self.receiver.next(&self.line);
        [byte, heard, self.stops_at].into_iter().flatten().min()
    }

    fn advance(&mut self, context: &mut Context) {
        let now = context.now;
        if self.stops_at.is_some_and(|at| at <= now) {
            return self.stopped(context);
        }
        let ready = self.fifo.front().is_some_and(|(ready, _)| *ready <= now);
        if self.transfer.is_some() && ready {
            return self.transfer_byte(now, context);
        }
        if let Some(at) = self.receiver.next(&self.line).filter(|at| *at <= now)
            && let Some(heard) = self.receiver.advance(at, &mut self.line)
        {
            self.hear(heard, context);
        }
    }
}
