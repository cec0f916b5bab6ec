//! Runs the firmware's release images, unchanged, in the emulator.
//!
//! `cargo xtask verify --only emulated` builds them, and sets the variable `FRAMELOCK_IMAGES` to
//! their folder. Without this variable the tests fail; they are never skipped.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

mod assumptions;
mod board;
mod bounds;
mod error_floods;
mod figures;
mod firmware;
mod image;
mod line_errors;
mod outputs;
mod random;
mod rare_times;
mod receiving;
mod renode;
mod resets;
mod scripts;
mod self_test;
mod stack;
mod symbols;
