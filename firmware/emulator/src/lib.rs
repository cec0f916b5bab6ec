//! The slice of an nRF52840 that framelock's firmware uses, around `rsemu`'s Cortex-M4F core: it
//! runs the firmware's ELF unchanged, so that what is tested is what would be flashed.
//!
//! ```no_run
//! use framelock_emulator::{Board, Image, MICROSECOND};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut board = Board::new(Image::parse(&std::fs::read("firmware.elf")?)?)?;
//! board.run_for(2_000 * MICROSECOND)?; // it boots
//! let sent = board.send(b"AB\x00\x7F\xC8\x4A\r"); // 115200 baud, when the stop bit is over
//! board.run_until(sent + 25_000 * MICROSECOND)?;
//! let pulses = board.pwm_periods().last().map(|period| period.pulses());
//! println!("{pulses:?} us, {} instructions", board.instructions());
//! # Ok(())
//! # }
//! ```
//!
//! # What is modelled
//!
//! | Part | File | What |
//! | --- | --- | --- |
//! | UARTE0 | `uarte.rs`, `uarte/receiver.rs` | reception: EasyDMA, FIFO, shorts, all error causes, sampled bit by bit |
//! | line and sender | `line.rs`, `faults.rs` | baud rate of its own, parity, breaks, missing stop bits, noise |
//! | TIMER0 to 4 | `timer.rs` | timer and counter, captures, compares, shorts |
//! | PPI | `ppi.rs` | programmable channels, forks, groups |
//! | PWM0 | `pwm.rs` | sequences from RAM; the pulses that come out |
//! | WDT | `watchdog.rs` | reload, timeout, reset |
//! | CLOCK, POWER | `clock.rs` | oscillators' start, RESETREAS |
//! | GPIO | `gpio.rs` | outputs, and the input buffer |
//! | FICR, UICR, NVMC | `factory.rs` | what start-up code reads |
//! | RTT, defmt | `rtt.rs`, `log.rs` | logs, as a debug probe fetches them |
//!
//! Each file cites the section of the *nRF52840 Product Specification* that it follows, and says
//! what that leaves open. Core, NVIC, SCB, SysTick and DWT's cycle counter are `rsemu`'s.
//!
//! **A register that is not modelled is an error**, which names address, peripheral and program
//! counter: never silently zero. That holds for the peripherals' address range; the core's own
//! (`0xE000_0000`) is answered by `rsemu`, where unknown registers read as zero.
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
//! only a board shows. While the core sleeps, SysTick and the cycle counter stand still.
//!
//! # Speed
//!
//! `rsemu` interprets, and is where the time goes: on two cores of a cloud machine, 12 million
//! instructions a second while the core is busy, and 5 million with the line full at 1 Mbaud, which is
//! about as fast as the chip. Optimised, without debug assertions: the example `speed` measures it. Sleep
//! costs nothing.

mod board;
mod bus;
mod chip;
mod clock;
mod error;
mod factory;
mod faults;
mod gpio;
mod handlers;
mod image;
mod line;
mod log;
mod memory;
mod peripheral;
mod ppi;
mod pwm;
mod rtt;
mod timer;
mod uarte;
mod watchdog;

pub use board::{Board, Change, Reset};
pub use chip::{Pins, ResetCause};
pub use error::{Access, Error, Misuse, Result};
pub use faults::{Fault, Faults};
pub use handlers::{Activation, HandlerTotals};
pub use image::{Image, Symbol};
pub use line::{Line, Parity, Symbol as LineSymbol};
pub use log::{LogDecoder, LogTable};
pub use memory::{FLASH_SIZE, Memory, RAM_SIZE, RAM_START};
pub use pwm::Period;
pub use uarte::Assumptions;

/// Cycles of the core clock in a second.
pub const CYCLES_PER_SECOND: u64 = 64_000_000;
/// A microsecond, in cycles.
pub const MICROSECOND: u64 = CYCLES_PER_SECOND / 1_000_000;
/// A millisecond, in cycles.
pub const MILLISECOND: u64 = 1_000 * MICROSECOND;
