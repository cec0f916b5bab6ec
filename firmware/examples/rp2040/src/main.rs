//! framelock on another chip, an RP2040. It receives setpoints on UART0 and logs them.
//!
//! **This program compiles, but it has never run.**
//!
//! embassy-rp's `BufferedUartRx` receives by interrupt and implements `Read` of `embedded-io-async`, so framelock's
//! `Reader` can read from it directly. The driver reports errors of all kinds. It reports an error after it has
//! returned all bytes that were received before the error. The program turns each error into a line event.
#![no_std]
#![no_main]
#![allow(
    clippy::used_underscore_binding,
    reason = "Embassy's macro uses `_spawner`"
)]

use defmt::{info, warn};
use embassy_executor::Spawner;
use embassy_rp::uart::{BufferedInterruptHandler, BufferedUartRx, Config, Error};
use embassy_rp::{bind_interrupts, peripherals};
use framelock::motion::Bin;
use framelock::{LineEvent, Reader, Receiver};
use {defmt_rtt as _, panic_probe as _};

bind_interrupts!(struct Interrupts {
    UART0_IRQ => BufferedInterruptHandler<peripherals::UART0>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_rp::init(embassy_rp::config::Config::default());
    // 115 200 baud, 8N1, on GP1. The driver keeps up to 256 bytes while this program is busy.
    let mut buffer = [0; 256];
    let uart = BufferedUartRx::new(p.UART0, Interrupts, p.PIN_1, &mut buffer, Config::default());
    let mut reader = Reader::<_, _, 64>::new(uart, Receiver::<Bin>::new());
    loop {
        match reader.next_message_async().await {
            // Set servos here.
            Ok(Some(setpoint)) => info!("{}", setpoint),
            Ok(None) => return, // The end of the source, which a UART does not have.
            Err(error) => {
                let event = match error {
                    Error::Overrun => LineEvent::Overrun,
                    Error::Break => LineEvent::Break,
                    Error::Parity => LineEvent::Parity,
                    // Framing errors, and kinds of errors that later versions of embassy-rp may add.
                    _ => LineEvent::Framing,
                };
                // The pending bytes are discarded and counted. The next read continues.
                reader.line_mut().line_event(event, |_| ());
                warn!("{}", event);
            }
        }
    }
}
