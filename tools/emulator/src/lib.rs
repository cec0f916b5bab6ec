//! Emulates the parts of an nRF52840 that firmware needs to receive on UARTE0 and to drive pins and servos. The core is
//! `rsemu`'s Cortex-M4F. The emulator runs the firmware's ELF unchanged, so tests run the same image that is flashed.
//!
//! ```no_run
//! use nrf52840_emulator::{Board, Image, MILLISECOND};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut board = Board::new(Image::parse(&std::fs::read("firmware.elf")?)?)?;
//! board.run_for(2 * MILLISECOND)?; // it boots
//! let sent = board.send(b"hello\r"); // at 115200 baud; returns the end of the last stop bit
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
//! | Part | File | Modelled |
//! | --- | --- | --- |
//! | UARTE0 | `uarte/reception.rs`, `uarte/sampler.rs` | reception: EasyDMA, FIFO, errors, sampled bit by bit |
//! | unknown behaviour of the chip | `assumptions.rs` | selected by a test: [`Assumptions`] |
//! | UARTE1 | `uarte/transmission.rs` | transmission, optionally wired to UARTE0 |
//! | line and sender | `line.rs` | a sender with its own baud rate, breaks, missing stop bits, noise |
//! | TIMER0 to 2 | `counter.rs` | timer and counter, captures, compares, shorts to CLEAR |
//! | RTC1 | `counter.rs` | counter, compares, overflow |
//! | PPI | `ppi.rs` | programmable channels, forks, groups |
//! | PWM0 | `pwm.rs` | a sequence of one step from RAM, pulses on the pins |
//! | WDT | `watchdog.rs` | reload, timeout, reset |
//! | CLOCK, POWER, APPROTECT | `clock.rs` | the clocks' start, RESETREAS, the debug port |
//! | FICR | `nonvolatile.rs` | reading |
//! | UICR, NVMC | `nonvolatile.rs` | writing words, switching the instruction cache (without effect) |
//! | TEMP | `nonvolatile.rs` | writing the calibration (without effect) |
//! | GPIO | `gpio.rs` | `PIN_CNF`, OUT, OUTSET, OUTCLR, IN |
//! | RTT, defmt | `log.rs` | logs, fetched as by a debug probe |
//!
//! The model has only the registers that the firmware, the examples and the tests use. A peripheral's file cites the
//! section of the *nRF52840 Product Specification* that describes the peripheral. [`Assumptions`] and these files name
//! the questions that the specification leaves open. `rsemu` provides the core, NVIC, SCB, SysTick and DWT's cycle
//! counter.
//!
//! **An access to a register that is not modelled is an error.** The error names the address, the peripheral and the
//! program counter. This rule applies only to the peripherals' address range. `rsemu` models the core's own registers
//! (`0xE000_0000`). A core register that `rsemu` does not model reads as zero.
//!
//! An interrupt in an IT block waits until the block ends, at most four instructions, because `rsemu` would otherwise
//! forget the block's condition.
//!
//! # Time
//!
//! Time is counted in cycles of the 64 MHz core clock since power-on. A repeated run takes exactly the same cycles.
//! While the core sleeps, the emulator skips to the next event. A register is accessed at the beginning of the
//! instruction that accesses it.
//!
//! **Cycle counts are those of the model, not of silicon.** An instruction takes one cycle, plus one for each data
//! access, two for a taken branch, and more for divisions, long multiplications and some floating-point instructions
//! (`rsemu`'s timing model). Entering an exception takes 20 cycles and leaving it 18. For memory without wait states,
//! the Cortex-M4's manual says 12 and 10 cycles. The model takes more, because it counts the stacking and unstacking of
//! registers twice. The model has no flash wait states and no bus contention, so silicon may be slower. Only a board
//! can show how much slower. [`Assumptions::slowness`] makes the model slower. While the core sleeps, SysTick and the
//! cycle counter hardly advance.
//!
//! Even for tests, build `rsemu` and this crate with optimisation, and `rsemu` without debug assertions
//! (`[profile.dev.package.rsemu]`). Then a busy core is emulated about as fast as the chip runs.

mod assumptions;
mod board;
mod bus;
mod chip;
mod clock;
mod counter;
mod gpio;
mod image;
mod line;
mod log;
mod memory;
mod nonvolatile;
mod peripheral;
mod ppi;
mod pwm;
mod trace;
mod uarte;
mod watchdog;

pub use assumptions::Assumptions;
pub use board::Board;
pub use image::{Image, Symbol};
pub use line::{SerialLine, Symbol as LineSymbol};
pub use memory::{FLASH_SIZE, Memory, RAM_SIZE, RAM_START};
pub use trace::{Activation, Change, Period, Pins, Reset, ResetCause, Trace};

/// The reason why the emulation stopped or a call failed, as a text for people.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error("{0}")]
pub struct Error(String);

/// A result with this crate's error.
pub type Result<T> = std::result::Result<T, Error>;

/// Cycles of the core clock in a second.
pub const CYCLES_PER_SECOND: u64 = 64_000_000;
/// A microsecond, in cycles.
pub const MICROSECOND: u64 = CYCLES_PER_SECOND / 1_000_000;
/// A millisecond, in cycles.
pub const MILLISECOND: u64 = 1_000 * MICROSECOND;
