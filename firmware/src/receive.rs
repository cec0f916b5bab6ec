//! Receiving without end: UARTE0 with EasyDMA into two halves by turns.
//!
//! When a half is full the UARTE goes on with the other by itself (short ENDRX to STARTRX). The
//! handler takes the full half, and names the half after next: until the other one is full, so as
//! long as a half takes to fill, it may be late. If it is later, the UARTE has begun to overwrite
//! what nobody has read, and says nothing; so the handler compares counts, and if it was too late
//! it counts that, drops the frame under way and starts anew.
//!
//! ```text
//!              ┌──────────── a half is full: take it, name the next ◄──┐
//!              ▼                                                       │
//!        ┌───────────┐ ─────────────────────────────────────────────►──┘
//!  ────► │ Receiving │ ── silence: take what has come ──► (Receiving)
//!        └───────────┘ ◄───────────────────────────────────────────────┐
//!              │ late handler, overrun, or silence after a line error  │
//!              ▼                                                       │
//!        ┌───────────┐  receiver has stopped   ┌───────────┐  emptied  │
//!        │ Stopping  ├────────────────────────►│ Flushing  ├───────────┘
//!        └───────────┘                         └───────────┘
//! ```
//!
//! After a line error the count of bytes is trusted no longer, since it is not written whether a
//! byte that was not stored is counted. It is set right when the half is full; or, if the line
//! falls silent first, by stopping the UARTE, which then tells how many bytes it has stored.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use framelock::{Accounting, Counters, LineEvent};
use nrf52840_hal::gpio::{Input, Pin, PullUp};
use nrf52840_hal::pac::{self, Interrupt, UARTE0, interrupt};

use crate::line_timers::LineTimers;
use crate::receive_buffer::{Half, LEFTOVER, ReceiveBuffer};
use crate::setpoint;
use crate::settings::{HALF, Parser, baud_register};
use crate::telemetry::COUNTERS;

static BUFFER: ReceiveBuffer = ReceiveBuffer::new();

/// The receiver and all that it owns. Its two handlers have one priority, so neither interrupts the
/// other; the main loop looks with interrupts off. The cells check both, at no risk and little cost.
static RECEPTION: Mutex<RefCell<Option<Reception>>> = Mutex::new(RefCell::new(None));

/// What has come over the line, and what became of it.
pub(crate) type Line = Accounting<Parser>;

/// Nothing has come yet. A constant, so that it is there at the start: to copy it into place would
/// take more flash than the receiver does.
pub(crate) const NOTHING_YET: Line = Accounting::resumed(Parser::new(), Counters::ZERO);

/// The UARTE, and how far what it has received has been taken.
struct Reception {
    uarte: UARTE0,
    timers: LineTimers,
    line: &'static mut Line,
    state: State,
    /// The half that is being filled, the bytes of it that have been taken, and how many bytes had
    /// been counted when it was begun.
    open: Half,
    taken: u32,
    begun_at: u32,
    /// The half to name next.
    next: Half,
    /// There was a line error since `begun_at` was set.
    in_doubt: bool,
    errors_seen: u32,
    sequence: u8,
    late: u32,
    skipped: u32,
    rounds: u32,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Receiving,
    /// Until the receiver times out. `exact`: what it has stored is yet to be taken.
    Stopping {
        exact: bool,
    },
    Flushing,
}

/// Line errors since they were last asked for.
struct LineErrors {
    /// How many bytes of the open half had been received when the last one came.
    at: u32,
    causes: pac::uarte0::errorsrc::R,
    several: bool,
}

impl LineErrors {
    /// Whether no count says which bytes are sound: at an overrun what was counted last still waits to
    /// be stored; and of several errors only the last one's place is known, which may be in the next
    /// half while others are in the full one.
    fn are_placeless(&self, half_is_full: bool) -> bool {
        self.causes.overrun().bit_is_set() || half_is_full && self.several && self.at >= HALF
    }
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
        .write(|w| w.rxstarted().set().endrx().set().error().set().rxto().set());
    uarte.enable.write(|w| w.enable().enabled());
    let mut reception = Reception {
        uarte,
        timers,
        line,
        state: State::Receiving,
        open: Half::First,
        taken: 0,
        begun_at: 0,
        next: Half::Second,
        in_doubt: false,
        errors_seen: 0,
        sequence: 0,
        late: 0,
        skipped: 0,
        rounds: 0,
    };
    reception.begin();
    free(|token| {
        if let Ok(mut place) = RECEPTION.borrow(token).try_borrow_mut() {
            *place = Some(reception);
        }
    });
}

