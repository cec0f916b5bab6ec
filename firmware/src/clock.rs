//! The time in microseconds (TIMER0), its tick, and the sleep of the main loop until the tick.

use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::interrupt::free;
use nrf52840_hal::pac::timer0::RegisterBlock;
use nrf52840_hal::pac::{TIMER0, interrupt};

static IS_WOKEN: AtomicBool = AtomicBool::new(false);

/// Lets a timer count microseconds, from 0.
pub(crate) fn count_microseconds(timer: &RegisterBlock) {
    timer.mode.write(|w| w.mode().timer());
    timer.bitmode.write(|w| w.bitmode()._32bit());
    // SAFETY: 16 MHz / 2^4 = 1 MHz; the register takes 0 to 9.
    timer.prescaler.write(|w| unsafe { w.prescaler().bits(4) });
    timer.tasks_clear.write(|w| w.tasks_clear().set_bit());
    timer.tasks_start.write(|w| w.tasks_start().set_bit());
}

/// The count now, which wraps after 71 minutes. It comes by way of CC\[0\].
pub(crate) fn microseconds(timer: &RegisterBlock) -> u32 {
    timer.tasks_capture[0].write(|w| w.tasks_capture().set_bit());
    timer.cc[0].read().bits()
}

/// The time.
pub(crate) struct Clock {
    timer: TIMER0,
}

impl Clock {
    /// Starts at 0.
    pub(crate) fn start(timer: TIMER0) -> Self {
        count_microseconds(&timer);
        timer.intenset.write(|w| w.compare1().set());
        Self { timer }
    }

    /// The time now.
    pub(crate) fn now(&self) -> u32 {
        microseconds(&self.timer)
    }

    /// Wakes the main loop at that time, or now if it is over.
    pub(crate) fn wake_at(&self, time: u32) {
        // SAFETY: any value is a time.
        self.timer.cc[1].write(|w| unsafe { w.bits(time) });
        if self.now().wrapping_sub(time) <= u32::MAX / 2 {
            wake();
        }
    }
}

/// The tick, for the main loop.
#[interrupt]
fn TIMER0() {
    // SAFETY: the only register written here is the event's own, which nothing else touches, and
    // writing 0 to it only withdraws the interrupt request.
    unsafe { (*TIMER0::ptr()).events_compare[1].reset() };
    wake();
}

/// Wakes the main loop; from a handler.
pub(crate) fn wake() {
    IS_WOKEN.store(true, Ordering::Relaxed);
}

/// Sleeps until [`wake`], or not at all if it was called since the last sleep. Handlers run meanwhile.
pub(crate) fn sleep() {
    // With interrupts off between look and sleep, none can slip in and be slept through: one that is
    // pending ends the sleep all the same.
    while free(|_| {
        let sleeps = !IS_WOKEN.load(Ordering::Relaxed);
        if sleeps {
            cortex_m::asm::wfi();
        }
        sleeps
    }) {}
    // What woke it is looked at only now.
    IS_WOKEN.store(false, Ordering::Relaxed);
}
