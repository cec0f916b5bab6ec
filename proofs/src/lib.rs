//! The reference for framelock's receivers, and the theorems about the receivers.
//!
//! * [`mod@reference`]: the naive whole-buffer reference. It shares no code with the receivers. Tests,
//!   fuzzing and proofs compare the receivers with it.
//! * The other modules (under `cfg(kani)`): the theorems as Kani harnesses, and the states and the parser that the
//!   harnesses use. Harnesses that use private items are in the crates that contain these items.
//!
//! `../README.md` has the table of all theorems.
#![no_std]
#![cfg_attr(not(kani), forbid(unsafe_code))]
#![cfg_attr(
    kani,
    allow(
        clippy::arithmetic_side_effects,
        clippy::indexing_slicing,
        reason = "a harness finds each panic that these lints would warn about"
    )
)]

#[cfg(kani)]
mod accounting;
#[cfg(kani)]
mod against_reference;
#[cfg(kani)]
mod any_parser;
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
#[cfg(kani)]
mod reader;
pub mod reference;
#[cfg(kani)]
mod resynchronisation;
#[cfg(kani)]
mod slices;
#[cfg(kani)]
mod states;
#[cfg(kani)]
mod table;
