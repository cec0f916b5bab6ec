//! UARTE0's receiver.
//!
//! Models EasyDMA reception with double-buffered RXD.PTR and RXD.MAXCNT, a FIFO, parity, stopping, flushing, and the
//! causes of ERROR. Shorts and UARTE0's transmitter are not modelled. An access to one of the transmitter's registers
//! stops the emulation. The exceptions are PSEL, and the events ENDTX and TXSTARTED, because drivers clear these
//! events.
//!
//! Where the specification is silent or chips may differ from it, [`Assumptions`](crate::Assumptions)
//! selects the behaviour.

use std::collections::VecDeque;

use super::sampler::{Heard, Sampler};
use super::{CONFIG, ENABLE, ENABLED, PSEL_RXD, Transfer, bit, registers};
use crate::line::SerialLine;
use crate::peripheral::{Access, Common, Context, Peripheral};

const STARTRX: u32 = 0x000;
const STOPRX: u32 = 0x004;
const FLUSHRX: u32 = 0x02C;
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
const WRONG_PARITY: u32 = 1 << 1;
const FRAMING: u32 = 1 << 2;
const BREAK: u32 = 1 << 3;

/// The time for which the receiver runs on after STOPRX by default, in bits. It is the length of five bytes.
const STOP_AFTER: u64 = 50;

#[derive(Debug)]
pub(crate) struct Reception {
    common: Common,
    sampler: Sampler,
    transfer: Option<Transfer>,
    /// The FIFO: bytes, each with the instant from which EasyDMA may take it.
    fifo: VecDeque<(u64, u8)>,
    /// After STOPRX, the instant at which the receiver stops.
    stops_at: Option<u64>,
    /// After STOPRX, the instant of RXTO.
    timeout_at: Option<u64>,
    /// After STOPRX, the instant from which the receiver may be switched off: [`STOP_AFTER`] bits after STOPRX, or RXTO
    /// if RXTO comes earlier.
    off_from: Option<u64>,
    /// The instant of the pending RXSTARTED.
    started_at: Option<u64>,
    /// The instant of the pending ENDRX of a full transfer.
    ended_at: Option<u64>,
    /// The instant at which a doubled ENDRX comes for the second time.
    again_at: Option<u64>,
}

/// The instant at which an action of the receiver is due, if the action is pending, and the action.
type Deadline = (Option<u64>, fn(&mut Reception, &mut Context));

impl Reception {
    pub(crate) fn new() -> Self {
        // The transmitter's events never come, but drivers clear them.
        let events = [RXDRDY, ENDRX, ENDTX, ERROR, RXTO, RXSTARTED, TXSTARTED];
        let mut registers = registers(RXD_PTR, Access::Plain(0..=ENABLED));
        // "A '1' clears."
        registers.push((ERRORSRC, 0, Access::ClearOnes));
        Self {
            common: Common::new("UARTE0", 0x4000_2000, &events, registers),
            sampler: Sampler::default(),
            transfer: None,
            fifo: VecDeque::new(),
            stops_at: None,
            timeout_at: None,
            off_from: None,
            started_at: None,
            ended_at: None,
            again_at: None,
        }
    }

    /// Returns whether the receiver runs, or EasyDMA may write to RAM.
    fn runs(&self) -> bool {
        self.transfer.is_some() || self.sampler.runs()
    }

    /// Opens a transfer.
    fn open(&mut self, context: &Context) -> Result<(), String> {
        let transfer = Transfer::of(&self.common, RXD_PTR);
        if self.transfer.is_some() || transfer.size == 0 {
            let how = "STARTRX or FLUSHRX while a transfer is open, or with RXD.MAXCNT 0";
            return Err(format!("UARTE0: {how}"));
        }
        // Both ends of the buffer must be RAM.
        for address in [transfer.pointer, transfer.pointer + transfer.size - 1] {
            context.memory.dma_read(address, &mut [0])?;
        }
        self.transfer = Some(transfer);
        Ok(())
    }

    fn start(&mut self, context: &mut Context) -> Result<(), String> {
        let assumptions = context.assumptions;
        let is_ignored = self.transfer.is_some() && assumptions.start_twice_is_ignored;
        if context.deviates("start_twice_is_ignored", is_ignored) {
            return Ok(());
        }
        self.open(context)?;
        (self.stops_at, self.timeout_at, self.off_from) = (None, None, None);
        self.again_at = None;
        let connected = self.common[PSEL_RXD] == context.line_pin;
        if !self.sampler.runs() && connected {
            context.line.forget_before(context.now);
            let mut since = context.line.character_ends(context.now);
            let drops = assumptions.start_drops_byte && since > context.now;
            if !context.deviates("start_drops_byte", drops) {
                since = context.now;
            }
            let parity = self.common[CONFIG] != 0;
            self.sampler.start(since, bit(&self.common), parity);
        }
        self.started_at = Some(context.now + assumptions.start_lag);
        if !context.deviates("start_lag", assumptions.start_lag > 0) {
            self.overdue_started(context);
        }
        Ok(())
    }

    /// Handles STOPRX: schedules RXTO and the receiver's stop.
    fn stop(&mut self, context: &mut Context) {
        if self.runs() && self.off_from.is_none() {
            let assumptions = context.assumptions;
            let bit = bit(&self.common);
            let stopped = context.now + STOP_AFTER * bit;
            self.off_from = Some(stopped);
            if context.deviates("stop_is_ignored", assumptions.stop_is_ignored) {
                return;
            }
            let mut bits = assumptions.bits_to_timeout;
            context.deviates("early_timeout", bits < STOP_AFTER);
            context.deviates("late_timeout", bits > STOP_AFTER);
            let longer = assumptions.timeout_counts_parity && self.common[CONFIG] != 0;
            if context.deviates("timeout_counts_parity", longer) {
                bits += bits / 10;
            }
            let timeout = context.now + bits * bit;
            self.timeout_at = Some(timeout);
            self.stops_at = Some(stopped.max(timeout));
        }
    }

