//! Proves that the C receivers do the same as the Rust receivers.
//!
//! Each harness calls functions of a C file in the folder above `src`. The module of a harness has the name of this C
//! file. `cargo xtask prove --c` runs these harnesses. It also runs the harnesses in the C files, which concern only
//! the C code. `docs/c.md` lists all proofs.
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
mod packets;
#[cfg(kani)]
mod windows;
