//! Continuous reception with UARTE0: each byte causes one interrupt, whose handler hands the byte on to the receiver or
//! drops it.
//!
//! The crate [`framelock_reception`] contains the decisions and their justification. This module contains the register
//! accesses, the handlers, and the access to the receiver.

use core::cell::RefCell;
use core::sync::atomic::AtomicU8;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use framelock::{Counters, LineEvent};
use framelock_reception::{NO_BYTE, Registers};
use nrf52840_hal::pac::uarte0::baudrate::BAUDRATE_A;
use nrf52840_hal::pac::{Interrupt, TIMER2, UARTE0, interrupt};

use crate::settings::{
    BYTE_TIME, GAP_AFTER, InputPin, Line, NONE_WAITS_AFTER, Parser, baud_register,
};
use crate::telemetry::COUNTERS;
use crate::{clock, setpoint};

/// The byte in RAM to which EasyDMA writes.
static BYTE: AtomicU8 = AtomicU8::new(NO_BYTE);

/// The compare register of TIMER2 that holds [`NONE_WAITS_AFTER`]. A byte that waits in the FIFO when a transfer is
/// opened is stored within this time.
const NONE_WAITS: usize = 1;

/// The receiver and everything that it owns. Interrupts are disabled during each access, so accesses never overlap. The
/// cell also checks this at run time.
static RECEIVER: Mutex<RefCell<Option<Receiver>>> = Mutex::new(RefCell::new(None));

/// The receiver and its counters before the first byte. It is a constant, so that it can initialise a `static`. Copying
/// it at run time would take more flash.
pub(crate) const NOTHING_YET: Line = Line::resumed(Parser::new(), Counters::ZERO);

/// The reception measures a gap up to the end of the byte that ends the silence, so `GAP` is `GAP_AFTER`
/// plus a byte's time.
type Reception = framelock_reception::Reception<NONE_WAITS_AFTER, { GAP_AFTER + BYTE_TIME }>;
type Receiver = (Reception, Hardware);

struct Hardware {
    uarte: UARTE0,
    timer: TIMER2,
    line: &'static mut Line,
}

/// Starts the reception. The UARTE stores bytes from here on, and the handlers process them as soon as their
/// interrupts are unmasked.
pub(crate) fn start(uarte: UARTE0, timer: TIMER2, pin: &InputPin, line: &'static mut Line) {
    clock::count_microseconds(&timer);
    // SAFETY: every value is a valid time.
    timer.cc[NONE_WAITS].write(|w| unsafe { w.bits(NONE_WAITS_AFTER) });

    connect(&uarte, baud_register(), pin, &BYTE);
    uarte.enable.write(|w| w.enable().enabled());
    let mut hardware = Hardware { uarte, timer, line };
    let receiver = (Reception::begin(&mut hardware), hardware);
    free(|token| {
        if let Ok(mut cell) = RECEIVER.borrow(token).try_borrow_mut() {
            *cell = Some(receiver);
        }
    });
}

/// Sets the baud rate, the pin and the destination of the one-byte transfers. The receiver must be off.
pub(crate) fn connect(uarte: &UARTE0, rate: BAUDRATE_A, pin: &InputPin, byte: &'static AtomicU8) {
    uarte.baudrate.write(|w| w.baudrate().variant(rate));
    // SAFETY: the UARTE only reads its input pin. A transfer writes one byte of RAM. This byte is a static, so it lives
    // forever. It is also an atomic, so it may change at any time.
    unsafe {
        uarte.psel.rxd.write(|w| w.bits(pin.psel_bits()));
        uarte.rxd.ptr.write(|w| w.bits(byte.as_ptr() as u32));
        uarte.rxd.maxcnt.write(|w| w.bits(1));
    }
}

/// Performs the reception's tick: copies the counters to [`COUNTERS`], looks for a lost ENDRX, and pends the receive
/// handler. The main loop calls this function once a tick. Returns whether the reception works.
pub(crate) fn tick() -> bool {
    let works = with_receiver(|(reception, hardware)| {
        COUNTERS.show(hardware.line, reception.skipped, reception.restarts);
        reception.tick(hardware)
    });
    NVIC::pend(Interrupt::UARTE0_UART0);
    works == Some(true)
}

#[interrupt]
fn UARTE0_UART0() {
    with_receiver(|(reception, hardware)| reception.service(hardware));
}

