//! The entries of a description, as written in its text. Entries have spans, because errors name their positions.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;

use crate::messages::Known;
use crate::notation::Notation;
use crate::packets::Packets;
use crate::problem::{Located, Mistake};
use crate::read_field::{Missing, Values};
use crate::value::Decimal;

pub(crate) type Text = Spanned<String>;

/// The entries of a description, or of one of its kinds.
#[derive(Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Entries {
    pub(crate) any_of: Vec<Text>,
    pub(crate) kinds: Vec<Spanned<Entries>>,
    pub(crate) sync: Option<Text>,
    pub(crate) length: Option<Spanned<usize>>,
    pub(crate) length_field: Option<Spanned<LengthEntry>>,
    pub(crate) shortest: Option<Spanned<usize>>,
    pub(crate) longest: Option<Spanned<usize>>,
    pub(crate) terminator: Option<Text>,
    pub(crate) behind: Option<Spanned<usize>>,
    pub(crate) ends: Option<Spanned<Ends>>,
    pub(crate) packets: Option<Spanned<Packets>>,
    pub(crate) content: Option<Text>,
    pub(crate) checksum: Option<Spanned<ChecksumEntry>>,
    pub(crate) messages: Option<Spanned<MessagesEntry>>,
    pub(crate) trailer: Option<Spanned<TrailerEntry>>,
    pub(crate) truncated_zeros: Option<bool>,
    pub(crate) fields: Vec<Spanned<FieldEntry>>,
    pub(crate) text: Option<Spanned<Patterns>>,
    pub(crate) views: Vec<Spanned<ViewEntry>>,
    pub(crate) name: Option<Text>,
}

/// The pattern of a text, or several patterns.
#[derive(Clone, Deserialize)]
#[serde(untagged, expecting = "a text is a pattern, or a list of patterns")]
pub(crate) enum Patterns {
    One(String),
    Several(Vec<String>),
}

/// The end of frames that have neither a length nor a terminator.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Ends {
    Silence,
}

