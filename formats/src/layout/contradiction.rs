//! Contradictions between the parts of a layout.

use core::fmt;

/// A contradiction between the parts of a [`Layout`](super::Layout). The message says which part is wrong, and how to
/// correct it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Contradiction {
    /// The part that is wrong.
    pub part: Part,
    /// The message, without the index of the fixed bits.
    pub message: &'static str,
}

/// A part of a [`Layout`](super::Layout), named after the field.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum Part {
    /// The sync.
    Sync,
    /// The length.
    Length,
    /// The length of the shortest frame.
    Shortest,
    /// The length of the longest frame.
    Longest,
    /// The fixed bits with this index.
    Fixed(usize),
    /// The known messages.
    Messages,
    /// The checksum.
    Checksum,
    /// The terminator.
    Terminator,
    /// The content.
    Content,
    /// The other terminators.
    OtherTerminators,
    /// The trailer.
    Trailer,
}

impl Contradiction {
    pub(super) const fn new(part: Part, message: &'static str) -> Self {
        Self { part, message }
    }
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message)?;
        if let Part::Fixed(index) = self.part {
            write!(f, " (fixed bits with index {index})")?;
        }
        Ok(())
    }
}

impl core::error::Error for Contradiction {}