    /// Handles FLUSHRX: opens a transfer, moves as many bytes as fit from the FIFO to RAM, and ends the transfer.
    fn flush(&mut self, context: &mut Context) -> Result<(), String> {
        self.open(context)?;
        if !context.deviates("flush_is_silent", context.assumptions.flush_is_silent) {
            self.common.raise(RXSTARTED, context);
        }
        self.empty_fifo(context);
        Ok(())
    }

    /// Returns all actions. If several actions are due, the first of them in this list is performed first.
    fn deadlines(&self, line: &SerialLine) -> [Deadline; 7] {
        let stores = self.transfer.is_some() && self.started_at.is_none();
        let byte = self.fifo.front().filter(|_| stores);
        [
            (self.started_at, Self::overdue_started),
            (self.ended_at, Self::end),
            (self.again_at, Self::end_again),
            (self.stops_at, Self::stopped),
            (self.timeout_at, Self::timed_out),
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
            let oldest = context.assumptions.overrun_drops_oldest;
            if context.deviates("oldest_lost_at_start_bit", oldest) {
                self.fifo.pop_front();
            } else {
                context.deviates("overrun_at_start_bit", true);
                self.fifo.pop_back();
            }
            self.error(OVERRUN, context);
        }
        if let Some(heard) = heard {
            self.hear(heard, context);
        }
    }

    fn is_full(&self, context: &mut Context) -> bool {
        let size = context.assumptions.fifo;
        let is_full = self.fifo.len() >= size;
        context.deviates("fifo", is_full && size < 6);
        is_full
    }

    fn hear(&mut self, heard: Heard, context: &mut Context) {
        match heard {
            Heard::FramingError => self.error(FRAMING, context),
            Heard::Break => self.error(BREAK, context),
            Heard::Byte(byte, is_right) => {
                if !is_right {
                    self.error(WRONG_PARITY, context);
                }
                let assumptions = context.assumptions;
                if self.is_full(context) {
                    self.error(OVERRUN, context);
                    let drops_oldest = assumptions.overrun_drops_oldest;
                    if !context.deviates("overrun_drops_oldest", drops_oldest) {
                        return;
                    }
                    self.fifo.pop_front();
                }
                context.deviates("dma_lag", assumptions.dma_lag != 32);
                self.fifo
                    .push_back((context.now + assumptions.dma_lag, byte));
                // RXDRDY comes when a byte reaches the FIFO's head, according to a Nordic engineer (Zephyr#27233).
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
        let Some((_, byte)) = self.fifo.pop_front() else {
            return;
        };
        if !self.fifo.is_empty() {
            self.common.raise(RXDRDY, context);
        }
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
            if transfer.done < transfer.size {
                self.common.raise(ENDRX, context);
                return;
            }
            let lost = &mut context.assumptions.lost_end;
            let is_lost = *lost > 0;
            *lost -= u32::from(is_lost && *lost < u32::MAX);
            if !context.deviates("lost_end", is_lost) {
                let lag = context.assumptions.end_lag;
                context.deviates("end_lag", lag > 0);
                self.ended_at = Some(context.now + lag);
            }
        }
    }

    /// Raises the ENDRX of a full transfer.
    fn end(&mut self, context: &mut Context) {
        self.ended_at = None;
        self.common.raise(ENDRX, context);
        if context.deviates("causeless_timeout", context.assumptions.causeless_timeout) {
            self.raise_timeout(context);
        }
        let again = context.assumptions.doubled_end;
        self.again_at = again.map(|lag| context.now + lag);
    }

    fn end_again(&mut self, context: &mut Context) {
        context.deviates("doubled_end", true);
        self.again_at = None;
        self.common.raise(ENDRX, context);
    }

    /// Moves as many bytes from the FIFO as fit into the open transfer, and ends the transfer.
    fn empty_fifo(&mut self, context: &mut Context) {
        while self.transfer.is_some() && !self.fifo.is_empty() {
            self.transfer_byte(context);
        }
        self.end_transfer(context);
    }

    /// Stops the receiver.
    fn stopped(&mut self, context: &mut Context) {
        self.empty_fifo(context);
        self.stops_at = None;
        self.sampler.stop();
    }

    /// Raises the RXTO that follows STOPRX.
    fn timed_out(&mut self, context: &mut Context) {
        self.timeout_at = None;
        self.raise_timeout(context);
    }

    fn raise_timeout(&mut self, context: &mut Context) {
        self.common.raise(RXTO, context);
        self.off_from = self.off_from.map(|at| at.min(context.now));
    }
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
        let clears_all = context.deviates("any_write_clears", clears_all);
        self.common
            .store(offset, if clears_all { u32::MAX } else { value })?;
        if offset == ENABLE && value == 0 {
            // Reject switching off while the receiver runs, because the specification does not say what then happens to
            // a byte that is being received, or to EasyDMA.
            if self.runs() && self.off_from.is_none_or(|at| context.now < at) {
                let refusal = "UARTE0: switched off while its receiver runs";
                context.refuse(refusal.to_owned());
            }
            *self = Self {
                common: self.common.clone(),
                ..Self::new()
            };
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            STARTRX | FLUSHRX if self.common[ENABLE] != ENABLED => {}
            STARTRX => {
                let started = self.start(context);
                context.check(started)?;
            }
            STOPRX => self.stop(context),
            FLUSHRX => {
                let flushed = self.flush(context);
                context.check(flushed)?;
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