/// Runs during a drain, when the timer reaches [`NONE_WAITS_AFTER`]. Pends the receive handler.
#[interrupt]
fn TIMER2() {
    // SAFETY: writing 0 to an event only withdraws its interrupt request, and no decision depends on the event.
    unsafe { (*TIMER2::ptr()).events_compare[NONE_WAITS].reset() };
    NVIC::pend(Interrupt::UARTE0_UART0);
}

/// Calls `act` with the receiver. All accesses go through this function. If the receiver is in use or has not been
/// started, this program has a bug. In this case, the function increments the counter `unserved` and returns `None`.
/// If this happens in [`tick`], the main loop does not feed the watchdog.
fn with_receiver<T>(act: impl FnOnce(&mut Receiver) -> T) -> Option<T> {
    free(|token| {
        if let Ok(mut cell) = RECEIVER.borrow(token).try_borrow_mut()
            && let Some(receiver) = &mut *cell
        {
            return Some(act(receiver));
        }
        COUNTERS.unserved.count();
        None
    })
}

/// Performs one step of the receiver, and publishes the frame's setpoint if the byte completes a frame. This is a
/// separate function, so that its machine code can be proved in the image that is flashed: see
/// `proofs/machine-code`.
#[unsafe(no_mangle)]
#[inline(never)]
extern "Rust" fn receiver_step(line: &mut Line, byte: u8) {
    if let Some(setpoint) = line.push(byte) {
        setpoint::publish(setpoint);
    }
}

impl Hardware {
    /// Clears these causes in ERRORSRC. This is a separate, cold function, to keep the path of a byte without an error
    /// short.
    #[cold]
    #[inline(never)]
    fn clear(&mut self, causes: u32) {
        // SAFETY: writing 1 to a cause clears it.
        self.uarte.errorsrc.write(|w| unsafe { w.bits(causes) });
    }
}

impl Registers for Hardware {
    fn open_for(&mut self) -> u32 {
        clock::microseconds(&self.timer)
    }

    fn restart_timer(&mut self) {
        self.timer.tasks_clear.write(|w| w.tasks_clear().set_bit());
    }

    fn ended(&mut self) -> bool {
        self.uarte.events_endrx.read().bits() != 0
    }

    fn take_causes(&mut self) -> u32 {
        self.uarte.events_error.reset();
        let causes = self.uarte.errorsrc.read().bits();
        if causes != 0 {
            self.clear(causes);
        }
        causes
    }

    fn byte(&mut self) -> u8 {
        // SAFETY: the byte is a static. The read is volatile, so that it stays in order with the register accesses.
        unsafe { BYTE.as_ptr().read_volatile() }
    }

    fn start(&mut self) {
        // SAFETY: the byte is a static. No transfer is open that could write it at the same time.
        unsafe { BYTE.as_ptr().write_volatile(NO_BYTE) };
        self.uarte.events_endrx.reset();
        let start = &self.uarte.tasks_startrx;
        start.write(|w| w.tasks_startrx().set_bit());
        self.restart_timer();
    }

    fn stop(&mut self) {
        self.uarte.events_rxto.reset();
        self.uarte.inten.write(|w| w.rxto().set_bit());
        self.timer.intenclr.write(|w| w.compare1().clear());
        let stop = &self.uarte.tasks_stoprx;
        stop.write(|w| w.tasks_stoprx().set_bit());
        self.restart_timer();
    }

    fn stopped(&mut self) -> bool {
        self.uarte.events_rxto.read().bits() != 0
    }

    fn start_anew(&mut self) {
        self.uarte.enable.write(|w| w.enable().disabled());
        self.uarte.enable.write(|w| w.enable().enabled());
        self.take_causes();
        self.start();
    }

    fn listen(&mut self, to_errors: bool, to_none_waits: bool) {
        let events = &self.uarte.inten;
        events.write(|w| w.endrx().set_bit().error().bit(to_errors));
        // Clear the event of an earlier transfer.
        self.timer.events_compare[NONE_WAITS].reset();
        self.timer.intenclr.write(|w| w.compare1().clear());
        if to_none_waits {
            self.timer.intenset.write(|w| w.compare1().set());
        }
    }

    fn push(&mut self, byte: u8) {
        receiver_step(self.line, byte);
    }

    fn report(&mut self, event: LineEvent) {
        self.line.event(event);
    }
}
