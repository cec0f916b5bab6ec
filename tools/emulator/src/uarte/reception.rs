//! UARTE0's receiver.
//!
//! Models EasyDMA reception with double-buffered RXD.PTR and RXD.MAXCNT, a FIFO, stopping, and
//! the causes of ERROR except parity. Flushing, shorts and UARTE0's transmitter are not modelled. An access to one of
//! the transmitter's registers stops the emulation. The exceptions are PSEL, and the events ENDTX and TXSTARTED,
//! because drivers clear these events.
//!
//! Where the specification is silent or chips may differ from it, [`Assumptions`](crate::Assumptions)
//! selects the behaviour.

use std::collections::VecDeque;

use super::sampler::{Heard, Sampler};
use super::{ENABLE, ENABLED, PSEL_RXD, Transfer, bit, registers};
use crate::line::SerialLine;
use crate::peripheral::{Access, Common, Context, Peripheral};

const STARTRX: u32 = 0x000;
const STOPRX: u32 = 0x004;
const RXDRDY: u32 = 0x108;
const ENDRX: u32 = 0x110;
const ENDTX: u32 = 0x120;
const ERROR: u32 = 0x124;
const RXTO: u32 = 0x144;
const RXSTARTED: u32 = 0x14C;
const TXSTARTED: u32 = 0x150;
const ERRORSRC: u32 = 0x480;
const RXD_PTR: u32 = 0x534;

const OVERRUN: u32 = 1;
const FRAMING: u32 = 1 << 2;
const BREAK: u32 = 1 << 3;

/// The time from STOPRX to RXTO, in characters. The receiver takes up to four more bytes in this time.
const STOP_AFTER: u64 = 5;

#[derive(Debug)]
pub(crate) struct Reception {
    common: Common,
    sampler: Sampler,
    transfer: Option<Transfer>,
    /// The FIFO: bytes, each with the instant from which EasyDMA may take it.
    fifo: VecDeque<(u64, u8)>,
    stops_at: Option<u64>,
    /// The instant of the pending RXSTARTED.
    started_at: Option<u64>,
    /// The instant at which a doubled ENDRX comes for the second time.
    again_at: Option<u64>,
}

/// An action of the receiver, and the instant at which it takes place, if it is pending.
type Deadline = (Option<u64>, fn(&mut Reception, &mut Context));

impl Reception {
    pub(crate) fn new() -> Self {
        // The transmitter's events never come, but drivers clear them.
        let events = [RXDRDY, ENDRX, ENDTX, ERROR, RXTO, RXSTARTED, TXSTARTED];
        // No flow control, no parity, one stop bit.
        let config = Access::Plain(0..=0);
        let mut registers = registers(RXD_PTR, Access::Plain(0..=ENABLED), config);
        // "A '1' clears."
        registers.push((ERRORSRC, 0, Access::ClearOnes));
        Self {
            common: Common::new("UARTE0", 0x4000_2000, &events, registers),
            sampler: Sampler::default(),
            transfer: None,
            fifo: VecDeque::new(),
            stops_at: None,
            started_at: None,
            again_at: None,
        }
    }

    fn start(&mut self, context: &mut Context) -> Result<(), String> {
        if self.common[ENABLE] != ENABLED {
            return Ok(());
        }
        if self.transfer.is_some() && context.assumptions.start_twice_is_ignored {
            return Ok(());
        }
        let transfer = Transfer::of(&self.common, RXD_PTR);
        if self.transfer.is_some() || transfer.size == 0 {
            return Err(
                "UARTE0: STARTRX while a transfer is open, or with RXD.MAXCNT 0".to_owned(),
            );
        }
        // Both ends of the buffer must be RAM.
        for address in [transfer.pointer, transfer.pointer + transfer.size - 1] {
            context.memory.dma_read(address, &mut [0])?;
        }
        self.transfer = Some(transfer);
        self.stops_at = None;
        self.again_at = None;
        let connected = self.common[PSEL_RXD] == context.line_pin;
        if !self.sampler.runs() && connected {
            context.line.forget_before(context.now);
            let since = if context.assumptions.start_drops_byte {
                context.line.character_ends(context.now)
            } else {
                context.now
            };
            self.sampler.start(since, bit(&self.common));
        }
        self.started_at = Some(context.now + context.assumptions.start_lag);
        if context.assumptions.start_lag == 0 {
            self.overdue_started(context);
        }
        Ok(())
    }

    /// Returns the pending actions. If several actions are due, the first of them in this list is performed first.
    fn deadlines(&self, line: &SerialLine) -> [Deadline; 5] {
        let stores = self.transfer.is_some() && self.started_at.is_none();
        let byte = self.fifo.front().filter(|_| stores);
        [
            (self.started_at, Self::overdue_started),
            (self.again_at, Self::end_again),
            (self.stops_at, Self::stopped),
            (byte.map(|(ready, _)| *ready), Self::transfer_byte),
            (self.sampler.next(line), Self::listen),
        ]
    }

