//! The entries of a description as serde reads them from TOML. This module checks each entry by itself; `validate`
//! checks that the entries agree with each other.

use std::ops::Range;

use framelock_formats::layout::{
    self, Algorithm, Checksum, Crc, KnownMessage, LengthField, Trailer,
};
use framelock_formats::mavlink::{ARDUPILOTMEGA, COMMON};
use serde::Deserialize;
use toml::Spanned;

use crate::checksum::Named;
use crate::field::{Class, NumberType, Type};
use crate::item::Item;
use crate::value::Decimal;
use crate::{hex, text};

/// A mistake in a description: its position in the text, in bytes, and the error message.
pub(crate) struct Problem(pub(crate) Range<usize>, pub(crate) String);

/// Creates a problem at this position of the text.
pub(crate) fn wrong<T, V>(place: &Spanned<V>, what: impl Into<String>) -> Result<T, Problem> {
    Err(Problem(place.span(), what.into()))
}

/// Returns a function that turns a message into a problem at this position of the text.
pub(crate) fn at<V, S: Into<String>>(place: &Spanned<V>) -> impl Fn(S) -> Problem {
    |what| Problem(place.span(), what.into())
}

/// Creates a problem at the beginning of the text, because something is missing.
pub(crate) fn missing<T>(what: &str) -> Result<T, Problem> {
    Err(Problem(0..0, what.into()))
}

/// The entries of a whole description, or of one of its `[[kinds]]`.
#[derive(Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FrameEntry {
    /// The name of a kind. `None` for a whole description.
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) sync: Option<Spanned<Alternatives>>,
    /// The number of bytes in every frame.
    pub(crate) length: Option<Spanned<usize>>,
    pub(crate) length_field: Option<Spanned<LengthEntry>>,
    pub(crate) shortest: Option<usize>,
    pub(crate) longest: Option<Spanned<usize>>,
    pub(crate) terminator: Option<Spanned<Terminators>>,
    pub(crate) content: Option<Spanned<Content>>,
    pub(crate) checksum: Option<Spanned<ChecksumEntry>>,
    pub(crate) messages: Option<Spanned<MessagesEntry>>,
    pub(crate) trailer: Option<Spanned<TrailerEntry>>,
    /// Whether a field beyond the end of a short frame counts as zero instead of missing.
    pub(crate) truncated_zeros: Option<bool>,
    #[serde(default)]
    pub(crate) fields: Vec<Spanned<FieldEntry>>,
    #[serde(default)]
    pub(crate) kinds: Vec<Spanned<FrameEntry>>,
    #[serde(default)]
    pub(crate) views: Vec<Spanned<ViewEntry>>,
    /// The names of shipped descriptions.
    #[serde(default)]
    pub(crate) any_of: Vec<Spanned<String>>,
}

impl FrameEntry {
    /// Adds the entries that the surrounding description has and the kind lacks. Puts the description's fields and
    /// views before the kind's own.
    pub(crate) fn within(mut self, whole: &Self) -> Self {
        let has_length = self.length.is_some() || self.length_field.is_some();
        if self.length.is_none() {
            self.shortest = self.shortest.or(whole.shortest);
            self.longest = self.longest.or_else(|| whole.longest.clone());
        }
        if !has_length {
            self.length.clone_from(&whole.length);
            self.length_field.clone_from(&whole.length_field);
        }
        self.sync = self.sync.or_else(|| whole.sync.clone());
        self.terminator = self.terminator.or_else(|| whole.terminator.clone());
        self.content = self.content.or_else(|| whole.content.clone());
        self.checksum = self.checksum.or_else(|| whole.checksum.clone());
        self.messages = self.messages.or_else(|| whole.messages.clone());
        self.trailer = self.trailer.or_else(|| whole.trailer.clone());
        self.truncated_zeros = self.truncated_zeros.or(whole.truncated_zeros);
        self.fields = [whole.fields.clone(), self.fields].concat();
        self.views = [whole.views.clone(), self.views].concat();
        self
    }