/// Writes down the counters for those who look. Returns how often the handler has run.
pub(crate) fn show_counters() -> u32 {
    free(|token| {
        let Ok(reception) = RECEPTION.borrow(token).try_borrow() else {
            return 0;
        };
        reception.as_ref().map_or(0, |reception| {
            let pending = reception.line.pending();
            COUNTERS.show(
                reception.line.counters(),
                pending,
                reception.late,
                reception.skipped,
            );
            reception.rounds
        })
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
        if let Ok(mut reception) = RECEPTION.borrow(token).try_borrow_mut()
            && let Some(reception) = reception.as_mut()
        {
            reception.service();
        }
    });
}

impl Reception {
    #[inline]
    fn service(&mut self) {
        self.rounds = self.rounds.wrapping_add(1);
        match self.state {
            State::Receiving => self.receive(),
            State::Stopping { exact } => self.finish_stopping(exact),
            State::Flushing => {
                self.drop_what_the_timers_say();
                if self.take_end() {
                    self.begin();
                }
            }
        }
    }

    #[inline]
    fn receive(&mut self) {
        // In this order: if the next half was started, the last one's end is seen too.
        let started = self.take_started();
        let ended = self.take_end();
        if started {
            self.name_next();
        }
        // Read behind that: if the half that was started is full by now, the UARTE may have begun to
        // overwrite it before the next was named. It shows as one end more than was seen.
        let end = self.timers.count_at_end();
        let halves = end.wrapping_sub(self.begun_at) / HALF;
        if (started || ended) && halves > u32::from(ended) {
            self.late = self.late.wrapping_add(1);
            return self.stop(false);
        }

        let mut errors = self.line_errors();
        if let Some(placeless) = errors.take_if(|errors| errors.are_placeless(ended)) {
            self.count_causes(&placeless.causes);
            return self.stop(false);
        }
        if ended {
            if let Some(in_full_half) = errors.take_if(|errors| errors.at < HALF) {
                self.report(&in_full_half);
            }
            self.take(HALF);
            if let Some(errors) = &mut errors {
                errors.at = errors.at.wrapping_sub(end.wrapping_sub(self.begun_at));
            }
            self.open = self.open.other();
            self.taken = 0;
            self.begun_at = end;
            self.in_doubt = false;
        }
        if let Some(errors) = errors {
            self.report(&errors);
        }
        if let Some(count) = self.timers.idle() {
            let received = count.wrapping_sub(self.begun_at);
            if self.in_doubt {
                self.stop(true);
            } else if received <= HALF {
                self.take(received);
            }
        }
        if self.timers.gap() {
            self.line.line_event(LineEvent::Idle);
        }
    }

    /// Takes the bytes of the open half up to `to`, all of which have been stored.
    #[inline(never)]
    fn take(&mut self, to: u32) {
        let from = self.taken;
        if to <= from {
            return;
        }
        self.taken = to;
        // SAFETY: stored, as the caller knows from the half's end, the UARTE's own count or three
        // byte times of silence. The UARTE writes to this half again no sooner than the other is
        // full; it was not when the check for late handlers looked, just before, and a byte is read
        // in less time than the line takes to bring one, whatever it is.
        let bytes = unsafe { BUFFER.received(self.open, from, to) };
        let sequence = &mut self.sequence;
        self.line.feed(bytes, |_, in_force| {
            *sequence = sequence.wrapping_add(1);
            setpoint::publish(*sequence, in_force);
        });
    }

    /// Reports errors to the parser, behind the bytes of the open half that came before them.
    #[cold]
    fn report(&mut self, errors: &LineErrors) {
        let at = errors.at.min(HALF);
        if errors.several && self.taken < at {
            // Only the last one's place is known: no byte in front of it is.
            self.skipped = self.skipped.wrapping_add(at - self.taken);
            self.taken = at;
        } else {
            self.take(at);
        }
        self.count_causes(&errors.causes);
        self.in_doubt = true;
    }

    fn count_causes(&mut self, causes: &pac::uarte0::errorsrc::R) {
        for (present, event) in [
            (causes.overrun().bit_is_set(), LineEvent::Overrun),
            (causes.parity().bit_is_set(), LineEvent::Parity),
            (causes.framing().bit_is_set(), LineEvent::Framing),
            (causes.break_().bit_is_set(), LineEvent::Break),
        ] {
            if present {
                self.line.line_event(event);
            }
        }
    }

    /// Stops the UARTE, to start it anew. `exact`: to take all that it has stored first.
    #[cold]
    #[inline(never)]
    fn stop(&mut self, exact: bool) {
        self.uarte.shorts.reset();
        self.uarte
            .tasks_stoprx
            .write(|w| w.tasks_stoprx().set_bit());
        self.state = State::Stopping { exact };
    }

