//! The frames on a line: a shipped description, or a user's own.

use std::fmt;
use std::path::Path;

use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Encode, Format as _};
use framelock_description::{Description, Problem, ReadError, UnknownName, read, shipped};
use thiserror::Error;

/// A format of frames that carry setpoints. The core has a receiver for each of these formats.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum FrameFormat {
    /// 'A' 'B' reserved pitch roll yaw CR
    Bin,
    /// 'A' 'B' reserved pitch roll yaw crc CR
    BinCrc8,
}

impl FrameFormat {
    /// Returns the format of the shipped description with this name.
    fn named(name: &str) -> Option<Self> {
        match name {
            "bin" => Some(Self::Bin),
            "bin-crc8" => Some(Self::BinCrc8),
            _ => None,
        }
    }

    /// Returns the frame of a setpoint.
    pub(crate) fn encode(self, setpoint: Setpoint) -> Vec<u8> {
        match self {
            Self::Bin => Bin::encode(setpoint).to_vec(),
            Self::BinCrc8 => BinCrc8::encode(setpoint).to_vec(),
        }
    }
}

/// The reason why a name does not give a description.
#[derive(Debug, Error)]
pub enum ProtocolError {
    /// There is neither a shipped description nor a file with this name.
    #[error("{0}; for another frame, name a file that describes it (see docs/own-frame.md)")]
    Unknown(UnknownName),
    /// The file cannot be read as a description.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The description has a mistake.
    #[error(transparent)]
    Description(#[from] Problem),
}

/// The frames on a line: their name, and their description.
#[derive(Clone, Debug)]
pub struct Protocol {
    /// The name of a shipped description, or of the file that has the description.
    pub name: String,
    /// The description's text, in TOML.
    pub text: String,
    /// The parsed description.
    pub description: Description,
    /// The format, if the frames carry setpoints. Only frames with setpoints work with the failsafe and the motions.
    pub(crate) setpoints: Option<FrameFormat>,
}

impl Protocol {
    /// Looks up a shipped description with this name, or reads the file with this name.
    ///
    /// # Errors
    /// Returns an error if there is no such description or file, the file cannot be read, or it does not describe
    /// frames.
    pub fn named(name: &str) -> Result<Self, ProtocolError> {
        let text = match shipped(name) {
            Ok(text) => text.to_owned(),
            Err(_) if Path::new(name).exists() => read(Path::new(name))?,
            Err(unknown) => return Err(ProtocolError::Unknown(unknown)),
        };
        Ok(Self::described(name, text)?)
    }

    /// Parses a description.
    ///
    /// # Errors
    /// Returns an error if the text is not a valid description.
    pub fn described(name: &str, text: String) -> Result<Self, Problem> {
        Ok(Self {
            name: name.to_owned(),
            setpoints: FrameFormat::named(name),
            description: Description::parse(name, &text)?,
            text,
        })
    }

    /// Returns the number of bytes that a receiver must be able to hold: the number of bytes in the longest frame, plus
    /// 1 if only silence or a packet's delimiter ends this frame.
    #[must_use]
    pub fn longest(&self) -> usize {
        self.description.format().longest()
    }

    /// Returns whether the frames carry pitch, roll and yaw.
    #[must_use]
    #[inline]
    pub fn has_setpoints(&self) -> bool {
        self.setpoints.is_some()
    }

    /// Returns the frame of a setpoint, or a BIN frame if this protocol's frames carry no setpoints.
    #[must_use]
    pub fn encode_setpoint(&self, setpoint: Setpoint) -> Vec<u8> {
        self.setpoints.unwrap_or(FrameFormat::Bin).encode(setpoint)
    }

    /// Returns the setpoint in a frame. Returns `None` if the frames carry no setpoints, or if there are too few bytes.
    #[must_use]
    pub fn setpoint(&self, frame: &[u8]) -> Option<Setpoint> {
        match frame {
            &[_, _, _, pitch, roll, yaw, ..] if self.has_setpoints() => {
                Some(Setpoint { pitch, roll, yaw })
            }
            _ => None,
        }
    }
}

impl fmt::Display for Protocol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}
