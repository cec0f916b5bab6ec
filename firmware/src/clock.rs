//! The time in microseconds (TIMER0), the tick, and the main loop's sleep until the next tick.

use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::interrupt::free;
use nrf52840_hal::pac::timer0::RegisterBlock;
use nrf52840_hal::pac::{TIMER0, interrupt};

static IS_WOKEN: AtomicBool = AtomicBool::new(false);

/// Starts a timer that counts microseconds, from 0.
pub(crate) fn count_microseconds(timer: &RegisterBlock) {
    timer.mode.write(|w| w.mode().timer());
    timer.bitmode.write(|w| w.bitmode()._32bit());
    // SAFETY: the register takes the values 0 to 9. The value 4 means 16 MHz / 2^4 = 1 MHz.
    timer.prescaler.write(|w| unsafe { w.prescaler().bits(4) });
    timer.tasks_clear.write(|w| w.tasks_clear().set_bit());
    timer.tasks_start.write(|w| w.tasks_start().set_bit());
}

/// Returns the timer's count, which wraps after 71 minutes. Reading it overwrites CC\[0\].
pub(crate) fn microseconds(timer: &RegisterBlock) -> u32 {
    timer.tasks_capture[0].write(|w| w.tasks_capture().set_bit());
    timer.cc[0].read().bits()
}

/// The clock: microseconds since it was started, modulo 2^32.
pub(crate) struct Clock {
    timer: TIMER0,
}

impl Clock {
    /// Starts the clock at 0.
    pub(crate) fn start(timer: TIMER0) -> Self {
        count_microseconds(&timer);
        timer.intenset.write(|w| w.compare1().set());
        Self { timer }
    }

    /// Returns the current time.
    pub(crate) fn now(&self) -> u32 {
        microseconds(&self.timer)
    }

    /// Wakes the main loop at `time`, or immediately if `time` has passed.
    pub(crate) fn wake_at(&self, time: u32) {
        // SAFETY: every value is a valid time.
        self.timer.cc[1].write(|w| unsafe { w.bits(time) });
        if self.now().wrapping_sub(time) <= u32::MAX / 2 {
            wake();
        }
    }
}

/// Wakes the main loop for its tick.
#[interrupt]
fn TIMER0() {
    // SAFETY: only the event's register is written. No other code uses this register, and writing 0 to it only
    // withdraws the interrupt request.
    unsafe { (*TIMER0::ptr()).events_compare[1].reset() };
    wake();
}

/// Wakes the main loop. Handlers may call this function.
pub(crate) fn wake() {
    IS_WOKEN.store(true, Ordering::Relaxed);
}

/// Sleeps until [`wake`] is called. Returns immediately if [`wake`] was called since the last sleep. Handlers run
/// during the sleep.
pub(crate) fn sleep() {
    // Disable interrupts from the check to `wfi`. Otherwise a handler could set the flag after the check and before
    // `wfi`, and this function would sleep although it was woken. A pending interrupt ends `wfi` even while interrupts
    // are disabled.
    while free(|_| {
        let sleeps = !IS_WOKEN.load(Ordering::Relaxed);
        if sleeps {
            cortex_m::asm::wfi();
        }
        sleeps
    }) {}
    // Clear the flag before the caller checks for work, so that a later `wake` is not lost.
    IS_WOKEN.store(false, Ordering::Relaxed);
}
