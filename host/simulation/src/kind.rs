//! The kinds of stations that there are.

use serde::Serialize;

use crate::payload::FrameFormat;

/// What a receiver does with the bytes behind the one at which a frame went wrong.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Policy {
    /// It throws them away, as the lecture's machine does.
    Discard,
    /// It searches them again, as the receiver does.
    #[default]
    Rescan,
}

/// What is at the end of the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Kind {
    /// The machine.
    pub policy: Policy,
    /// Whether a pause longer than the idle gap drops the current frame.
    pub has_idle_gap: bool,
}

impl Kind {
    /// All that receive the format: of BIN the lecture's machine, then the receiver; each without an
    /// idle-gap rule and then with one.
    #[must_use]
    pub fn of(format: FrameFormat) -> Vec<Self> {
        let both = |policy| {
            [false, true].map(|has_idle_gap| Self {
                policy,
                has_idle_gap,
            })
        };
        match format {
            FrameFormat::Bin => [both(Policy::Discard), both(Policy::Rescan)].concat(),
            FrameFormat::BinCrc8 => both(Policy::Rescan).to_vec(),
        }
    }
}
