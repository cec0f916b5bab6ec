//! Frame formats and policies, by the names that the command line gives them.

use clap::ValueEnum;
use framelock::{Bin, BinCrc8, Format, Setpoint};

/// A frame format.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum FrameName {
    /// 'A' 'B' reserved pitch roll yaw CR
    Bin,
    /// 'A' 'B' reserved pitch roll yaw crc CR
    BinCrc8,
}

impl FrameName {
    /// What a receiver waits for at each place of a frame, by the lecture's names.
    pub(crate) const fn states(self) -> &'static [&'static str] {
        match self {
            Self::Bin => &["A", "B", "1", "2", "3", "4", "CR"],
            Self::BinCrc8 => &["A", "B", "1", "2", "3", "4", "crc", "CR"],
        }
    }

    /// Bytes in a frame.
    pub(crate) const fn length(self) -> usize {
        self.states().len()
    }

    /// The frame of a setpoint.
    pub(crate) fn encode(self, setpoint: Setpoint) -> Vec<u8> {
        match self {
            Self::Bin => Bin::encode(setpoint).to_vec(),
            Self::BinCrc8 => BinCrc8::encode(setpoint).to_vec(),
        }
    }
}

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
