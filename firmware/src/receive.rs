//! Receiving without end: UARTE0 with EasyDMA into two halves by turns.
//!
//! What is decided, and why it is right, is in [`framelock_reception`]; here are the registers behind
//! it, the handlers, and the way to the parser.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use framelock::{Counters, LineEvent};
use framelock_reception::{Causes, Event, FIFO, Half, Moment, Reception, Registers};
use nrf52840_hal::gpio::{Input, Pin, PullUp};
use nrf52840_hal::pac::{Interrupt, UARTE0, interrupt};

use crate::line_timers::LineTimers;
use crate::receive_buffer::ReceiveBuffer;
use crate::setpoint;
use crate::settings::{HALF, Parser, baud_register};
use crate::telemetry::COUNTERS;

static BUFFER: ReceiveBuffer = ReceiveBuffer::new();

/// The receiver and all that it owns. Its two handlers have one priority, so neither interrupts the
/// other; the main loop looks with interrupts off. The cells check both, at no risk and little cost.
static RECEIVER: Mutex<RefCell<Receiver>> = Mutex::new(RefCell::new(Receiver {
    reception: Reception::new(),
    hardware: None,
}));

/// What has come over the line, and what became of it.
pub(crate) type Line = framelock::Line<Parser>;

/// Nothing has come yet. A constant, so that it is there at the start: to copy it into place would
/// take more flash than the receiver does.
pub(crate) const NOTHING_YET: Line = Line::resumed(Parser::new(), Counters::ZERO);

struct Receiver {
    reception: Reception<HALF>,
    hardware: Option<Hardware>,
}

struct Hardware {
    uarte: UARTE0,
    timers: LineTimers,
    line: &'static mut Line,
    sequence: u8,
}

/// Begins to receive. Bytes come from here on, and to the handlers once they are unmasked.
#[expect(clippy::needless_pass_by_value, reason = "the pin is given up here")]
pub(crate) fn start(
    uarte: UARTE0,
    pin: Pin<Input<PullUp>>,
    timers: LineTimers,
    line: &'static mut Line,
) {
    // SAFETY: the value is a pin's own, and the pin is given up here.
    uarte.psel.rxd.write(|w| unsafe { w.bits(pin.psel_bits()) });
    uarte
        .baudrate
        .write(|w| w.baudrate().variant(baud_register()));
    uarte
        .intenset
        .write(|w| w.rxstarted().set().endrx().set().rxto().set());
    uarte.enable.write(|w| w.enable().enabled());
    let hardware = Hardware {
        uarte,
        timers,
        line,
        sequence: 0,
    };
    free(|token| {
        if let Ok(mut receiver) = RECEIVER.borrow(token).try_borrow_mut() {
            let Receiver {
                reception,
                hardware: place,
            } = &mut *receiver;
            reception.begin(place.insert(hardware));
        }
    });
}

/// Once a tick: writes down the counters for those who look, and makes the handler run if it waits for
/// something that may not happen. Returns how often it has run while receiving.
pub(crate) fn tick() -> u32 {
    free(|token| {
        let Ok(mut receiver) = RECEIVER.borrow(token).try_borrow_mut() else {
            return 0;
        };
        let Receiver {
            reception,
            hardware: Some(hardware),
        } = &mut *receiver
        else {
            return 0;
        };
        if reception.tick(hardware) {
            ask_for_a_round();
        }
        let (line, late, skipped) = (&hardware.line, reception.late(), reception.skipped());
        COUNTERS.show(line.counters(), line.pending(), late, skipped);
        reception.rounds()
    })
}

/// Makes the handler run, with or without cause: if it does not, the watchdog bites.
pub(crate) fn ask_for_a_round() {
    NVIC::pend(Interrupt::UARTE0_UART0);
}

#[interrupt]
fn UARTE0_UART0() {
    service();
}

#[interrupt]
fn TIMER2() {
    service();
}

fn service() {
    free(|token| {
        if let Ok(mut receiver) = RECEIVER.borrow(token).try_borrow_mut()
            && let Receiver {
                reception,
                hardware: Some(hardware),
            } = &mut *receiver
        {
            reception.service(hardware);
        }
    });
}

/// Whether the event is set; clears it if so.
macro_rules! take {
    ($event:expr) => {{
        let set = $event.read().bits() != 0;
        if set {
            $event.reset();
        }
        set
    }};
}

