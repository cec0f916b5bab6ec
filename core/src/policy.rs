//! The two policies of recovery: what a receiver does with a frame that went wrong.

/// What becomes of the bytes behind the one at which a frame went wrong.
pub trait Policy: sealed::Sealed {
    /// Whether they are searched again for the start of a frame.
    const RESCANS: bool;
}

/// They are searched again: no frame that the line delivers whole is ever lost, but to an earlier
/// one that it overlaps.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Rescan {}

/// All are thrown away, as the lecture's machine does: for comparison. It can go deaf.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Discard {}

impl Policy for Rescan {
    const RESCANS: bool = true;
}

impl Policy for Discard {
    const RESCANS: bool = false;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Rescan {}
    impl Sealed for super::Discard {}
}
