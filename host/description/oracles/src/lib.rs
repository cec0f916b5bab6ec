//! Random descriptions with random frames, and the check of a description. Tests of descriptions, tests of generated
//! code and the fuzz target `description` use this crate.

#![allow(
    clippy::indexing_slicing,
    clippy::missing_panics_doc,
    clippy::must_use_candidate,
    clippy::unwrap_used,
    reason = "a panic is a finding"
)]

mod agreement;
mod drawn;

pub use agreement::{agrees_with_the_reference, is_refused_or_agrees};
pub use drawn::{
    CHECKSUMS, CONTENTS, COUNTED, ENDS, FIELDS, LENGTH_TYPES, LENGTHS, PACKETS, SYNCS, description,
    frames, text_frame, values, with_any_end,
};
