//! Frames by the names that the command line gives them: built in, or described in a file.

mod checksum;
mod described;
mod description;
mod field;
mod written;

use std::fmt;
use std::path::Path;

use clap::ValueEnum;
use framelock::Encode;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock_simulation::FrameFormat;

pub(crate) use described::{Column, Described, LONGEST, quote};
pub(crate) use written::Place;

/// What a receiver of BIN waits for at each place of a frame, by the lecture's names.
pub(crate) const LECTURE_STATES: [&str; 7] = ["A", "B", "1", "2", "3", "4", "CR"];

/// The same of BIN-CRC8.
const CRC8_STATES: [&str; 8] = ["A", "B", "1", "2", "3", "4", "crc", "CR"];

/// The descriptions that are built in, by name.
macro_rules! built_in {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../frames/", $name, ".toml")))),*]
    };
}

const BUILT_IN: &[(&str, &str)] =
    built_in!("bin" "bin-crc8" "sbus" "ibus" "crsf" "ubx" "mavlink2" "six-axes");

/// A frame format.
#[derive(Clone)]
pub(crate) struct Frame {
    pub(crate) name: String,
    /// If its frames bring setpoints: then the small receiver takes them.
    pub(crate) setpoints: Option<FrameFormat>,
    pub(crate) described: Described,
    /// The names of a frame's values.
    pub(crate) columns: Vec<Column>,
    /// The description.
    pub(crate) text: String,
}

impl Frame {
    /// The format of that name, or that the file of that name describes.
    pub(crate) fn named(name: &str) -> Result<Self, String> {
        let built_in = BUILT_IN.iter().find(|(built_in, _)| *built_in == name);
        let text = match built_in {
            Some((_, text)) => (*text).to_owned(),
            None if !Path::new(name).exists() => return Err(no_such_frame()),
            None => std::fs::read_to_string(name).map_err(|error| {
                format!("cannot read {name}: {error}; a description is a TOML file")
            })?,
        };
        let described = description::parse(name, &text)?;
        Ok(Self {
            name: name.to_owned(),
            setpoints: FrameFormat::from_str(name, false).ok(),
            columns: described.columns(),
            described,
            text,
        })
    }

    /// Whether its frames bring pitch, roll and yaw, for which there is a failsafe, and motions.
    pub(crate) fn has_setpoints(&self) -> bool {
        self.setpoints.is_some()
    }

    /// What its receiver waits for at each place of a frame of setpoints, by the lecture's names.
    pub(crate) fn states(&self) -> &'static [&'static str] {
        match self.setpoints {
            Some(FrameFormat::Bin) => &LECTURE_STATES,
            Some(FrameFormat::BinCrc8) => &CRC8_STATES,
            None => &[],
        }
    }

    /// The frame of a setpoint.
    pub(crate) fn encode_setpoint(&self, setpoint: Setpoint) -> Vec<u8> {
        match self.setpoints {
            Some(FrameFormat::BinCrc8) => BinCrc8::encode(setpoint).to_vec(),
            _ => Bin::encode(setpoint).to_vec(),
        }
    }

    /// The setpoint in a frame, if it has one.
    pub(crate) fn setpoint(&self, frame: &[u8]) -> Option<Setpoint> {
        match frame {
            &[_, _, _, pitch, roll, yaw, ..] if self.has_setpoints() => {
                Some(Setpoint { pitch, roll, yaw })
            }
            _ => None,
        }
    }
}

fn no_such_frame() -> String {
    let names: Vec<&str> = BUILT_IN.iter().map(|(name, _)| *name).collect();
    format!(
        "there is neither such a frame nor such a file: the frames are {}; a file describes another, \
         see docs/own-frame.md",
        names.join(", ")
    )
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

#[cfg(test)]
mod tests;
