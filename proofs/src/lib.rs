//! What framelock's receivers are measured against, and the theorems about them.
//!
//! * [`mod@reference`]: the naive whole-buffer reference. It shares no code with the receivers; tests,
//!   fuzzing and proofs compare the two.
//! * `harnesses` (under `cfg(kani)`): the theorems, each a Kani harness.
#![no_std]
#![cfg_attr(not(kani), forbid(unsafe_code))]

#[cfg(kani)]
mod harnesses;
pub mod reference;
