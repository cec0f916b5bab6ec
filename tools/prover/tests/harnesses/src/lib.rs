//! Harnesses that test the prover. Each harness in `fails` has one fault, which the prover must find. So a prover that
//! accepts every harness fails the tests. Harnesses in `holds` have no fault. Harnesses in `offline` are not for Kani.
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
