//! The core against the lecture's table, the naive reference, and what is known about the protocol.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

mod against_reference;
mod checksum;
mod examples;
mod failsafe;
mod lecture_table;
mod protocol_findings;
#[cfg(any(feature = "embedded-io", feature = "embedded-io-async"))]
mod reader;
mod receiver_rule;
