//! Handles panics, faults and the watchdog, and reports the cause of the last reset and the outputs before it.
//!
//! After a panic or a fault, the program stops the servo pulses and resets the chip. A stack overflow causes a fault,
//! but the fault's exception frame does not fit on the stack. So the processor locks up, and the chip resets itself.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering, compiler_fence};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use framelock::motion::Setpoint;
use nrf52840_hal::pac::{POWER, WDT};
use nrf52840_hal::wdt::{self, WatchdogHandle, count::One, handles::Hdl0};

use crate::settings::WATCHDOG;
use crate::{servo, telemetry};

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    telemetry::panicked(info.location());
    servo::stop();
    SCB::sys_reset()
}

#[exception]
// SAFETY: the attribute requires this signature, and the handler does not use the frame.
unsafe fn HardFault(_frame: &ExceptionFrame) -> ! {
    servo::stop();
    SCB::sys_reset()
}

/// The watchdog. Only the main loop feeds it, and only while the receiver works. The watchdog also covers the
/// failsafe's clock, because without the clock no tick wakes the main loop.
pub(crate) struct Watchdog(WatchdogHandle<Hdl0>);

impl Watchdog {
    /// Starts the watchdog, which then runs until a reset. By its default settings, it keeps running during sleep, and
    /// pauses while a debugger halts the core.
    ///
    /// A soft reset does not stop the watchdog, and the settings of a running watchdog cannot be changed. So after
    /// flashing, the old program's timeout stays in force until the chip is reset by power-on, the reset pin or the
    /// watchdog. Returns `None` if the old program used a different number of watchdog handles. Then the caller resets
    /// the chip, again and again, until the unfed watchdog resets it. This reset stops the watchdog.
    pub(crate) fn start(watchdog: WDT) -> Option<Self> {
        let parts = wdt::Watchdog::try_new(watchdog)
            .map(|mut watchdog| {
                watchdog.set_lfosc_ticks(WATCHDOG * 32_768 / 1_000);
                watchdog.activate::<One>()
            })
            .or_else(wdt::Watchdog::try_recover::<One>);
        let (handle,) = parts.ok()?.handles;
        Some(Self(handle))
    }

    /// Feeds the watchdog if the receiver works. The main loop calls it once a tick.
    pub(crate) fn feed(&mut self, receiver_works: bool) {
        if receiver_works {
            self.0.pet();
        }
    }
}

/// Returns the cause of the last reset, as the bits of RESETREAS, and clears the register. 0 means power-on. If
/// the reset pin's bit is set, other bits may be set wrongly (erratum 136), so this function ignores them.
pub(crate) fn cause(power: &POWER) -> u32 {
    let cause = power.resetreas.read();
    // SAFETY: writing 1 to a bit clears it.
    power.resetreas.write(|w| unsafe { w.bits(cause.bits()) });
    if cause.resetpin().is_detected() {
        return 1;
    }
    cause.bits()
}

/// The last output, and a mark. The output is pitch, roll, yaw and a check byte in one word. One instruction writes
/// this word, so a reset leaves either the last output or the one before, and never a part of each.
///
/// No start-up code writes to this section. After power-on its content is arbitrary. Any other reset usually leaves it
/// unchanged. A brown-out looks like power-on but leaves the servos where they are, so only mark and check byte show
/// whether the output is known. Arbitrary content passes this check with a probability of 2^-40. The attribute `used`
/// prevents the compiler from assuming that the words are zero.
#[used]
#[unsafe(no_mangle)]
#[unsafe(link_section = ".uninit.LAST_OUTPUT")]
static LAST_OUTPUT: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// The mark, which shows that the program has stored an output since power-on.
const MARK: u32 = 0x5E27_0A75;

/// Returns the outputs before the reset, or `None` if they are not known.
pub(crate) fn last_output() -> Option<Setpoint> {
    let [output, mark] = LAST_OUTPUT
        .each_ref()
        .map(|word| word.load(Ordering::Relaxed));
    let [pitch, roll, yaw, _] = output.to_le_bytes();
    let setpoint = Setpoint { pitch, roll, yaw };
    (mark == MARK && output == word(setpoint)).then_some(setpoint)
}

/// Stores these outputs in RAM, so that the program can resume them after a reset.
pub(crate) fn keep_output(setpoint: Setpoint) {
    let [output, mark] = &LAST_OUTPUT;
    output.store(word(setpoint), Ordering::Relaxed);
    // Write the mark second, because it says that the output has been stored.
    compiler_fence(Ordering::SeqCst);
    mark.store(MARK, Ordering::Relaxed);
}

/// Returns the word for these outputs. If one bit of the outputs changes, the check byte changes, too.
fn word(Setpoint { pitch, roll, yaw }: Setpoint) -> u32 {
    u32::from_le_bytes([pitch, roll, yaw, !(pitch ^ roll ^ yaw)])
}
