//! Frames by the names that the command line gives them: shipped, or described in a file.

mod written;

use std::ffi::OsStr;
use std::fmt;
use std::path::Path;

use clap::ValueEnum;
use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Encode, Format as _};
use framelock_description::text::harmless;
use framelock_description::{Description, SHIPPED, read, shipped};
use framelock_simulation::FrameFormat;

pub(crate) use written::Place;

/// What a receiver of BIN waits for at each place of a frame, by the lecture's names.
pub(crate) const LECTURE_STATES: [&str; 7] = ["A", "B", "1", "2", "3", "4", "CR"];

/// The same of BIN-CRC8.
const CRC8_STATES: [&str; 8] = ["A", "B", "1", "2", "3", "4", "crc", "CR"];

/// A frame format.
#[derive(Clone)]
pub(crate) struct Frame {
    pub(crate) name: String,
    /// If its frames bring setpoints: then the small receiver takes them.
    pub(crate) setpoints: Option<FrameFormat>,
    pub(crate) description: Description,
    /// The description's text.
    pub(crate) text: String,
    /// How each kind of frames is written.
    written: Vec<written::Kind>,
    /// Whether people are shown numbers in hex.
    pub(crate) is_hex: bool,
}

impl Frame {
    /// The format of that name, or that the file of that name describes.
    pub(crate) fn named(name: &str) -> Result<Self, String> {
        let text = match shipped(name) {
            Some(text) => text.to_owned(),
            None if !Path::new(name).exists() => return Err(no_such_frame()),
            None => read(Path::new(name))?,
        };
        Self::described(name, text)
    }

    /// The format that this text describes.
    pub(crate) fn described(name: &str, text: String) -> Result<Self, String> {
        let description = Description::parse(name, &text)?;
        Ok(Self {
            name: name.to_owned(),
            setpoints: FrameFormat::from_str(name, false).ok(),
            written: written::kinds(&description),
            description,
            text,
            is_hex: false,
        })
    }

    /// Bytes in the longest of its frames.
    pub(crate) fn longest(&self) -> usize {
        self.description.format().longest()
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

/// Reads the option `--frame`.
#[derive(Clone)]
pub(crate) struct FrameParser;

impl TypedValueParser for FrameParser {
    type Value = Frame;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        name: &OsStr,
    ) -> Result<Frame, clap::Error> {
        let parser = StringValueParser::new();
        let parser = parser.try_map(|name| Frame::named(&name).map_err(|why| harmless(&why)));
        parser.parse_ref(command, argument, name)
    }

    /// What completions offer.
    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(SHIPPED.iter().map(|(name, _)| name.into())))
    }
}

fn no_such_frame() -> String {
    let names: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
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
