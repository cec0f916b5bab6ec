//! Tests of the header, the library and the pages about them with a C compiler.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "tests: a panic is a failure"
)]

mod compiler;
mod guide;
mod header;
mod layouts;
mod lecture_in_rust;
mod pages;
mod receiving;
mod steps;
