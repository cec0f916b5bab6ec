//! The parts of the firmware's examples that touch no registers. The tests run them on the computer.
#![no_std]
#![allow(
    clippy::must_use_candidate,
    clippy::new_without_default,
    reason = "examples show only what a program needs"
)]

pub mod embassy;
pub mod rp2040;
pub mod rtic;
