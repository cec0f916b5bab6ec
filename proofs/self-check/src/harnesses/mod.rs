//! One fault each, or none.
#![allow(
    clippy::indexing_slicing,
    clippy::undocumented_unsafe_blocks,
    reason = "faults are what they are for"
)]

mod assumptions;
mod faults;
mod loops;
mod values;
