//! The receivers in C do the same as the receivers in Rust.
//!
//! Each harness calls functions of the C file beside `src` that has the name of one of the harness's modules. `cargo xtask
//! prove --c` proves them, and the harnesses in these files about the C alone. `docs/c.md` has the table of all proofs.
#![no_std]

#[cfg(kani)]
mod classification;
#[cfg(kani)]
mod engine;
#[cfg(kani)]
mod failsafe;
#[cfg(kani)]
mod windows;
