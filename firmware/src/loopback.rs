//! The self-test's loopback wire: UARTE1 sends and UARTE0 receives. Both start at 1 Mbaud. This module uses no
//! interrupts.

use core::sync::atomic::{AtomicU8, Ordering, compiler_fence};

use cortex_m::peripheral::DWT;
use nrf52840_hal::gpio::{Output, Pin, PushPull};
use nrf52840_hal::pac::uarte0::RegisterBlock;
use nrf52840_hal::pac::uarte0::baudrate::BAUDRATE_A;
use nrf52840_hal::pac::{UARTE0, UARTE1};

use crate::receive::connect;
use crate::settings::InputPin;

/// Duration of a byte at 1 Mbaud, in cycles.
pub(crate) const BYTE: u32 = 640;
/// The time limit for waiting, in cycles: 5 ms. If an event has not come by then, it will never come.
const LONG: u32 = 5 * 64_000;

/// Waits for this number of cycles.
pub(crate) fn pause(cycles: u32) {
    wait(cycles, || false);
}

/// Waits until `is_so` returns true, but at most `longest` cycles. Returns the cycles waited, or `None` at the limit.
pub(crate) fn wait(longest: u32, is_so: impl Fn() -> bool) -> Option<u32> {
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

/// UARTE1's transmitter. It can only send bytes that are in RAM.
pub(crate) struct Sender(UARTE1);

impl Sender {
    #[expect(clippy::needless_pass_by_value, reason = "the pin is given up here")]
    pub(crate) fn new(uarte: UARTE1, pin: Pin<Output<PushPull>>) -> Self {
        // SAFETY: the value comes from a pin, and this function consumes the pin.
        uarte.psel.txd.write(|w| unsafe { w.bits(pin.psel_bits()) });
        uarte.enable.write(|w| w.enable().enabled());
        let sender = Self(uarte);
        sender.set_baud(BAUDRATE_A::BAUD1M);
        sender
    }

    pub(crate) fn set_baud(&self, baud: BAUDRATE_A) {
        self.0.baudrate.write(|w| w.baudrate().variant(baud));
    }

    /// Sends these bytes and calls `meanwhile` during the transmission. Then waits for ENDTX, and 20 us more.
    /// Returns the cycle count at which it saw ENDTX.
    pub(crate) fn send(&self, bytes: &[u8], meanwhile: impl FnOnce()) -> u32 {
        self.0.events_endtx.reset();
        // SAFETY: the address and the length describe `bytes`, which stay borrowed until they are sent.
        unsafe {
            self.0.txd.ptr.write(|w| w.bits(bytes.as_ptr() as u32));
            self.0.txd.maxcnt.write(|w| w.bits(bytes.len() as u32));
        }
        self.0.tasks_starttx.write(|w| w.tasks_starttx().set_bit());
        meanwhile();
        while self.0.events_endtx.read().bits() == 0 {}
        let ended = DWT::cycle_count();
        pause(2 * BYTE);
        ended
    }

    /// Sends a byte with an even parity bit. A receiver that expects no parity mistakes this bit for the stop bit. If
    /// the byte has an even number of ones, the parity bit is 0, so the receiver sees a bad stop bit.
    pub(crate) fn send_with_parity(&self, byte: &[u8]) {
        self.0.config.write(|w| w.parity().included());
        self.send(byte, || {});
        self.0.config.reset();
    }
}

/// The byte in RAM to which UARTE0 writes.
static BYTE_IN_MEMORY: AtomicU8 = AtomicU8::new(0);

/// UARTE0's receiver, which uses one-byte transfers.
pub(crate) struct Receiver<'a>(&'a RegisterBlock);

impl<'a> Receiver<'a> {
    pub(crate) fn new(uarte: &'a UARTE0, pin: &InputPin) -> Self {
        connect(uarte, BAUDRATE_A::BAUD1M, pin, &BYTE_IN_MEMORY);
        let receiver = Self(uarte);
        receiver.switch_on();
        receiver
    }

    /// Stops the receiver and switches it off. Returns the cycles from STOPRX to RXTO, if RXTO comes.
    pub(crate) fn switch_off(&self) -> Option<u32> {
        let cycles = self.stop();
        self.0.enable.write(|w| w.enable().disabled());
        cycles
    }