    /// Returns true if the entry itself describes frames.
    pub(crate) fn has_more(&self) -> bool {
        self.sync.is_some()
            || self.length.is_some()
            || self.length_field.is_some()
            || self.terminator.is_some()
            || self.content.is_some()
            || self.checksum.is_some()
            || !self.fields.is_empty()
    }
}

/// The values of one message.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ViewEntry {
    pub(crate) name: Spanned<String>,
    pub(crate) at: Front,
    pub(crate) bytes: Alternatives,
    pub(crate) fields: Vec<Spanned<FieldEntry>>,
}

/// Bytes in hex, with a bar between alternatives of the same length.
#[derive(Clone, Default, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Alternatives {
    /// All alternatives, concatenated.
    pub(crate) bytes: Vec<u8>,
    /// The number of bytes in each alternative.
    pub(crate) length: usize,
}

impl TryFrom<String> for Alternatives {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let each = sequences(&text)?;
        let bytes = each.concat();
        let length = bytes.len() / each.len();
        if each.iter().any(|it| it.len() != length) {
            return Err(
                "all alternatives for the bytes that a frame begins with must have the same length"
                    .into(),
            );
        }
        Ok(Self { bytes, length })
    }
}

/// Parses bytes in hex, with a bar between alternatives.
fn sequences(text: &str) -> Result<Vec<Vec<u8>>, String> {
    let each = text.split('|').map(|text| hex::parse(&[text]));
    let each = each.collect::<Result<Vec<_>, _>>()?;
    if each.iter().any(Vec::is_empty) {
        return Err("no bytes: leave the key out if there are none".into());
    }
    Ok(each)
}

/// Bytes in hex that a frame may end with, with a bar between alternatives of any lengths.
#[derive(Clone, Default, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Terminators {
    /// The first alternative, and all others that have the length of the first.
    pub(crate) first: Alternatives,
    /// Alternatives of other lengths.
    pub(crate) others: [Alternatives; 2],
}

impl TryFrom<String> for Terminators {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let mut rest = sequences(&text)?;
        let mut of_one_length = || {
            let length = rest.first().map_or(0, Vec::len);
            let all = std::mem::take(&mut rest).into_iter();
            let (same, others): (Vec<_>, _) = all.partition(|it| it.len() == length);
            rest = others;
            let bytes = same.concat();
            Alternatives { bytes, length }
        };
        let first = of_one_length();
        let others = [of_one_length(), of_one_length()];
        if rest.is_empty() {
            Ok(Self { first, others })
        } else {
            Err("terminators can have at most three different lengths".into())
        }
    }
}

impl Terminators {
    /// Returns true if a field may select one of the alternatives: all have the same length, and there are several.
    pub(crate) fn may_be_a_field(&self) -> bool {
        let [other, _] = &self.others;
        other.bytes.is_empty() && self.first.bytes.len() > self.first.length
    }
}

/// The bytes that a frame may contain, in hex: single bytes and ranges, then the forbidden bytes after `except`. An example
/// is `20-7E except 21 24`.
#[derive(Clone, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Content(pub(crate) Vec<(u8, u8)>);

impl TryFrom<String> for Content {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (all, except) = text.split_once("except").unwrap_or((&text, ""));
        let (all, except) = (ranges(all)?, ranges(except)?);
        let has = |ranges: &[(u8, u8)], byte| ranges.iter().any(|&(a, b)| (a..=b).contains(&byte));
        let bytes = (0..=u8::MAX).filter(|&byte| has(&all, byte) && !has(&except, byte));
        let mut content: Vec<(u8, u8)> = Vec::new();
        for byte in bytes {
            match content.last_mut() {
                Some((_, last)) if *last + 1 == byte => *last = byte,
                _ => content.push((byte, byte)),
            }
        }
        if content.is_empty() {
            return Err("no bytes: leave the key out if a frame may contain any".into());
        }
        // Put the widest range first, because most bytes are in that range.
        content.sort_by_key(|(first, last)| first.abs_diff(*last));
        content.reverse();
        Ok(Self(content))
    }
}

