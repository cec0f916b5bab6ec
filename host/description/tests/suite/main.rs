//! Descriptions as others use them.

#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

mod agreement;
mod drawn;
mod keys;
mod random;
mod shipped;
mod wrong;
