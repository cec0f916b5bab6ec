//! Tests of descriptions through the public interface of the crate.

#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::doc_markdown,
    clippy::too_many_lines,
    reason = "a panic fails the test"
)]

mod keys;
mod mavlink;
mod shipped;
mod wrong;
