//! Policies, by the names that the command line gives them.

use clap::ValueEnum;

/// What the command line calls a value.
pub(crate) fn name(value: &impl ValueEnum) -> String {
    let name = value.to_possible_value();
    name.map_or_else(String::new, |name| name.get_name().to_owned())
}

/// What becomes of the bytes behind the one at which a frame went wrong.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum PolicyName {
    /// They are searched again: one loss costs one frame
    Rescan,
    /// They are thrown away, as the lecture's machine does: for comparison; BIN only
    Discard,
}
