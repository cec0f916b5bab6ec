//! framelock in Embassy, on an nRF52840. It receives setpoints on UARTE0, passes them to a failsafe, and
//! logs the failsafe's output.
//!
//! `BufferedUarteRx` receives in the background. It reports no errors except overruns, so TIMER1 counts all errors of
//! the UARTE. A read that takes too long shows that the line is idle.
//!
//! Reception and outputs are two futures of one task, so neither interrupts the other's call of the failsafe.
//!
//! This program is no safety function: a platform needs a switch that cuts the power of its actuators.
#![no_std]
#![no_main]
#![allow(
    clippy::used_underscore_binding,
    reason = "Embassy's macro uses `_spawner`"
)]

use core::{cell::RefCell, ptr::NonNull};

use defmt::{info, unwrap, warn};
use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_nrf::buffered_uarte::{BufferedUarteRx, InterruptHandler};
use embassy_nrf::config::HfclkSource;
use embassy_nrf::ppi::{Event, Ppi};
use embassy_nrf::{bind_interrupts, pac, peripherals, timer, uarte};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use framelock::LineEvent;
use framelock::motion::{Failsafe, FailsafeParameters};
use framelock_example_handlers::embassy::Reception;
use {defmt_rtt as _, panic_probe as _};

bind_interrupts!(struct Interrupts {
    UARTE0 => InterruptHandler<peripherals::UARTE0>;
});

/// The length of a silence that ends a frame. It is longer than the pauses that a USB serial adapter inserts into a
/// frame.
const IDLE: Duration = Duration::from_millis(5);

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    // The UARTE's baud rate is accurate enough only with the crystal.
    let mut config = embassy_nrf::config::Config::default();
    config.hfclk_source = HfclkSource::ExternalXtal;
    let mut p = embassy_nrf::init(config);
    // TIMER1 counts the UARTE's errors.
    let errors = timer::Timer::new_counter(p.TIMER1);
    let error = unwrap!(NonNull::new(pac::UARTE0.events_error().as_ptr()));
    // SAFETY: the address belongs to an event of a peripheral.
    let error = unsafe { Event::new_unchecked(error) };
    let mut channel = Ppi::new_one_to_one(p.PPI_CH2, error, errors.task_count());
    channel.enable();
    errors.start();
    let parameters = FailsafeParameters::for_clock(1_000, 20, [128; 3]);
    let failsafe = RefCell::new(unwrap!(Failsafe::new(parameters, milliseconds())));
    let receive = async {
        let mut reception = Reception::new(errors.cc(0).capture());
        let mut buffer = [0; 256];
        loop {
            // 115 200 baud, 8N1, on the pin of the nRF52840-DK's USB serial port.
            let serial = BufferedUarteRx::new(
                p.UARTE0.reborrow(),
                p.TIMER0.reborrow(),
                p.PPI_CH0.reborrow(),
                p.PPI_CH1.reborrow(),
                p.PPI_GROUP0.reborrow(),
                Interrupts,
                p.P0_08.reborrow(),
                uarte::Config::default(),
                &mut buffer,
            );
            // The driver sets no pull-up. Without one, an open line floats, and its noise looks like bytes.
            let pin = pac::P0.pin_cnf(8);
            pin.modify(|pin| pin.set_pull(pac::gpio::vals::Pull::Pullup));
            receive_until_overrun(serial, errors.cc(0), &mut reception, &failsafe).await;
            // The driver may have lost its position in the buffer, so restart the driver.
            reception.restart(errors.cc(0).capture());
            warn!("{}", LineEvent::Overrun);
        }
    };
    join(receive, actuate(&failsafe)).await;
}

async fn receive_until_overrun(
    mut serial: BufferedUarteRx<'_>,
    errors: timer::Cc<'_>,
    reception: &mut Reception,
    failsafe: &RefCell<Failsafe<u8, 3>>,
) {
    let mut bytes = [0; 64];
    loop {
        // After an error, read until the driver's buffer is empty.
        let wait = if reception.in_doubt {
            Duration::MIN
        } else {
            IDLE
        };
        let read = match with_timeout(wait, serial.read(&mut bytes)).await {
            Ok(Ok(count)) => bytes.get(..count),
            Ok(Err(_)) => return,
            Err(_) => None,
        };
        let frame = |setpoint| failsafe.borrow_mut().frame(setpoint);
        if let Some(event) = reception.take(read, errors.capture(), frame) {
            warn!("{}", event);
        }
    }
}

/// Moves the outputs fifty times a second. Set servos here.
async fn actuate(failsafe: &RefCell<Failsafe<u8, 3>>) {
    let mut last = None;
    loop {
        let output = failsafe.borrow_mut().poll(milliseconds());
        if last.replace(output) != Some(output) {
            info!("{}", output);
        }
        Timer::after_millis(20).await;
    }
}

/// Returns the time of the failsafe's clock.
#[expect(clippy::cast_possible_truncation, reason = "it may wrap")]
fn milliseconds() -> u32 {
    Instant::now().as_millis() as u32
}
