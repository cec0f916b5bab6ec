//! framelock in RTIC, on an nRF52840. It receives setpoints on UARTE0, passes them to a failsafe, and
//! logs the failsafe's output.
//!
//! The UARTE stores one byte at a time. While the handler is late, bytes wait in the UARTE's FIFO. If a byte arrives
//! while the FIFO is full, the UARTE reports an overrun.
//!
//! The interrupt and the task have different priorities. RTIC's `lock` keeps them from calling the failsafe at the same
//! time.
//!
//! This program is no safety function: a platform needs a switch that cuts the power of its actuators.
#![no_std]
#![no_main]

use {defmt_rtt as _, panic_probe as _};

#[rtic::app(device = nrf52840_hal::pac, dispatchers = [SWI0_EGU0])]
mod app {
    use core::sync::atomic::{AtomicU8, Ordering, fence};

    use framelock::LineEvent::{Framing, Overrun};
    use framelock::motion::{Failsafe, FailsafeParameters};
    use nrf52840_hal::{clocks::Clocks, gpio::p0, pac::UARTE0};
    use rtic_monotonics::nrf::timer::prelude::*;

    use framelock_example_handlers::rtic::Reception;

    nrf_timer0_monotonic!(Mono, 1_000_000);
    /// The byte in RAM to which the UARTE writes.
    static BYTE: AtomicU8 = AtomicU8::new(0);
    #[shared]
    struct Shared {
        failsafe: Failsafe<u8, 3>,
    }

    #[local]
    struct Local {
        uarte: UARTE0,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        Clocks::new(cx.device.CLOCK).enable_ext_hfosc();
        Mono::start(cx.device.TIMER0, Priority::rtic_default());
        // 115 200 baud, 8N1, on P0.08: the nRF52840-DK's USB serial port.
        p0::Parts::new(cx.device.P0).p0_08.into_pullup_input();
        let uarte = cx.device.UARTE0;
        // SAFETY: 8 is pin P0.08. The transfer writes one byte in RAM, which only the UARTE writes.
        unsafe {
            uarte.psel.rxd.write(|w| w.bits(8));
            uarte.rxd.maxcnt.write(|w| w.maxcnt().bits(1));
            uarte.rxd.ptr.write(|w| w.ptr().bits(BYTE.as_ptr() as u32));
        }
        uarte.baudrate.write(|w| w.baudrate().baud115200());
        uarte.intenset.write(|w| w.endrx().set().error().set());
        uarte.enable.write(|w| w.enable().enabled());
        uarte.tasks_startrx.write(|w| w.tasks_startrx().set_bit());
        let parameters = FailsafeParameters::for_clock(1_000, 20, [128; 3]);
        let failsafe = defmt::unwrap!(Failsafe::new(parameters, milliseconds()));
        defmt::unwrap!(actuate::spawn().ok());
        (Shared { failsafe }, Local { uarte })
    }

    /// Handles an error, a byte, or both.
    #[task(binds = UARTE0_UART0, priority = 2, shared = [failsafe], local = [
        uarte, reception: Reception = Reception::new(),
    ])]
    fn receive(mut cx: receive::Context) {
        let uarte = cx.local.uarte;
        let now = milliseconds();
        let (mut error, mut byte) = (None, None);
        if uarte.events_error.read().bits() != 0 {
            uarte.events_error.reset();
            let overrun = uarte.errorsrc.read().overrun().is_present();
            // SAFETY: writing 1 to a cause clears it.
            uarte.errorsrc.write(|w| unsafe { w.bits(0xF) });
            error = Some(if overrun { Overrun } else { Framing });
        }
        if uarte.events_endrx.read().bits() != 0 {
            uarte.events_endrx.reset();
            // The byte was stored before ENDRX came, and no other byte is stored before STARTRX.
            fence(Ordering::SeqCst);
            byte = Some(BYTE.load(Ordering::Relaxed));
            fence(Ordering::SeqCst);
            uarte.tasks_startrx.write(|w| w.tasks_startrx().set_bit());
        }
        if let Some(setpoint) = cx.local.reception.interrupt(now, error, byte) {
            cx.shared.failsafe.lock(|all| all.frame(setpoint));
        }
        if let Some(error) = error {
            defmt::warn!("{}", error);
        }
    }

    /// Moves the outputs fifty times a second. Set servos here.
    #[task(shared = [failsafe], priority = 1)]
    async fn actuate(mut cx: actuate::Context) {
        let mut last = None;
        loop {
            let output = cx.shared.failsafe.lock(|all| all.poll(milliseconds()));
            if last.replace(output) != Some(output) {
                defmt::info!("{}", output);
            }
            Mono::delay(20.millis()).await;
        }
    }

    /// Returns the time of the failsafe's clock.
    #[expect(clippy::cast_possible_truncation, reason = "it may wrap")]
    fn milliseconds() -> u32 {
        Mono::now().duration_since_epoch().as_millis() as u32
    }
}