impl Hardware {
    /// Gives bytes to the parser, and publishes each setpoint that they commit.
    #[inline]
    fn parse(line: &mut Line, sequence: &mut u8, bytes: &[u8]) {
        line.feed(bytes, |found| {
            if let Some(setpoint) = found.message() {
                *sequence = sequence.wrapping_add(1);
                setpoint::publish(*sequence, setpoint);
            }
        });
    }
}

impl Registers for Hardware {
    #[inline]
    fn happened(&mut self, event: Event) -> bool {
        match event {
            Event::Started => take!(self.uarte.events_rxstarted),
            Event::Ended => take!(self.uarte.events_endrx),
            Event::TimedOut => take!(self.uarte.events_rxto),
            Event::Error => take!(self.uarte.events_error),
            Event::Silent => take!(self.timers.silent()),
            Event::Gap => take!(self.timers.gap()),
        }
    }

    #[inline]
    fn clear(&mut self, event: Event) {
        match event {
            Event::Started => self.uarte.events_rxstarted.reset(),
            Event::Ended => self.uarte.events_endrx.reset(),
            Event::TimedOut => self.uarte.events_rxto.reset(),
            Event::Error => self.uarte.events_error.reset(),
            Event::Silent => self.timers.silent().reset(),
            Event::Gap => self.timers.gap().reset(),
        }
    }

    #[inline]
    fn count(&mut self, moment: Moment) -> u32 {
        match moment {
            Moment::Now => self.timers.count(),
            Moment::End => self.timers.count_at_end(),
            Moment::Error => self.timers.count_at_error(),
            Moment::Silent => self.timers.count_at_silence(),
        }
    }

    fn errors(&mut self) -> u32 {
        self.timers.errors()
    }

    fn causes(&mut self) -> Causes {
        let causes = self.uarte.errorsrc.read();
        // SAFETY: writing 1 to a cause clears it.
        self.uarte
            .errorsrc
            .write(|w| unsafe { w.bits(causes.bits()) });
        Causes {
            overrun: causes.overrun().bit(),
            parity: causes.parity().bit(),
            framing: causes.framing().bit(),
            line_break: causes.break_().bit(),
        }
    }

    fn amount(&mut self) -> u32 {
        self.uarte.rxd.amount.read().bits()
    }

    fn listen_to_errors(&mut self, listen: bool) {
        if listen {
            self.uarte.intenset.write(|w| w.error().set());
        } else {
            self.uarte.intenclr.write(|w| w.error().clear());
        }
    }

    #[inline]
    fn name(&mut self, half: Half) {
        let address = BUFFER.address(half);
        // SAFETY: a half of the buffer that is no longer read: see `framelock_reception`.
        self.uarte
            .rxd
            .ptr
            .write(|w| unsafe { w.ptr().bits(address) });
    }

    fn start(&mut self) {
        self.name(Half::First);
        // SAFETY: the size of a half.
        self.uarte.rxd.maxcnt.write(|w| unsafe { w.bits(HALF) });
        self.uarte.shorts.write(|w| w.endrx_startrx().enabled());
        self.uarte
            .tasks_startrx
            .write(|w| w.tasks_startrx().set_bit());
    }

    fn last_half(&mut self) {
        self.uarte.shorts.reset();
    }

    fn stop(&mut self) {
        self.uarte
            .tasks_stoprx
            .write(|w| w.tasks_stoprx().set_bit());
    }

    fn flush(&mut self) {
        // SAFETY: the buffer's own place for what is flushed, and its size.
        unsafe {
            let address = BUFFER.flushed_address();
            self.uarte.rxd.ptr.write(|w| w.ptr().bits(address));
            self.uarte.rxd.maxcnt.write(|w| w.bits(FIFO));
        }
        self.uarte
            .tasks_flushrx
            .write(|w| w.tasks_flushrx().set_bit());
    }

    fn switch_off_and_on(&mut self) {
        self.uarte.enable.write(|w| w.enable().disabled());
        self.uarte.enable.write(|w| w.enable().enabled());
    }

    #[inline(never)]
    fn feed(&mut self, half: Half, from: u32, to: u32) {
        // SAFETY: `Reception` hands on only what has been stored, and names a half to the UARTE only
        // when all of it has been handed on: theorem 12.
        let bytes = unsafe { BUFFER.received(half, from, to) };
        Self::parse(self.line, &mut self.sequence, bytes);
    }

    fn feed_flushed(&mut self, count: u32) {
        // SAFETY: the flush is over, and there is no other before these are read.
        let bytes = unsafe { BUFFER.flushed(count) };
        Self::parse(self.line, &mut self.sequence, bytes);
    }

    fn report(&mut self, event: LineEvent) {
        self.line.line_event(event, |_| ());
    }
}
