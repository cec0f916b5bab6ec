//! The receivers in C do the same as the receivers in Rust.
//!
//! Each harness calls functions of a C file in the folder above `src`. One of the harness's modules has the same name
//! as this file. `cargo xtask prove --c` runs these harnesses, and the harnesses in the C files, which are about the C
//! alone. `docs/c.md` has the table of all proofs.
#![no_std]
#![cfg_attr(
    kani,
    allow(
        clippy::arithmetic_side_effects,
        clippy::indexing_slicing,
        reason = "a harness finds each panic that these lints would warn about"
    )
)]

#[cfg(kani)]
mod classification;
#[cfg(kani)]
mod engine;
#[cfg(kani)]
mod failsafe;
#[cfg(kani)]
mod windows;
