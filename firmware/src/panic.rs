//! What happens when something that must not happen does: the servos are let go, then a reset.
//!
//! A stack overflow gets no further than a fault with nowhere to put its frame: the processor locks
//! up, at which the chip resets itself.

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

use crate::{servo, telemetry};

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    telemetry::panicked(info.location());
    servo::stop();
    SCB::sys_reset()
}

#[exception]
// SAFETY: the signature that the attribute demands; the frame is not used.
unsafe fn HardFault(_frame: &ExceptionFrame) -> ! {
    servo::stop();
    SCB::sys_reset()
}
