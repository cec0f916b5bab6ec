//! Receiving without end: UARTE0, an interrupt for each byte, one step of the receiver in it.
//!
//! What is decided, and why it is right, is in [`framelock_reception`]; here are the registers behind
//! it, the handlers, and the way to the receiver.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU8, Ordering, compiler_fence};

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use embedded_hal::digital::InputPin as _;
use framelock::{Counters, LineEvent};
use framelock_reception::{NO_BYTE, Registers};
use nrf52840_hal::gpio::{Input, Pin, PullUp};
use nrf52840_hal::pac::{Interrupt, TIMER2, UARTE0, interrupt};

use crate::setpoint;
use crate::settings::{GAP_AFTER, NONE_WAITS_AFTER, Parser, baud_register};
use crate::telemetry::COUNTERS;

/// Where EasyDMA puts each byte.
static BYTE: AtomicU8 = AtomicU8::new(NO_BYTE);

/// TIMER2's registers: the two times, in microseconds since a transfer was opened, and the time now.
const NONE_WAITS: usize = 0;
const GAP: usize = 1;
const NOW: usize = 2;

/// The receiver and all that it owns. Its two handlers have one priority, so neither interrupts the
/// other; the main loop looks with interrupts off. The cell checks both, at no risk and little cost.
static RECEIVER: Mutex<RefCell<Option<Receiver>>> = Mutex::new(RefCell::new(None));

/// What has come over the line, and what became of it.
pub(crate) type Line = framelock::Line<Parser>;

/// Nothing has come yet. A constant, so that it is there at the start: to copy it into place would
/// take more flash than the receiver does.
pub(crate) const NOTHING_YET: Line = Line::resumed(Parser::new(), Counters::ZERO);

type Reception = framelock_reception::Reception<NONE_WAITS_AFTER, GAP_AFTER>;
type Receiver = (Reception, Hardware);

struct Hardware {
    uarte: UARTE0,
    timer: TIMER2,
    pin: Pin<Input<PullUp>>,
    line: &'static mut Line,
}

/// Begins to receive. Bytes come from here on, and to the handlers once they are unmasked.
pub(crate) fn start(
    uarte: UARTE0,
    timer: TIMER2,
    pin: Pin<Input<PullUp>>,
    line: &'static mut Line,
) {
    timer.bitmode.write(|w| w.bitmode()._32bit());
    // SAFETY: 16 MHz / 2^4: a count is a microsecond. Any value is a time.
    unsafe {
        timer.prescaler.write(|w| w.prescaler().bits(4));
        timer.cc[NONE_WAITS].write(|w| w.bits(NONE_WAITS_AFTER));
        timer.cc[GAP].write(|w| w.bits(GAP_AFTER));
    }
    timer.intenset.write(|w| w.compare1().set());
    timer.tasks_start.write(|w| w.tasks_start().set_bit());

    let rate = baud_register();
    uarte.baudrate.write(|w| w.baudrate().variant(rate));
    // SAFETY: the receiver keeps the pin. The transfer is of one byte, in RAM for ever, which may change
    // at any time: an atomic.
    unsafe {
        uarte.psel.rxd.write(|w| w.bits(pin.psel_bits()));
        uarte.rxd.ptr.write(|w| w.bits(BYTE.as_ptr() as u32));
        uarte.rxd.maxcnt.write(|w| w.bits(1));
    }
    uarte.intenset.write(|w| w.endrx().set());
    uarte.enable.write(|w| w.enable().enabled());
    let mut hardware = Hardware {
        uarte,
        timer,
        pin,
        line,
    };
    let mut reception = Reception::default();
    reception.begin(&mut hardware);
    free(|token| {
        if let Ok(mut receiver) = RECEIVER.borrow(token).try_borrow_mut() {
            *receiver = Some((reception, hardware));
        }
    });
}

/// Once a tick: asks for a round, and writes down the counters for those who look. Returns how often the
/// handler has run, if the reception works.
pub(crate) fn tick() -> Option<u32> {
    NVIC::pend(Interrupt::UARTE0_UART0);
    with_receiver(|(reception, hardware)| {
        let works = reception.tick(hardware);
        COUNTERS.show(hardware.line, reception.counts());
        works.then_some(reception.counts().rounds)
    })?
}

#[interrupt]
fn UARTE0_UART0() {
    with_receiver(|(reception, hardware)| reception.service(hardware));
}

/// A time is over: the other handler looks.
#[interrupt]
fn TIMER2() {
    // SAFETY: writing 0 to an event only withdraws its interrupt request, and nothing is decided by these.
    let timer = unsafe { &*TIMER2::ptr() };
    timer.events_compare[NONE_WAITS].reset();
    timer.events_compare[GAP].reset();
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
fn receiver_step(line: &mut Line, byte: u8) {
    if let Some(setpoint) = line.push(byte) {
        setpoint::publish(setpoint);
    }
}

impl Registers for Hardware {
    fn open_for(&mut self) -> u32 {
        self.timer.tasks_capture[NOW].write(|w| w.tasks_capture().set_bit());
        self.timer.cc[NOW].read().bits()
    }

    fn restart_timer(&mut self) {
        self.timer.tasks_clear.write(|w| w.tasks_clear().set_bit());
    }

    fn ended(&mut self) -> bool {
        let ended = self.uarte.events_endrx.read().bits() != 0;
        if ended {
            self.uarte.events_endrx.reset();
        }
        ended
    }

    fn has_failed(&mut self) -> bool {
        self.uarte.errorsrc.read().bits() != 0
    }

    fn take_causes(&mut self) -> u32 {
        self.uarte.events_error.reset();
        let causes = self.uarte.errorsrc.read().bits();
        // SAFETY: writing 1 to a cause clears it.
        self.uarte.errorsrc.write(|w| unsafe { w.bits(causes) });
        causes
    }

    fn byte(&mut self) -> u8 {
        // It may have changed since it was read before; and it is read before the next transfer is opened.
        compiler_fence(Ordering::SeqCst);
        let byte = BYTE.load(Ordering::Relaxed);
        compiler_fence(Ordering::SeqCst);
        byte
    }

    fn start(&mut self) {
        BYTE.store(NO_BYTE, Ordering::Relaxed);
        compiler_fence(Ordering::SeqCst);
        self.uarte
            .tasks_startrx
            .write(|w| w.tasks_startrx().set_bit());
        self.restart_timer();
    }

    fn start_anew(&mut self) {
        self.uarte.enable.write(|w| w.enable().disabled());
        self.uarte.enable.write(|w| w.enable().enabled());
        self.uarte.events_endrx.reset();
        self.start();
    }

    fn listen_to_errors(&mut self, listen: bool) {
        if listen {
            self.uarte.intenset.write(|w| w.error().set());
        } else {
            self.uarte.intenclr.write(|w| w.error().clear());
        }
    }

    fn listen_to_timer(&mut self, listen: bool) {
        // That of a time before.
        self.timer.events_compare[NONE_WAITS].reset();
        if listen {
            self.timer.intenset.write(|w| w.compare0().set());
        } else {
            self.timer.intenclr.write(|w| w.compare0().clear());
        }
    }

    fn is_low(&mut self) -> bool {
        self.pin.is_low() == Ok(true)
    }

    fn push(&mut self, byte: u8) {
        receiver_step(self.line, byte);
    }

    fn report(&mut self, event: LineEvent) {
        self.line.line_event(event, |_| ());
    }
}