/// Parses single bytes and ranges of bytes, in hex.
fn ranges(text: &str) -> Result<Vec<(u8, u8)>, String> {
    let words = text.split_whitespace().map(|word| {
        let (first, last) = word.split_once('-').unwrap_or((word, word));
        match (&*hex::parse(&[first])?, &*hex::parse(&[last])?) {
            (&[first], &[last]) if first <= last => Ok((first, last)),
            _ => Err(format!(
                "'{}' is not a byte, or a range such as 20-7E",
                text::quoted(word)
            )),
        }
    });
    words.collect()
}

/// A position that is counted from the front.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "i16")]
pub(crate) struct Front(pub(crate) usize);

impl TryFrom<i16> for Front {
    type Error = &'static str;

    fn try_from(at: i16) -> Result<Self, Self::Error> {
        usize::try_from(at).map(Self).map_err(
            |_| "this is needed before the frame's end is known: count it from the front, 0 or more",
        )
    }
}

/// An unsigned number of up to four bytes.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Unsigned(pub(crate) NumberType);

impl TryFrom<String> for Unsigned {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let number = NumberType::try_from(name)?;
        Self::of(number).ok_or_else(|| {
            "this must be an unsigned number of up to four bytes: u8, u16le, u16be, u24le and so on".into()
        })
    }
}

impl Unsigned {
    pub(crate) fn of(number: NumberType) -> Option<Self> {
        let is_unsigned = number.class == Class::Unsigned && number.bytes <= 4;
        is_unsigned.then_some(Self(number))
    }

    /// Returns the layout's `Number` that has this type and begins at this position in the frame.
    pub(crate) fn at(self, at: usize) -> layout::Number {
        layout::Number::new(at, self.0.bytes, self.0.order)
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LengthEntry {
    at: Front,
    #[serde(rename = "type")]
    number: Unsigned,
    mask: Option<u32>,
    factor: Option<u32>,
    #[serde(default)]
    plus: i32,
}

impl LengthEntry {
    pub(crate) fn field(&self) -> LengthField {
        LengthField {
            number: self.number.at(self.at.0),
            mask: self.mask.unwrap_or(u32::MAX),
            factor: self.factor.unwrap_or(1),
            plus: self.plus,
        }
    }
}

/// A checksum in a frame.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChecksumEntry {
    name: Option<Named>,
    width: Option<u32>,
    polynomial: Option<u32>,
    initial: Option<u32>,
    reflected: Option<bool>,
    xor: Option<u32>,
    #[serde(rename = "type")]
    stored: Stored,
    pub(crate) at: i16,
    #[serde(default)]
    from: i16,
    to: Option<i16>,
}

impl ChecksumEntry {
    /// Returns the checksum, or the reason why the entry does not name an algorithm.
    pub(crate) fn checksum(&self) -> Result<Checksum<'static>, &'static str> {
        Ok(Checksum {
            algorithm: self.algorithm()?,
            bytes: self.stored.bytes,
            encoding: self.stored.encoding,
            at: self.at,
            from: self.from,
            to: self.to.unwrap_or(self.at.saturating_sub(1)),
        })
    }

    fn algorithm(&self) -> Result<Algorithm<'static>, &'static str> {
        let has_parameters =
            self.initial.is_some() || self.reflected.is_some() || self.xor.is_some();
        let (width, polynomial) = match (self.name, self.width, self.polynomial) {
            (Some(Named(algorithm)), None, None) if !has_parameters => return Ok(algorithm),
            (None, Some(width), Some(polynomial)) => (width, polynomial),
            _ => {
                return Err(
                    "give a name, or a CRC's width and polynomial; then initial, reflected and xor",
                );
            }
        };
        let reflected = self.reflected.unwrap_or_default();
        Ok(Algorithm::Crc(Crc {
            initial: self.initial.unwrap_or_default(),
            reflected_in: reflected,
            reflected_out: reflected,
            xor_out: self.xor.unwrap_or_default(),
            ..Crc::new(width, polynomial)
        }))
    }
}

/// How a checksum is encoded in the frame.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Stored {
    /// The number of bytes of the checksum in the frame.
    pub(crate) bytes: usize,
    pub(crate) encoding: layout::Encoding,
}

