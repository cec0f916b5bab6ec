//! Tests of the command line as a process, with pipes, serial lines and terminals.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::float_cmp,
    reason = "a panic fails the test"
)]
#![cfg_attr(
    not(target_os = "linux"),
    allow(dead_code, unused_imports, reason = "for tests that need Linux")
)]

mod decode;
#[cfg(target_os = "linux")]
mod demo;
mod encode;
mod every_subcommand;
mod hints;
#[cfg(target_os = "linux")]
mod monitor;
mod process;
#[cfg(target_os = "linux")]
mod pseudo_terminal;
mod recordings;
mod round_trips;
#[cfg(target_os = "linux")]
mod send;
mod terminal;
#[cfg(unix)]
mod transcripts;
