//! Tests of the board's functions, the peripherals' registers, and the runner's command line.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

mod assumptions;
mod board;
mod boards;
#[cfg(feature = "runner")]
mod runner;
mod scripts;
