//! Tests the core against the naive reference and the oracles.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

mod against_reference;
mod checksum;
mod failsafe;
mod packets;
mod receiver_rule;
