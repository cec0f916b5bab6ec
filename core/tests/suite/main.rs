//! Tests the core against the lecture's table, the naive reference, and known properties of the
//! protocol.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

mod against_reference;
mod buffered;
mod checksum;
mod display;
mod examples;
mod failsafe;
mod lecture_table;
mod parser;
mod protocol_findings;
#[cfg(any(feature = "embedded-io-v0.7", feature = "embedded-io-async-v0.7"))]
mod reader;
mod receiver_rule;
mod shape;
mod size;
