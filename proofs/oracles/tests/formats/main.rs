//! Tests the formats against the naive interpreter of layouts and the oracles.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

mod against_reference;
mod layouts;
mod several;
