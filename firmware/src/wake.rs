//! Sleep of the main loop: handlers run meanwhile, and it goes on only when one of them says so.

use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::interrupt;

static IS_WOKEN: AtomicBool = AtomicBool::new(false);

/// The main loop goes on; from a handler.
pub(crate) fn wake() {
    IS_WOKEN.store(true, Ordering::Relaxed);
}

/// Sleeps until [`wake`], or not at all if that was since the last time.
pub(crate) fn sleep() {
    // With interrupts off between look and sleep, none can slip in and be slept through: one that is
    // pending ends the sleep all the same.
    while interrupt::free(|_| {
        let sleeps = !IS_WOKEN.load(Ordering::Relaxed);
        if sleeps {
            cortex_m::asm::wfi();
        }
        sleeps
    }) {}
    // What woke it is looked at only now.
    IS_WOKEN.store(false, Ordering::Relaxed);
}
