//! What framelock's receivers are measured against, and the theorems about them.
//!
//! * [`mod@reference`]: the naive whole-buffer reference. It shares no code with the receivers; tests,
//!   fuzzing and proofs compare the two.
//! * The other modules (under `cfg(kani)`): the theorems as Kani harnesses, a module for each. Those
//!   about the receiver's engine and the failsafe are in `core`, beside what they look into.
//!
//! No harness assumes anything about what the line delivers. `../README.md` has the table.
#![no_std]
#![cfg_attr(not(kani), forbid(unsafe_code))]
#![cfg_attr(
    kani,
    allow(
        clippy::arithmetic_side_effects,
        clippy::indexing_slicing,
        reason = "what goes wrong is what a harness would find"
    )
)]

#[cfg(kani)]
mod accounting;
#[cfg(kani)]
mod against_reference;
#[cfg(kani)]
mod checksum;
#[cfg(kani)]
mod commits;
#[cfg(kani)]
mod encoding;
#[cfg(kani)]
mod line_events;
#[cfg(kani)]
mod no_panic;
pub mod reference;
#[cfg(kani)]
mod resynchronisation;
#[cfg(kani)]
mod slices;
#[cfg(kani)]
mod states;
#[cfg(kani)]
mod table;
