//! A checker that calls everything proved is worth nothing. Each harness in `fails` has one fault of
//! a kind that no proof may have; those in `holds` have none.
#![no_std]
#![cfg_attr(
    kani,
    allow(
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::undocumented_unsafe_blocks,
        clippy::arithmetic_side_effects,
        reason = "faults are what they are for"
    )
)]

#[cfg(kani)]
mod fails;
#[cfg(kani)]
mod holds;
#[cfg(kani)]
mod offline;