impl TryFrom<String> for Stored {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        if let Some(bytes) = ["hex8", "hex16", "hex24", "hex32"]
            .iter()
            .position(|hex| *hex == name)
        {
            let (bytes, encoding) = (bytes + 1, layout::Encoding::Hex);
            return Ok(Self { bytes, encoding });
        }
        let Unsigned(number) = name.try_into()?;
        Ok(Self {
            bytes: number.bytes,
            encoding: match number.order {
                layout::ByteOrder::Little => layout::Encoding::Little,
                layout::ByteOrder::Big => layout::Encoding::Big,
            },
        })
    }
}

/// The entry that lists the known messages.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MessagesEntry {
    at: Front,
    #[serde(rename = "type")]
    number: Unsigned,
    pub(crate) known: KnownMessages,
}

#[derive(Clone, Deserialize)]
#[serde(
    untagged,
    expecting = "known messages are \"common\", \"ardupilotmega\", rows of one to three numbers: [[number, extra byte, \
                 largest value of the length field]], or a list of both"
)]
pub(crate) enum KnownMessages {
    Dialect(Dialect),
    List(Vec<KnownEntry>),
}

/// A dialect, or a row for one message.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(crate) enum KnownEntry {
    Dialect(Dialect),
    Row(Row),
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Dialect {
    Common,
    Ardupilotmega,
}

impl Dialect {
    pub(crate) fn messages(self) -> &'static [KnownMessage] {
        match self {
            Self::Common => COMMON,
            Self::Ardupilotmega => ARDUPILOTMEGA,
        }
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(crate) enum Row {
    Number([u32; 1]),
    Extra(u32, u8),
    Most(u32, u8, u16),
}

impl Row {
    pub(crate) fn message(self) -> KnownMessage {
        match self {
            Self::Number([number]) => KnownMessage::new(number),
            Self::Extra(number, extra) => Self::Most(number, extra, u16::MAX).message(),
            Self::Most(number, extra, longest_payload) => KnownMessage {
                number,
                longest_payload,
                extra: Some(extra),
            },
        }
    }
}

impl MessagesEntry {
    pub(crate) fn number(&self) -> layout::Number {
        self.number.at(self.at.0)
    }
}

/// The entry of a trailer: bytes that follow some frames.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TrailerEntry {
    /// The name of the trailer.
    pub(crate) name: Spanned<String>,
    at: Front,
    mask: u8,
    bytes: usize,
}

impl TrailerEntry {
    pub(crate) fn trailer(&self) -> Trailer {
        Trailer {
            at: self.at.0,
            mask: self.mask,
            bytes: self.bytes,
        }
    }
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FieldEntry {
    pub(crate) name: Spanned<String>,
    pub(crate) at: Spanned<i16>,
    #[serde(rename = "type")]
    pub(crate) kind: Option<Type>,
    pub(crate) bits: Option<usize>,
    #[serde(default)]
    pub(crate) bit: u16,
    pub(crate) count: Option<usize>,
    pub(crate) mask: Option<Spanned<u64>>,
    pub(crate) value: Option<Spanned<Values>>,
    pub(crate) scale: Option<Spanned<Decimal>>,
    pub(crate) offset: Option<Spanned<Decimal>>,
    pub(crate) unit: Option<Spanned<String>>,
    pub(crate) item: Option<Spanned<Item>>,
}

impl FieldEntry {
    /// Returns true if the field takes the rest of the frame.
    pub(crate) fn takes_rest(&self) -> bool {
        self.count.is_none() && matches!(self.kind, Some(Type::Bytes | Type::Text))
    }
}

/// The constant value of a field, or the list of its possible values.
#[derive(Clone, Deserialize)]
#[serde(untagged, expecting = "a value is a whole number, or a list of them")]
pub(crate) enum Values {
    One(i64),
    OneOf(Vec<u32>),
}
