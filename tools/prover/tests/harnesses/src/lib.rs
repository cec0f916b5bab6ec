//! Harnesses that test the prover: a prover that calls everything proved is worthless. Each harness
//! in `fails` has one fault of a kind that no proof may have. The harnesses in `holds` have no
//! fault.
#![no_std]
#![cfg_attr(
    kani,
    allow(
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::undocumented_unsafe_blocks,
        clippy::arithmetic_side_effects,
        reason = "the harnesses contain faults on purpose"
    )
)]

#[cfg(kani)]
mod fails;
#[cfg(kani)]
mod holds;
#[cfg(kani)]
mod offline;
