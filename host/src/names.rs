//! Frame formats and policies, by the names that the command line gives them.

use clap::ValueEnum;
use framelock::{Bin, BinCrc8, Parser, Receiver};

/// A frame format.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum FrameName {
    /// 'A' 'B' reserved pitch roll yaw CR
    Bin,
    /// 'A' 'B' reserved pitch roll yaw crc CR
    BinCrc8,
}

impl FrameName {
    /// Bytes in a frame.
    #[must_use]
    pub const fn length(self) -> usize {
        match self {
            Self::Bin => Receiver::<Bin>::FRAME_LENGTH,
            Self::BinCrc8 => Receiver::<BinCrc8>::FRAME_LENGTH,
        }
    }
}

/// What becomes of the bytes behind the one at which a frame went wrong.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum PolicyName {
    /// They are searched again: one loss costs one frame
    Rescan,
    /// They are thrown away, as the lecture's machine does: for comparison
    Discard,
}
