//! Collects every text that the command line makes from a stream, for tests and the fuzzer. The tests check that no
//! sender can control the user's terminal.

use anyhow::{Error, Result};
use framelock_description::SHIPPED;
use framelock_receiving::Protocol;

use crate::input::{Input, Spelling, for_each_arrival};
use crate::output::message;
use crate::rows::{InputFormat, rows};
use crate::{decode, trace};

/// Makes all texts that the command line prints for a stream of one protocol.
pub struct TextOutputs(Protocol);

impl TextOutputs {
    /// Returns the outputs for the frames of `description` and for each shipped description.
    ///
    /// # Errors
    /// Returns an error if the description is invalid.
    pub fn all(description: &str) -> Result<Vec<Self>> {
        let own = [("described", description)];
        let all = own.iter().chain(SHIPPED);
        let frames = all.map(|(name, text)| Protocol::described(name, (*text).to_owned()));
        let all = frames.map(|frame| Ok(Self(frame.map_err(Error::msg)?)));
        all.collect()
    }

    /// Returns the texts that `decode` and `trace` write for the stream, and the error messages that appear if the
    /// stream is read as hex or as rows of values.
    ///
    /// # Errors
    /// Returns an error if a text cannot be written.
    pub fn of(&self, stream: &[u8]) -> Result<Vec<String>> {
        let mut texts = decode::texts(&self.0, stream)?;
        texts.append(&mut trace::texts(&self.0, stream)?);
        let input = || Input::new("the stream", stream);
        let hex = for_each_arrival(input().spelled(Spelling::Hex), |_| Ok(()));
        let rows = rows(input(), InputFormat::Auto, &self.0, true);
        let rows = rows.and_then(|mut rows| rows.try_for_each(|row| row.map(drop)));
        let errors = [hex, rows].into_iter().filter_map(Result::err);
        let told = errors.map(|error| Ok(message(&format!("{error:#}"))));
        let texts = texts.into_iter().map(|text| Ok(String::from_utf8(text)?));
        texts.chain(told).collect()
    }
}