    /// Switches the receiver off and on. Afterwards the FIFO is empty, no error is set, and a transfer is open.
    /// Returns the same as [`Self::switch_off`].
    pub(crate) fn switch_on(&self) -> Option<u32> {
        let cycles = self.switch_off();
        self.0.enable.write(|w| w.enable().enabled());
        self.causes();
        self.0.events_endrx.reset();
        self.open();
        cycles
    }

    /// Sets whether the receiver expects a parity bit. The receiver is switched off and on.
    pub(crate) fn expect_parity(&self, is_expected: bool) {
        self.switch_off();
        self.0.config.reset();
        if is_expected {
            self.0.config.write(|w| w.parity().included());
        }
        self.switch_on();
    }

    /// Opens a transfer.
    pub(crate) fn open(&self) {
        (self.0.tasks_startrx).write(|w| w.tasks_startrx().set_bit());
    }

    /// Returns whether a transfer has ended, and clears ENDRX.
    pub(crate) fn ended(&self) -> bool {
        let ended = self.0.events_endrx.read().bits() != 0;
        if ended {
            self.0.events_endrx.reset();
        }
        ended
    }

    /// Waits until a transfer ends, and clears ENDRX. Returns the cycles waited, or `None` if no transfer ends.
    pub(crate) fn end(&self) -> Option<u32> {
        let end = wait(LONG, || self.0.events_endrx.read().bits() != 0);
        self.0.events_endrx.reset();
        end
    }

    /// Waits until a byte is in memory, and then until its transfer ends. Returns the cycles of the second wait. The
    /// byte must not be 0.
    pub(crate) fn end_after_byte(&self) -> Option<u32> {
        BYTE_IN_MEMORY.store(0, Ordering::Relaxed);
        wait(LONG, || Self::byte() != 0);
        self.end()
    }

    /// Moves a waiting byte to memory by FLUSHRX. Returns whether RXSTARTED comes.
    pub(crate) fn flush(&self) -> bool {
        self.0.events_rxstarted.reset();
        (self.0.tasks_flushrx).write(|w| w.tasks_flushrx().set_bit());
        self.end();
        self.0.events_rxstarted.read().bits() != 0
    }

    /// Waits for ERROR. Returns the cycle count at this event, if it comes.
    pub(crate) fn error(&self) -> Option<u32> {
        let error = wait(LONG, || self.0.events_error.read().bits() != 0);
        error.map(|_| DWT::cycle_count())
    }

    /// Returns the byte that the last transfer stored.
    pub(crate) fn byte() -> u8 {
        compiler_fence(Ordering::SeqCst);
        BYTE_IN_MEMORY.load(Ordering::Relaxed)
    }

    /// Returns ERRORSRC, and clears it and ERROR.
    pub(crate) fn causes(&self) -> u32 {
        let causes = self.0.errorsrc.read().bits();
        // SAFETY: writing 1 to a cause clears it.
        (self.0.errorsrc).write(|w| unsafe { w.bits(causes) });
        self.0.events_error.reset();
        causes
    }

    /// Writes to ERRORSRC. Returns the causes that are still set after the write.
    pub(crate) fn clear(&self, causes: u32) -> u32 {
        // SAFETY: writing any value only clears causes or has no effect.
        (self.0.errorsrc).write(|w| unsafe { w.bits(causes) });
        self.0.errorsrc.read().bits()
    }

    /// Returns whether RXTO has come, and clears it.
    pub(crate) fn timed_out(&self) -> bool {
        let timed_out = self.0.events_rxto.read().bits() != 0;
        self.0.events_rxto.reset();
        timed_out
    }

    /// Stops the receiver. Returns the cycles until RXTO, if it comes.
    pub(crate) fn stop(&self) -> Option<u32> {
        self.timed_out();
        (self.0.tasks_stoprx).write(|w| w.tasks_stoprx().set_bit());
        wait(LONG, || self.0.events_rxto.read().bits() != 0)
    }

    /// Counts how often ERROR comes within this number of cycles.
    pub(crate) fn errors_in(&self, cycles: u32) -> u32 {
        let began = DWT::cycle_count();
        let mut errors = 0;
        while DWT::cycle_count().wrapping_sub(began) < cycles {
            if self.0.events_error.read().bits() != 0 {
                self.0.events_error.reset();
                errors += 1;
            }
        }
        errors
    }
}
