//! Receiving without end: UARTE0, an interrupt for each byte, one step of the receiver in it.
//!
//! What is decided, and why it is right, is in [`framelock_reception`]; here are the registers behind
//! it, the handlers, and the way to the receiver.

use core::cell::RefCell;
use core::sync::atomic::AtomicU8;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use framelock::{Counters, LineEvent};
use framelock_reception::{NO_BYTE, Registers};
use nrf52840_hal::pac::uarte0::baudrate::BAUDRATE_A;
use nrf52840_hal::pac::{Interrupt, TIMER2, UARTE0, interrupt};

use crate::settings::{GAP_AFTER, InputPin, Line, NONE_WAITS_AFTER, Parser, baud_register};
use crate::telemetry::COUNTERS;
use crate::{clock, setpoint};

/// Where EasyDMA puts each byte.
static BYTE: AtomicU8 = AtomicU8::new(NO_BYTE);

/// Where TIMER2 has the time in which a byte that waits is stored, since a transfer was opened.
const NONE_WAITS: usize = 1;

/// The receiver and all that it owns. Its two handlers have one priority, so neither interrupts the
/// other; the main loop looks with interrupts off. The cell checks both, at no risk and little cost.
static RECEIVER: Mutex<RefCell<Option<Receiver>>> = Mutex::new(RefCell::new(None));

/// Nothing has come yet. A constant, so that it is there at the start: to copy it into place would
/// take more flash than the receiver does.
pub(crate) const NOTHING_YET: Line = Line::resumed(Parser::new(), Counters::ZERO);

type Reception = framelock_reception::Reception<NONE_WAITS_AFTER, GAP_AFTER>;
type Receiver = (Reception, Hardware);

struct Hardware {
    uarte: UARTE0,
    timer: TIMER2,
    line: &'static mut Line,
}

/// Begins to receive. Bytes come from here on, and to the handlers once they are unmasked.
pub(crate) fn start(uarte: UARTE0, timer: TIMER2, pin: &InputPin, line: &'static mut Line) {
    clock::count_microseconds(&timer);
    // SAFETY: any value is a time.
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

/// Sets the rate and the pin of a receiver that is off, and where each transfer puts its one byte.
pub(crate) fn connect(uarte: &UARTE0, rate: BAUDRATE_A, pin: &InputPin, byte: &'static AtomicU8) {
    uarte.baudrate.write(|w| w.baudrate().variant(rate));
    // SAFETY: an input is only read. The transfer is of one byte, in RAM for ever, which may change at any
    // time: an atomic.
    unsafe {
        uarte.psel.rxd.write(|w| w.bits(pin.psel_bits()));
        uarte.rxd.ptr.write(|w| w.bits(byte.as_ptr() as u32));
        uarte.rxd.maxcnt.write(|w| w.bits(1));
    }
}

/// Once a tick: writes down the counters for those who look, and asks for a round. Returns whether the
/// reception works.
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

/// The time is over: the other handler looks.
#[interrupt]
fn TIMER2() {
    // SAFETY: writing 0 to an event only withdraws its interrupt request, and nothing is decided by it.
    unsafe { (*TIMER2::ptr()).events_compare[NONE_WAITS].reset() };
    NVIC::pend(Interrupt::UARTE0_UART0);
}

/// The only way to the receiver. If it is in use, or not there yet, this program is wrong: that is counted,
/// and the watchdog is not fed.
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

/// One step of the receiver; a frame's setpoint is published in it. It is a function of its own, so that it
/// can be proved in the image that is flashed: `proofs/machine-code`.
#[unsafe(no_mangle)]
#[inline(never)]
extern "Rust" fn receiver_step(line: &mut Line, byte: u8) {
    if let Some(setpoint) = line.push(byte) {
        setpoint::publish(setpoint);
    }
}

impl Hardware {
    /// A function of its own, so that a byte without an error takes the shorter way.
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
        // SAFETY: a byte that is there for ever. Volatile, so that it is read in order with the registers.
        unsafe { BYTE.as_ptr().read_volatile() }
    }

    fn start(&mut self) {
        // SAFETY: as above; no transfer is open that could write it too.
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
        // That of a time before.
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
        self.line.line_event(event, |_| ());
    }
}
