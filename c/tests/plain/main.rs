//! Tests that generated C headers, compiled by several compilers, behave like the Rust receivers.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "tests: a panic is a failure"
)]

mod compilers;
mod delivery;
mod difference;
#[path = "../../../host/description/tests/suite/drawn.rs"]
mod drawn;
mod engine;
mod failsafe;
mod generated;
mod headers;
mod machines;
