//! Tests of descriptions through the public interface of the crate.

#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::doc_markdown,
    clippy::too_many_lines,
    reason = "a panic fails the test"
)]

mod ibus;
mod keys;
mod kinds;
mod mavlink;
mod shipped;
mod wrong;

use framelock_description::{Field, Kind};

/// Returns the fields of a frame, each with its values as text.
fn values<'k>(kind: &'k Kind, frame: &'k [u8]) -> Vec<(&'k Field, String)> {
    let fields = kind.values(frame).map(|(field, content)| {
        let values = content.values().map(|value| value.to_string());
        (field, values.collect::<Vec<_>>().join(" "))
    });
    fields.collect()
}
