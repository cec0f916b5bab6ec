//! A scenario: the bytes sent and the faults of the line. Its text form is the page's address.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use anyhow::{Context as _, Error, Result, anyhow, ensure};
use framelock_description::{hex, shipped};
use framelock_receiving::Protocol;
use framelock_simulation::Payload;
use percent_encoding::{NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};

/// Names the user's own frames in the page's address.
pub(crate) const OWN: &str = "own";

/// The description that the user starts with, if the address contains none.
const EXAMPLE: &str = include_str!("../page/motor.toml");

/// All settings that determine the view. The view is the same on every computer.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Scenario {
    /// The frames on the line: the name of a shipped description, or [`OWN`].
    pub(crate) frame: String,
    /// The user's own description, in TOML.
    pub(crate) description: String,
    /// The payload of setpoint frames. Other frames are examples with random bytes.
    pub(crate) payload: Payload,
    pub(crate) frames: u32,
    /// True if the machines drop pending bytes when the line is idle.
    pub(crate) idle: bool,
    /// The user's own bytes, which are sent instead of frames.
    pub(crate) own: Vec<u8>,
    /// The user's edits of bytes, each with the byte's place on the line. An edit's place refers to the line after all
    /// earlier edits.
    pub(crate) edits: Vec<(usize, Action)>,
    /// The position: the number of steps so far. A step is a byte on the line, arrived or lost, or a time of silence.
    pub(crate) at: usize,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            frame: "bin".to_owned(),
            description: EXAMPLE.to_owned(),
            payload: Payload::Motion,
            frames: 40,
            idle: false,
            own: Vec::new(),
            edits: Vec::new(),
            at: 0,
        }
    }
}

impl Scenario {
    /// Sets keys of the address, such as `frames=9&idle=on`. An error begins with the pair of key and value.
    pub(crate) fn apply(&mut self, pairs: &str) -> Result<()> {
        for pair in pairs.split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            self.set(key, value)
                .with_context(|| pair.chars().take(60).collect::<String>())?;
        }
        Ok(())
    }

    /// Returns the protocol of the frames.
    pub(crate) fn protocol(&self) -> Result<Protocol> {
        let text = shipped(&self.frame).unwrap_or(&self.description);
        described(&self.frame, text)
    }

    /// Sets one key. The error says which value is expected, or that there is no such key.
    fn set(&mut self, key: &str, value: &str) -> Result<()> {
        match key {
            "frame" => {
                ensure!(
                    value == OWN || shipped(value).is_ok(),
                    "expected a frame's name, such as bin, crsf or own"
                );
                value.clone_into(&mut self.frame);
            }
            "description" => {
                let text = percent_decode_str(value).decode_utf8().ok();
                self.description = text
                    .filter(|text| text.len() <= 1 << 14)
                    .context("expected a description of up to 16384 bytes")?
                    .into();
            }
            "payload" => self.payload = value.parse()?,
            "frames" => self.frames = number(value, 1..=200)?,
            "idle" => {
                ensure!(matches!(value, "on" | "off"), "expected on or off");
                self.idle = value == "on";
            }
            "bytes" => {
                self.own = hex::parse(&[value])?;
                ensure!(self.own.len() <= 4_096, "expected up to 4096 bytes");
            }
            "edits" => {
                let edits = value.split('.').filter(|text| !text.is_empty());
                let edits: Option<_> = edits.map(edit).collect();
                self.edits = edits.context("expected edits such as 21d.30f04.40i41")?;
            }
            "at" => self.at = number(value, 0..=usize::MAX)?,
            _ => return Err(anyhow!("the address has no such key")),
        }
        Ok(())
    }
}

fn number<T>(text: &str, range: RangeInclusive<T>) -> Result<T>
where
    T: FromStr + PartialOrd + fmt::Display,
{
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.with_context(|| {
        format!(
            "expected a number from {} to {}",
            range.start(),
            range.end()
        )
    })
}

/// Parses a description of frames. An error begins with the line and column of the mistake.
pub(crate) fn described(name: &str, text: &str) -> Result<Protocol> {
    Protocol::described(name, text.to_owned()).map_err(|problem| {
        let (line, column) = (problem.line, problem.column);
        anyhow!("Line {line}, column {column}: {}", problem.mistake)
    })
}

impl FromStr for Scenario {
    type Err = Error;

    fn from_str(address: &str) -> Result<Self> {
        let mut scenario = Self::default();
        scenario.apply(address)?;
        Ok(scenario)
    }
}

/// Writes the frame format, and all settings that differ from their defaults.
impl fmt::Display for Scenario {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "frame={}", self.frame)?;
        let usual = Self::default();
        let pairs = self.pairs().into_iter().zip(usual.pairs());
        for ((key, value), _) in pairs.filter(|(pair, usual)| pair != usual) {
            write!(f, "&{key}={value}")?;
        }
        Ok(())
    }
}

impl Scenario {
    /// Returns all keys except `frame`, with their values.
    fn pairs(&self) -> [(&'static str, String); 7] {
        let edits = self.edits.iter();
        let edits: Vec<String> = edits.map(|(at, edit)| format!("{at}{edit}")).collect();
        let description = utf8_percent_encode(&self.description, NON_ALPHANUMERIC);
        [
            ("description", description.to_string()),
            ("payload", self.payload.to_string()),
            ("frames", self.frames.to_string()),
            ("idle", if self.idle { "on" } else { "off" }.to_owned()),
            ("bytes", hex::glued(&self.own)),
            ("edits", edits.join(".")),
            ("at", self.at.to_string()),
        ]
    }
}

/// The user's edit of a byte.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Action {
    /// Loses the byte. If the byte was already lost, restores it. If the byte was inserted, removes it.
    Drop,
    /// Inverts these bits of the byte.
    Flip(u8),
    /// Inserts this byte, which nobody sent, before the byte.
    Insert(u8),
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Drop => f.write_str("d"),
            Self::Flip(bits) => write!(f, "f{bits:02X}"),
            Self::Insert(byte) => write!(f, "i{byte:02X}"),
        }
    }
}

/// Parses a place and the edit of that byte, such as `21d`.
fn edit(text: &str) -> Option<(usize, Action)> {
    let (place, action) = text.split_at(text.find(['d', 'f', 'i'])?);
    let (action, byte) = action.split_at(1);
    let action = match (action, &hex::parse(&[byte]).ok()?[..]) {
        ("d", []) => Action::Drop,
        ("f", &[bits]) => Action::Flip(bits),
        ("i", &[byte]) => Action::Insert(byte),
        _ => return None,
    };
    Some((place.parse().ok()?, action))
}