    /// Raises the pending RXSTARTED now, if there is one.
    fn overdue_started(&mut self, context: &mut Context) {
        if self.started_at.take().is_some() {
            self.common.raise(RXSTARTED, context);
        }
    }

    /// Takes the byte at the head of the FIFO.
    fn pop(&mut self, context: &mut Context) -> Option<u8> {
        let (_, byte) = self.fifo.pop_front()?;
        if !self.fifo.is_empty() {
            self.common.raise(RXDRDY, context);
        }
        Some(byte)
    }

    fn error(&mut self, cause: u32, context: &mut Context) {
        self.common.set(ERRORSRC, self.common[ERRORSRC] | cause);
        self.common.raise(ERROR, context);
    }

    /// Lets the sampler act. Handles the byte or the error that the sampler finds.
    fn listen(&mut self, context: &mut Context) {
        let due = self.sampler.next(&context.line);
        let was_between = self.sampler.is_between();
        let heard = due.and_then(|at| self.sampler.advance(at, &mut context.line));
        let is_start = was_between && heard.is_none();
        if is_start && context.assumptions.overrun_at_start_bit && self.is_full(context) {
            self.fifo.pop_back();
            self.error(OVERRUN, context);
        }
        if let Some(heard) = heard {
            self.hear(heard, context);
        }
    }

    fn is_full(&self, context: &Context) -> bool {
        self.fifo.len() >= context.assumptions.fifo
    }

    fn hear(&mut self, heard: Heard, context: &mut Context) {
        match heard {
            Heard::FramingError => self.error(FRAMING, context),
            Heard::Break => self.error(BREAK, context),
            Heard::Byte(byte) => {
                if self.is_full(context) {
                    self.error(OVERRUN, context);
                    if !context.assumptions.overrun_drops_oldest {
                        return;
                    }
                    self.fifo.pop_front();
                }
                self.fifo
                    .push_back((context.now + context.assumptions.dma_lag, byte));
                // A byte is announced when it reaches the FIFO's head, as a Nordic engineer says (Zephyr#27233).
                if self.fifo.len() == 1 {
                    self.common.raise(RXDRDY, context);
                }
            }
        }
    }

    /// Moves one byte from the FIFO to RAM, if the FIFO has one and a transfer is open.
    fn transfer_byte(&mut self, context: &mut Context) {
        let Some(mut transfer) = self.transfer else {
            return;
        };
        let Some(byte) = self.pop(context) else {
            return;
        };
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
            self.overdue_started(context);
            let full = transfer.done == transfer.size;
            if !(full && lost(&mut context.assumptions.lost_end)) {
                self.common.raise(ENDRX, context);
                if context.assumptions.causeless_timeout {
                    self.common.raise(RXTO, context);
                }
                let comes_again = full && lost(&mut context.assumptions.doubled_end);
                self.again_at = comes_again.then_some(context.now + context.assumptions.double_lag);
            }
        }
    }

    fn end_again(&mut self, context: &mut Context) {
        self.again_at = None;
        self.common.raise(ENDRX, context);
    }

    /// Stops the receiver and raises RXTO. Before RXTO, moves as many bytes from the FIFO as fit into the open
    /// transfer, and ends the transfer.
    fn stopped(&mut self, context: &mut Context) {
        while self.transfer.is_some() && !self.fifo.is_empty() {
            self.transfer_byte(context);
        }
        self.end_transfer(context);
        self.stops_at = None;
        self.sampler.stop();
        if !lost(&mut context.assumptions.lost_timeout) {
            self.common.raise(RXTO, context);
        }
    }
}

/// Returns whether this event is lost or doubled. `count` is the number of events that are still to be lost or doubled,
/// and this function decrements it. [`u32::MAX`] means every event.
fn lost(count: &mut u32) -> bool {
    let lost = *count > 0;
    if *count < u32::MAX {
        *count = count.saturating_sub(1);
    }
    lost
}

impl Peripheral for Reception {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        if offset == ERRORSRC {
            self.again_at = None;
        }
        self.common.load(offset)
    }

    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()> {
        let clears_all = offset == ERRORSRC && context.assumptions.any_write_clears;
        self.common
            .store(offset, if clears_all { u32::MAX } else { value })?;
        if offset == ENABLE && value == 0 {
            *self = Self {
                common: self.common.clone(),
                ..Self::new()
            };
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            STARTRX => {
                let started = self.start(context);
                context.check(started)?;
            }
            STOPRX => {
                if self.transfer.is_some() || self.sampler.runs() {
                    let stops_at = context.now + STOP_AFTER * 10 * bit(&self.common);
                    self.stops_at.get_or_insert(stops_at);
                }
            }
            _ => return None,
        }
        Some(())
    }

    fn next(&self, line: &SerialLine) -> Option<u64> {
        self.deadlines(line).iter().filter_map(|(at, _)| *at).min()
    }

    fn advance(&mut self, context: &mut Context) {
        let deadlines = self.deadlines(&context.line).into_iter();
        let mut due = deadlines.filter(|(at, _)| at.is_some_and(|at| at <= context.now));
        if let Some((_, act)) = due.next() {
            act(self, context);
        }
    }
}