    #[cold]
    #[inline(never)]
    fn finish_stopping(&mut self, exact: bool) {
        self.drop_what_the_timers_say();
        self.take_started();
        if self.take_end() && exact {
            let stored = self.uarte.rxd.amount.read().bits();
            self.take(stored.min(HALF));
            // They are stored, so they were counted.
            self.state = State::Stopping { exact: false };
        }
        if self.uarte.events_rxto.read().bits() != 0 {
            self.uarte.events_rxto.reset();
            // SAFETY: the buffer's own place for what is left over, and its size.
            unsafe {
                let address = BUFFER.leftover_address();
                self.uarte.rxd.ptr.write(|w| w.ptr().bits(address));
                self.uarte.rxd.maxcnt.write(|w| w.bits(LEFTOVER));
            }
            self.uarte
                .tasks_flushrx
                .write(|w| w.tasks_flushrx().set_bit());
            self.state = State::Flushing;
        }
    }

    /// Starts the UARTE with empty halves. What came since the last byte that was taken is lost.
    #[cold]
    #[inline(never)]
    fn begin(&mut self) {
        let count = self.timers.count();
        let lost = count.wrapping_sub(self.begun_at.wrapping_add(self.taken));
        // What was counted and not stored makes no difference: too few is none.
        let is_lost = lost != 0 && lost < u32::MAX / 2;
        if is_lost {
            self.skipped = self.skipped.wrapping_add(lost);
        }
        // While the UARTE stood still, bytes may have passed uncounted: no frame reaches across that.
        if is_lost || self.line.pending() != 0 {
            self.line.line_event(LineEvent::Overrun);
        }
        self.state = State::Receiving;
        self.open = Half::First;
        self.next = Half::Second;
        self.taken = 0;
        self.begun_at = count;
        self.in_doubt = false;
        self.uarte.events_rxto.reset();
        self.uarte.events_rxstarted.reset();
        self.uarte.events_endrx.reset();
        let address = BUFFER.address(Half::First);
        // SAFETY: the first half and its size.
        unsafe {
            self.uarte.rxd.ptr.write(|w| w.ptr().bits(address));
            self.uarte.rxd.maxcnt.write(|w| w.bits(HALF));
        }
        self.uarte.shorts.write(|w| w.endrx_startrx().enabled());
        self.uarte
            .tasks_startrx
            .write(|w| w.tasks_startrx().set_bit());
        // It starts within a few cycles. From then on the next half may be named, and it is, so that
        // no end of a half finds none.
        for _ in 0..100 {
            if self.take_started() {
                break;
            }
        }
        self.name_next();
    }

    /// Names the half to be filled when the one that was started is full.
    #[inline]
    fn name_next(&mut self) {
        let address = BUFFER.address(self.next);
        // SAFETY: a half of the buffer, which is no longer read: it was taken before the one that
        // was just started began.
        self.uarte
            .rxd
            .ptr
            .write(|w| unsafe { w.ptr().bits(address) });
        self.next = self.next.other();
    }

    /// While nothing is received only causes count, and the interrupts must not come again.
    fn drop_what_the_timers_say(&mut self) {
        if let Some(errors) = self.line_errors() {
            self.count_causes(&errors.causes);
        }
        self.timers.idle();
        self.timers.gap();
    }

    /// Reads and clears the causes of errors.
    #[inline]
    fn line_errors(&mut self) -> Option<LineErrors> {
        if self.uarte.events_error.read().bits() == 0 {
            return None;
        }
        // The event first: an error that comes between is seen twice, never missed.
        self.uarte.events_error.reset();
        let causes = self.uarte.errorsrc.read();
        // SAFETY: writing 1 to a cause clears it.
        self.uarte
            .errorsrc
            .write(|w| unsafe { w.bits(causes.bits()) });
        let count = self.timers.errors();
        let several = count.wrapping_sub(self.errors_seen) > 1 || self.in_doubt;
        self.errors_seen = count;
        Some(LineErrors {
            at: self.timers.count_at_error().wrapping_sub(self.begun_at),
            causes,
            several,
        })
    }

    #[inline]
    fn take_started(&mut self) -> bool {
        let set = self.uarte.events_rxstarted.read().bits() != 0;
        if set {
            self.uarte.events_rxstarted.reset();
        }
        set
    }

    #[inline]
    fn take_end(&mut self) -> bool {
        let set = self.uarte.events_endrx.read().bits() != 0;
        if set {
            self.uarte.events_endrx.reset();
        }
        set
    }
}
