//! The firmware's release images, unchanged, in the emulator.
//!
//! They are built by `cargo xtask verify --only emulated`, which says in the variable
//! `FRAMELOCK_IMAGES` where they are. Without it the tests fail; they are never skipped.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

mod assumptions;
mod board;
mod error_floods;
mod figures;
mod firmware;
mod held_off_handlers;
mod image;
mod line_errors;
mod outputs;
mod random;
mod receiving;
mod self_test;
mod stack;
