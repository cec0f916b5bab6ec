//! The option `--frame`, which selects the frames on the line.

use std::ffi::OsStr;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use framelock_description::SHIPPED;
use framelock_receiving::Protocol;

use framelock_description::text::harmless;

/// Returns the shipped description with this name, or reads the description in the file with this name.
#[derive(Clone)]
pub(crate) struct ProtocolParser;

impl TypedValueParser for ProtocolParser {
    type Value = Protocol;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        name: &OsStr,
    ) -> Result<Protocol, clap::Error> {
        let parser = StringValueParser::new();
        let parser = parser.try_map(|name| Protocol::named(&name).map_err(|why| harmless(&why.to_string())));
        parser.parse_ref(command, argument, name)
    }

    /// Returns the names that completions offer.
    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(SHIPPED.iter().map(|(name, _)| name.into())))
    }
}
