//! Tests that the receivers and the failsafe in C, compiled by several compilers, behave like those in Rust. Also tests
//! the ways to use the C code that `docs/c.md` describes.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "tests: a panic is a failure"
)]

mod arduino;
mod compilers;
mod delivery;
mod descriptions;
mod difference;
mod dma;
mod failsafe;
mod generated;
mod guide;
mod headers;
mod lecture;
mod lecture_in_rust;
mod machines;
mod messages;
mod refusals;
