//! Tests of the core's public items.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

mod buffered;
mod display;
mod examples;
mod lecture_table;
mod packets;
mod parser;
mod protocol_findings;
#[cfg(any(feature = "embedded-io-v0.7", feature = "embedded-io-async-v0.7"))]
mod reader;
mod shape;
mod size;
