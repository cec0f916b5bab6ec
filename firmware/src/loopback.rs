//! The self-test's wire, without interrupts: UARTE1 sends, UARTE0 receives, 1 Mbaud.

use cortex_m::peripheral::DWT;
use nrf52840_hal::gpio::{Input, Output, Pin, PullUp, PushPull};
use nrf52840_hal::pac::uarte0::RegisterBlock;
use nrf52840_hal::pac::uarte0::baudrate::BAUDRATE_A;
use nrf52840_hal::pac::{UARTE0, UARTE1};

/// Longer than anything takes that comes at all, in cycles: 5 ms.
const LONG: u32 = 5 * 64_000;
/// Ten bytes at 1 Mbaud, in cycles: what was sent is received by then.
const SOON: u32 = 6_400;

/// Lets that many cycles pass.
pub(crate) fn pause(cycles: u32) {
    wait(cycles, || false);
}

/// Waits until that is so, but not longer: cycles until then.
fn wait(longest: u32, is_so: impl Fn() -> bool) -> Option<u32> {
    let began = DWT::cycle_count();
    loop {
        let cycles = DWT::cycle_count().wrapping_sub(began);
        if is_so() {
            return Some(cycles);
        }
        if cycles >= longest {
            return None;
        }
    }
}

/// UARTE1's transmitter. What it sends is in RAM.
pub(crate) struct Sender(UARTE1);

impl Sender {
    #[expect(clippy::needless_pass_by_value, reason = "the pin is given up here")]
    pub(crate) fn new(uarte: UARTE1, pin: Pin<Output<PushPull>>) -> Self {
        // SAFETY: the value is a pin's own, and the pin is given up here.
        uarte.psel.txd.write(|w| unsafe { w.bits(pin.psel_bits()) });
        uarte.enable.write(|w| w.enable().enabled());
        let sender = Self(uarte);
        sender.set_baud(BAUDRATE_A::BAUD1M);
        sender
    }

    pub(crate) fn set_baud(&self, baud: BAUDRATE_A) {
        self.0.baudrate.write(|w| w.baudrate().variant(baud));
    }

    /// Sends these bytes; meanwhile that is done. Returns when the last stop bit is over.
    pub(crate) fn send(&self, bytes: &[u8], meanwhile: impl FnOnce()) {
        self.0.events_endtx.reset();
        // SAFETY: the place and length of the bytes, which are borrowed until they are sent.
        unsafe {
            self.0.txd.ptr.write(|w| w.bits(bytes.as_ptr() as u32));
            self.0.txd.maxcnt.write(|w| w.bits(bytes.len() as u32));
        }
        self.0.tasks_starttx.write(|w| w.tasks_starttx().set_bit());
        meanwhile();
        while self.0.events_endtx.read().bits() == 0 {}
    }

    /// Sends a byte with an even parity bit. A receiver that expects none takes it for the stop bit:
    /// a bad one, if the byte has an even number of ones.
    pub(crate) fn send_with_parity(&self, byte: &[u8]) {
        self.0.config.write(|w| w.parity().included());
        self.send(byte, || {});
        self.0.config.reset();
        pause(SOON);
    }
}

/// UARTE0's receiver. Nobody looks at what it receives, only at how much.
pub(crate) struct Receiver<'a> {
    uarte: &'a RegisterBlock,
    /// Where it receives: borrowed as long as it may.
    _memory: &'a mut [u8],
    /// How often it was stopped, how often RXTO came then, and how often ENDRX of the flush.
    pub(crate) stops: u32,
    pub(crate) timeouts: u32,
    pub(crate) flush_ends: u32,
    /// The most cycles from FLUSHRX to ENDRX.
    pub(crate) slowest_flush: u32,
}

impl<'a> Receiver<'a> {
    pub(crate) fn new(uarte: &'a UARTE0, pin: &Pin<Input<PullUp>>, memory: &'a mut [u8]) -> Self {
        // SAFETY: the value is a pin's own.
        uarte.psel.rxd.write(|w| unsafe { w.bits(pin.psel_bits()) });
        uarte.baudrate.write(|w| w.baudrate().baud1m());
        uarte.enable.write(|w| w.enable().enabled());
        // SAFETY: the memory's place and length. It is ours, and is not read.
        unsafe {
            (uarte.rxd.ptr).write(|w| w.bits(memory.as_mut_ptr() as u32));
            (uarte.rxd.maxcnt).write(|w| w.bits(memory.len() as u32));
        }
        Self {
            uarte,
            _memory: memory,
            stops: 0,
            timeouts: 0,
            flush_ends: 0,
            slowest_flush: 0,
        }
    }

    /// Fills the memory, again and again.
    pub(crate) fn start(&self) {
        self.uarte.events_rxto.reset();
        self.uarte.shorts.write(|w| w.endrx_startrx().set_bit());
        (self.uarte.tasks_startrx).write(|w| w.tasks_startrx().set_bit());
        pause(SOON);
    }

    /// Waits until the memory is full: cycles until then.
    pub(crate) fn end(&self) -> Option<u32> {
        let end = wait(LONG, || self.uarte.events_endrx.read().bits() != 0);
        self.uarte.events_endrx.reset();
        end
    }

    /// Whether RXTO came since the start.
    pub(crate) fn has_timed_out(&self) -> bool {
        self.uarte.events_rxto.read().bits() != 0
    }

    /// Stops when what was sent is received, and empties the FIFO. Returns RXD.AMOUNT before that.
    pub(crate) fn stop(&mut self) -> u32 {
        pause(SOON);
        self.uarte.shorts.reset();
        self.uarte.events_rxto.reset();
        (self.uarte.tasks_stoprx).write(|w| w.tasks_stoprx().set_bit());
        self.stops += 1;
        self.timeouts += u32::from(wait(LONG, || self.has_timed_out()).is_some());
        let amount = self.uarte.rxd.amount.read().bits();
        self.uarte.events_endrx.reset();
        (self.uarte.tasks_flushrx).write(|w| w.tasks_flushrx().set_bit());
        if let Some(cycles) = self.end() {
            self.flush_ends += 1;
            self.slowest_flush = self.slowest_flush.max(cycles);
        }
        amount
    }

    /// Forgets the errors that it saw.
    pub(crate) fn clear_errors(&self) {
        self.uarte.events_error.reset();
        // SAFETY: writing 1 to a cause clears it.
        (self.uarte.errorsrc).write(|w| unsafe { w.bits(0xF) });
    }
}
