//! framelock on another chip, an RP2040. It receives setpoints on UART0, passes them to a failsafe, and logs the
//! failsafe's output.
//!
//! **This program compiles, but it has never run.**
//!
//! embassy-rp's `BufferedUartRx` receives by interrupt. The driver reports errors of all kinds. It reports an error
//! after it has returned all bytes that were received before the error. The program turns each error into a line event,
//! and also each read that takes too long while bytes are pending.
//!
//! This program is no safety function: a platform needs a switch that cuts the power of its actuators.
#![no_std]
#![no_main]
#![allow(
    clippy::used_underscore_binding,
    reason = "Embassy's macro uses `_spawner`"
)]

use core::cell::RefCell;

use defmt::{info, unwrap, warn};
use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_rp::uart::{BufferedInterruptHandler, BufferedUartRx, Config, Error};
use embassy_rp::{bind_interrupts, pac, peripherals};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_io_async::Read;
use framelock::motion::{Failsafe, FailsafeParameters};
use framelock::{Line, LineEvent, Receiver};
use {defmt_rtt as _, panic_probe as _};

bind_interrupts!(struct Interrupts {
    UART0_IRQ => BufferedInterruptHandler<peripherals::UART0>;
});

/// The length of a silence that ends a frame. It is longer than the pauses that a USB serial adapter inserts into a
/// frame.
const IDLE: Duration = Duration::from_millis(5);

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_rp::init(embassy_rp::config::Config::default());
    // 115 200 baud, 8N1, on GP1. The driver keeps up to 256 bytes while this program is busy.
    let mut buffer = [0; 256];
    let mut uart =
        BufferedUartRx::new(p.UART0, Interrupts, p.PIN_1, &mut buffer, Config::default());
    // The driver sets no pull-up. Without one, an open line floats, and its noise looks like bytes.
    pac::PADS_BANK0.gpio(1).modify(|pad| pad.set_pue(true));
    let parameters = FailsafeParameters::for_clock(1_000, 20, [128; 3]);
    let failsafe = RefCell::new(unwrap!(Failsafe::new(parameters, milliseconds())));
    let receive = async {
        let mut line = Line::new(Receiver::new());
        let mut bytes = [0; 64];
        loop {
            let read = match with_timeout(IDLE, uart.read(&mut bytes)).await {
                Ok(Ok(count)) => Ok(bytes.get(..count).unwrap_or_default()),
                Ok(Err(Error::Overrun)) => Err(LineEvent::Overrun),
                Ok(Err(Error::Break)) => Err(LineEvent::Break),
                Ok(Err(Error::Parity)) => Err(LineEvent::Parity),
                // Framing errors, and kinds of errors that later versions of embassy-rp may add.
                Ok(Err(_)) => Err(LineEvent::Framing),
                Err(_) if line.pending() > 0 => Err(LineEvent::Idle),
                Err(_) => continue,
            };
            if let Err(event) = read {
                warn!("{}", event);
            }
            framelock_example_handlers::rp2040::take(&mut line, read, |setpoint| {
                failsafe.borrow_mut().frame(setpoint);
            });
        }
    };
    join(receive, actuate(&failsafe)).await;
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
