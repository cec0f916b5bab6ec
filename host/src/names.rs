//! Frame formats and policies, by the names that the command line gives them.

use clap::ValueEnum;

/// A frame format.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum FrameName {
    /// 'A' 'B' reserved pitch roll yaw CR
    Bin,
    /// 'A' 'B' reserved pitch roll yaw crc CR
    BinCrc8,
}

/// What becomes of the bytes behind the one at which a frame went wrong.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum PolicyName {
    /// They are searched again: one loss costs one frame
    Rescan,
    /// They are thrown away, as the lecture's machine does: for comparison
    Discard,
}
