//! An nRF52840, as far as firmware needs it that receives on UARTE0 and drives pins and servos,
//! around `rsemu`'s Cortex-M4F core. It runs the firmware's ELF unchanged, so that what is tested is
//! what would be flashed.
//!
//! ```no_run
//! use nrf52840_emulator::{Board, Image, MILLISECOND};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut board = Board::new(Image::parse(&std::fs::read("firmware.elf")?)?)?;
//! board.run_for(2 * MILLISECOND)?; // it boots
//! let sent = board.send(b"hello\r"); // 115200 baud; returns when the last stop bit is over
//! board.run_until(sent + 25 * MILLISECOND)?;
//! let trace = board.trace();
//! let pulses = trace.pwm_periods.last().map(|period| period.pulses());
//! println!("{pulses:?} us, {} handlers ran", trace.activations.len());
//! # Ok(())
//! # }
//! ```
//!
//! # What is modelled
//!
//! | Part | File | What |
//! | --- | --- | --- |
//! | UARTE0 | `uarte/reception.rs`, `uarte/sampler.rs` | reception: EasyDMA, FIFO, shorts, all error causes, sampled bit by bit |
//! | what is not known of the chip | `assumptions.rs` | how a test chooses it: [`Assumptions`] |
//! | UARTE1 | `uarte/transmission.rs` | transmission, which a wire may bring to UARTE0 |
//! | line and sender | `line.rs` | baud rate of its own, parity, breaks, missing stop bits, noise |
//! | TIMER0 to 4 | `timer.rs`, `counter.rs` | timer and counter, captures, compares, shorts |
//! | RTC1 | `rtc.rs`, `counter.rs` | the counter, compares, overflow |
//! | PPI | `ppi.rs` | programmable channels, forks, groups |
//! | PWM0 | `pwm.rs` | sequences from RAM; the pulses that come out |
//! | WDT | `watchdog.rs` | reload, timeout, reset |
//! | CLOCK, POWER, APPROTECT | `clock.rs` | the clocks' start, RESETREAS, the debug port |
//! | UICR, NVMC | `nonvolatile.rs` | words written, the instruction cache switched (without effect) |
//! | TEMP | `nonvolatile.rs` | its calibration, kept without effect |
//! | GPIO | `gpio.rs` | outputs, and the input buffer |
//! | RTT, defmt | `log.rs` | logs, as a debug probe fetches them |
//!
//! Each file cites the section of the *nRF52840 Product Specification* that it follows, and says
//! what that leaves open. Core, NVIC, SCB, SysTick and DWT's cycle counter are `rsemu`'s.
//!
//! **A register that is not modelled is an error**, which names address, peripheral and program
//! counter: never silently zero. That holds for the peripherals' address range; the core's own
//! (`0xE000_0000`) is answered by `rsemu`, where unknown registers read as zero. An interrupt that comes in an IT
//! block waits for its end, four instructions at most: `rsemu` would forget the condition.
//!
//! # Time
//!
//! Time is counted in cycles of the 64 MHz core clock from power-on, and repeats exactly. While the
//! core sleeps, the time to the next event is skipped. An access to a register takes place at the
//! beginning of its instruction.
//!
//! **Cycles are the model's.** Every instruction takes one, plus one for each data access and two for
//! a taken branch (`rsemu`'s table). Entering an exception takes 20 and leaving it 18, where the
//! Cortex-M4's manual says 12 and 10 for memory without wait states: stacking is charged twice. There
//! are no flash wait states, no bus contention, no write buffer: silicon may be slower, by how much
//! only a board shows; [`Assumptions::slowness`] makes the model slower. While the core sleeps,
//! SysTick and the cycle counter stand still.
//!
//! Build `rsemu` and this crate optimised in tests too, and `rsemu` without debug assertions
//! (`[profile.dev.package.rsemu]`): then a busy core is emulated about as fast as the chip runs.

mod assumptions;
mod board;
mod bus;
mod chip;
mod clock;
mod counter;
mod error;
mod gpio;
mod image;
mod line;
mod log;
mod memory;
mod nonvolatile;
mod peripheral;
mod ppi;
mod pwm;
mod rtc;
mod timer;
mod trace;
mod uarte;
mod watchdog;

pub use assumptions::Assumptions;
pub use board::Board;
pub use chip::ResetCause;
pub use error::{Access, Error, Refusal, Result};
pub use gpio::Pins;
pub use image::{Image, Symbol};
pub use line::{Line, Parity, Symbol as LineSymbol};
pub use log::{LogDecoder, LogTable};
pub use memory::{FLASH_SIZE, Memory, RAM_SIZE, RAM_START};
pub use pwm::Period;
pub use trace::{Activation, Change, Reset, Trace};

/// Cycles of the core clock in a second.
pub const CYCLES_PER_SECOND: u64 = 64_000_000;
/// A microsecond, in cycles.
pub const MICROSECOND: u64 = CYCLES_PER_SECOND / 1_000_000;
/// A millisecond, in cycles.
pub const MILLISECOND: u64 = 1_000 * MICROSECOND;
