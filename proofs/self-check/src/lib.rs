//! Harnesses that must come out as their documentation says: `cargo xtask prove --self-check`.
//!
//! A checker that calls everything proved is worth nothing. Each of these has one fault of a kind
//! that the proofs must not have, or shows that a thing without fault passes.
#![no_std]

#[cfg(kani)]
mod harnesses;