/// The encoding of the bytes that a checksum covers. The checksum is computed from the decoded bytes.
#[derive(Clone, Copy, Deserialize)]
pub(crate) enum Over {
    #[serde(rename = "hex digits")]
    HexDigits,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LengthEntry {
    pub(crate) at: Spanned<i16>,
    pub(crate) r#type: Text,
    pub(crate) mask: Option<u32>,
    pub(crate) factor: Option<u32>,
    #[serde(default)]
    pub(crate) plus: i32,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChecksumEntry {
    pub(crate) name: Option<Text>,
    pub(crate) width: Option<u32>,
    pub(crate) polynomial: Option<u32>,
    pub(crate) initial: Option<u32>,
    pub(crate) reflected: Option<bool>,
    pub(crate) xor: Option<u32>,
    pub(crate) r#type: Text,
    pub(crate) at: i16,
    #[serde(default)]
    pub(crate) from: i16,
    pub(crate) to: Option<i16>,
    pub(crate) over: Option<Over>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MessagesEntry {
    pub(crate) at: Spanned<i16>,
    pub(crate) r#type: Text,
    pub(crate) known: Known,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TrailerEntry {
    pub(crate) name: Text,
    pub(crate) at: Spanned<i16>,
    pub(crate) mask: u8,
    pub(crate) bytes: usize,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FieldEntry {
    pub(crate) name: Text,
    pub(crate) at: Option<Spanned<i16>>,
    pub(crate) r#type: Option<Text>,
    pub(crate) bits: Option<usize>,
    pub(crate) bit: Option<u16>,
    pub(crate) notation: Option<Spanned<Notation>>,
    pub(crate) decimals: Option<Spanned<u32>>,
    pub(crate) count: Option<Spanned<usize>>,
    pub(crate) mask: Option<Spanned<u64>>,
    pub(crate) value: Option<Spanned<Values>>,
    pub(crate) scale: Option<Spanned<Decimal>>,
    pub(crate) offset: Option<Spanned<Decimal>>,
    pub(crate) unit: Option<Text>,
    pub(crate) names: Option<Spanned<BTreeMap<String, String>>>,
    pub(crate) missing: Option<Spanned<Missing>>,
    pub(crate) padding: Option<Text>,
    pub(crate) item: Option<Spanned<IgnoredAny>>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ViewEntry {
    pub(crate) name: String,
    pub(crate) at: Option<Spanned<i16>>,
    pub(crate) bytes: Option<Text>,
    pub(crate) text: Option<Spanned<Patterns>>,
    #[serde(default)]
    pub(crate) fields: Vec<Spanned<FieldEntry>>,
}

impl Entries {
    /// Returns whether the entries have any key except `any_of`, `kinds` and `name`.
    pub(crate) fn has_parts(&self) -> bool {
        let texts = [&self.sync, &self.terminator, &self.content];
        let numbers = [&self.length, &self.shortest, &self.longest, &self.behind];
        let others = [
            self.length_field.is_some(),
            self.ends.is_some(),
            self.packets.is_some(),
            self.checksum.is_some(),
            self.messages.is_some(),
            self.trailer.is_some(),
            self.truncated_zeros.is_some(),
            self.text.is_some(),
            !self.fields.is_empty(),
            !self.views.is_empty(),
        ];
        let has_text = texts.into_iter().any(Option::is_some);
        let has_number = numbers.into_iter().any(Option::is_some);
        has_text || has_number || others.contains(&true)
    }

    /// Adds the entries that the surrounding description has and the kind lacks. If the kind has `length`,
    /// `length_field` or `ends`, does not add any of these three. If the kind has `length`, does not add `shortest` and
    /// `longest`. The kind's fields and views follow those of the surrounding description.
    pub(crate) fn within(self, mut whole: Self) -> Self {
        if self.length.is_some() || self.length_field.is_some() || self.ends.is_some() {
            (whole.length, whole.length_field, whole.ends) = (None, None, None);
        }
        if self.length.is_some() {
            (whole.shortest, whole.longest) = (None, None);
        }
        Self {
            sync: self.sync.or(whole.sync),
            length: self.length.or(whole.length),
            length_field: self.length_field.or(whole.length_field),
            shortest: self.shortest.or(whole.shortest),
            longest: self.longest.or(whole.longest),
            terminator: self.terminator.or(whole.terminator),
            behind: self.behind.or(whole.behind),
            ends: self.ends.or(whole.ends),
            packets: self.packets.or(whole.packets),
            content: self.content.or(whole.content),
            checksum: self.checksum.or(whole.checksum),
            messages: self.messages.or(whole.messages),
            trailer: self.trailer.or(whole.trailer),
            truncated_zeros: self.truncated_zeros.or(whole.truncated_zeros),
            text: self.text.or(whole.text),
            fields: [whole.fields, self.fields].concat(),
            views: [whole.views, self.views].concat(),
            ..self
        }
    }
}

/// Returns the position of an entry, or the beginning of the text if there is no such entry.
pub(crate) fn span<T>(entry: Option<&Spanned<T>>) -> Range<usize> {
    entry.map_or(0..0, Spanned::span)
}

/// Parses the text of an entry. An error has the position of the entry's text.
pub(crate) fn parsed<T>(
    text: &Text,
    parse: impl Fn(&str) -> Result<T, Mistake>,
) -> Result<T, Located> {
    parse(text.get_ref()).map_err(|mistake| Located::new(text.span(), mistake))
}

/// Parses the text of an entry, if there is one.
pub(crate) fn parsed_if_any<T>(
    text: Option<&Text>,
    parse: impl Fn(&str) -> Result<T, Mistake>,
) -> Result<Option<T>, Located> {
    text.map(|text| parsed(text, parse)).transpose()
}
