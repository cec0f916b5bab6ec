//! Descriptions of frames: TOML, read and checked.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use serde::Deserialize;
use toml::Spanned;

use super::described::{Check, Described, Format, LONGEST, Length, LengthField};
use super::field::{Field, Kind, Place};
use crate::hex;

/// Names that rows have besides the fields.
const TAKEN: [&str; 3] = ["offset", "length", "time"];

/// A description, as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    #[serde(default)]
    sync: Syncs,
    /// Bytes in every frame.
    length: Option<Spanned<usize>>,
    length_field: Option<LengthField>,
    shortest: Option<usize>,
    longest: Option<Spanned<usize>>,
    terminator: Option<Spanned<Bytes>>,
    checksum: Option<Spanned<Check>>,
    #[serde(default)]
    fields: Vec<Spanned<FieldEntry>>,
}

/// What a frame may begin with: bytes in hex, and between alternatives a bar.
#[derive(Clone, Default, Deserialize)]
#[serde(try_from = "String")]
struct Syncs(Vec<Vec<u8>>);

impl TryFrom<String> for Syncs {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let each = text.split('|').map(|text| Bytes::try_from(text.to_owned()));
        let each = each.map(|bytes| bytes.map(|Bytes(bytes)| bytes));
        let syncs = each.collect::<Result<Vec<_>, _>>()?;
        let lengths: HashSet<usize> = syncs.iter().map(Vec::len).collect();
        if lengths.len() > 1 {
            return Err("all that a frame may begin with must have the same length".into());
        }
        Ok(Self(syncs))
    }
}

/// Bytes in hex, at least one.
#[derive(Deserialize)]
#[serde(try_from = "String")]
struct Bytes(Vec<u8>);

impl TryFrom<String> for Bytes {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let bytes = hex::parse(&[text])?;
        if bytes.is_empty() {
            return Err("no bytes: leave the key out if there are none".into());
        }
        Ok(Self(bytes))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FieldEntry {
    name: Spanned<String>,
    at: Spanned<Place>,
    #[serde(rename = "type")]
    kind: Option<Kind>,
    bits: Option<usize>,
    #[serde(default)]
    bit: u16,
    count: Option<usize>,
    value: Option<Spanned<i64>>,
}

/// What is wrong, and where in the text.
struct Problem(Range<usize>, String);

/// That something at a place of the text is wrong.
fn wrong<T, V>(place: &Spanned<V>, what: impl Into<String>) -> Result<T, Problem> {
    Err(Problem(place.span(), what.into()))
}

/// The format that a description has; `name` is what it is called in errors.
pub(super) fn parse(name: &str, text: &str) -> Result<Described, String> {
    let read = toml::from_str::<Description>(text)
        .map_err(|error| Problem(error.span().unwrap_or_default(), error.message().to_owned()));
    let described = read.and_then(Description::described);
    described.map_err(|Problem(place, what)| {
        let before = text.get(..place.start).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        format!("{name}:{line}:{column}: {what}")
    })
}

/// That something is missing.
fn missing<T>(what: &str) -> Result<T, Problem> {
    Err(Problem(0..0, what.into()))
}

impl Description {
    fn described(self) -> Result<Described, Problem> {
        let Syncs(syncs) = &self.sync;
        let sync = syncs.first().map_or(0, Vec::len);
        let terminator = self.terminator.as_ref();
        let terminator = terminator.map_or(&[][..], |bytes| &bytes.get_ref().0);
        let check = self.checksum.as_ref().map(Spanned::get_ref);
        if sync + terminator.len() == 0 && check.is_none() {
            return missing("nothing tells a frame from noise: give sync, checksum or terminator");
        }
        let length = self.length()?;
        let fields = self.fields.iter().map(field);
        let mut fields = fields.collect::<Result<Vec<_>, _>>()?;

        // What is there before the length is known, what is counted from the end, and both at least.
        let mut header = sync;
        if let Length::Fixed(_) | Length::Field(_) = length {
            header = header.max(1);
        }
        let mut least = 0;
        if let Length::Field(field) = &length {
            header = header.max(field.at.0 + field.number.length);
            least = usize::try_from(field.plus).unwrap_or_default();
        }
        if let Some(extra) = check.and_then(|check| check.extra.as_ref()) {
            header = header.max(extra.at.0 + extra.number.length);
        }
        let places = fields.iter().map(|field| field.at);
        let places = places.chain(check.map(|check| check.at));
        let from_end = places.filter(|place| place.is_from_end());
        let trailer = from_end
            .map(Place::distance)
            .fold(terminator.len(), usize::max);
        for (field, entry) in fields.iter_mut().zip(&self.fields) {
            // What takes the rest of a frame of one length has one length as well.
            if let (Length::Fixed(length), None) = (&length, field.length()) {
                field.count = length.checked_sub(field.at.distance() + trailer);
                if field.count.is_none_or(|left| left == 0) {
                    return wrong(entry, "nothing of the frame is left for this field");
                }
            }
            let is_placed = field.at.is_from_end() || field.constant.is_some();
            if !is_placed && !matches!(length, Length::Fixed(_)) {
                field.margin = trailer;
            }
        }
        // In frames of one length what is counted from the end has a place like any other.
        let end = match length {
            Length::Fixed(_) => terminator.len(),
            _ => trailer,
        };
        let (shortest, longest) = self.bounds(&length, least.max(header + end))?;
        let mut format = Format {
            syncs: syncs.clone(),
            length,
            header,
            shortest,
            longest,
            trailer,
            terminator: terminator.to_vec(),
            check: None,
            fields,
        };
        self.check_places(&format, shortest)?;
        self.check_places(&format, longest)?;
        let place = self.fields.first().map_or(0..0, Spanned::span);
        format.check = self.checksum.map(Spanned::into_inner);
        let described = Described(Arc::new(format));
        let mut names = HashSet::new();
        for column in described.columns() {
            if let Some(name) = names.replace(column.name) {
                return Err(Problem(place, format!("two values are called {name}")));
            }
        }
        Ok(described)
    }

    fn length(&self) -> Result<Length, Problem> {
        match (&self.length, self.length_field, &self.terminator) {
            (Some(length), Some(_), _) => wrong(
                length,
                "length is for frames that all have it, length_field for frames that say theirs: \
                 leave one out",
            ),
            (Some(length), None, _) => Ok(Length::Fixed(*length.get_ref())),
            (None, Some(field), _) => Ok(Length::Field(field)),
            (None, None, Some(_)) => Ok(Length::Terminator),
            (None, None, None) => {
                missing("nothing ends a frame: give length, length_field or terminator")
            }
        }
    }

    /// Bytes in the shortest frame and in the longest; `least` are the parts that each has.
    fn bounds(&self, length: &Length, least: usize) -> Result<(usize, usize), Problem> {
        let has_bounds = self.shortest.is_some() || self.longest.is_some();
        let (place, shortest, longest) = match (&self.length, &self.longest) {
            (Some(place), _) if has_bounds => {
                return wrong(place, "length says it all: leave shortest and longest out");
            }
            (Some(length), _) => (length, *length.get_ref(), *length.get_ref()),
            (None, Some(longest)) => (longest, self.shortest.unwrap_or(least), *longest.get_ref()),
            (None, None) => {
                return missing(
                    "give longest, the bytes in the longest frame: as few as there may be, since \
                     behind a false beginning a frame may come as late as that",
                );
            }
        };
        let mut most = LONGEST as u64;
        if let Length::Field(field) = length {
            most = most.min(field.number.most().saturating_add_signed(field.plus.into()));
        }
        if least <= shortest && shortest <= longest && longest as u64 <= most {
            return Ok((shortest, longest));
        }
        let what = format!(
            "frames of {shortest} to {longest} bytes: the parts that each has are {least}, and {most} \
             is the most that a length field of this type can say, or there is room for"
        );
        wrong(place, what)
    }

    /// That in a frame of this length all is in its place, and nothing in that of another.
    fn check_places(&self, format: &Format, length: usize) -> Result<(), Problem> {
        let mut parts = Vec::new();
        if let Some(terminator) = &self.terminator {
            let bytes = format.terminator.len();
            let from = length.saturating_sub(bytes);
            parts.push((terminator.span(), from, 0..8 * bytes, "the terminator"));
        }
        if let Some(check) = &self.checksum {
            let (entry, bytes) = (check.get_ref(), check.get_ref().number.length);
            if let Some(wanted) = entry.checksum.length().filter(|&wanted| wanted != bytes) {
                return wrong(
                    check,
                    format!("this checksum has {wanted} bytes, and its type {bytes}"),
                );
            }
            let at = entry.at.index(length).unwrap_or(length);
            let [from, to] = entry.covers(length).unwrap_or([length; 2]);
            if from > to + 1 || to >= length || (from < at + bytes && at <= to) {
                let what = format!(
                    "in a frame of {length} bytes the checksum is at {at} and covers {from} to {to}: \
                     give from and to, the first and the last byte; it does not cover itself"
                );
                return wrong(check, what);
            }
            parts.push((check.span(), at, 0..8 * bytes, "the checksum"));
        }
        for (field, entry) in format.fields.iter().zip(&self.fields) {
            let entry = entry.get_ref();
            if format.is_optional(field) && length < format.longest {
                match &entry.value {
                    Some(value) => {
                        return wrong(value, "a frame may be too short for this: give shortest");
                    }
                    None => continue,
                }
            }
            let from = field.at.index(length).unwrap_or(length);
            let left = length.saturating_sub(from + field.margin);
            let bits = field.bits().unwrap_or(0..8 * left);
            // Beyond the end, if it does not end in front of what is counted from there.
            let from = if bits.end <= 8 * left { from } else { length };
            parts.push((entry.at.span(), from, bits, &*field.name));
        }
        let mut taken = vec![""; 8 * length];
        for (span, from, bits, what) in parts {
            let from = 8 * from + bits.start;
            let Some(bits) = taken.get_mut(from..from + bits.len()) else {
                let what = format!("{what} is not in a frame of {length} bytes");
                return Err(Problem(span, what));
            };
            if let Some(other) = bits.iter().find(|other| !other.is_empty()) {
                return Err(Problem(span, format!("{what} is in the place of {other}")));
            }
            bits.fill(what);
        }
        Ok(())
    }
}

fn field(spanned: &Spanned<FieldEntry>) -> Result<Field, Problem> {
    let entry = spanned.get_ref();
    let name = entry.name.get_ref();
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.chars().all(plain) {
        let what = "a name has small letters, digits and _, and begins with a letter";
        return wrong(&entry.name, what);
    }
    if TAKEN.contains(&name.as_str()) {
        let what = format!(
            "{} are other columns' names: take another",
            TAKEN.join(", ")
        );
        return wrong(&entry.name, what);
    }
    let kind = match (entry.kind, entry.bits) {
        (Some(kind), None) => kind,
        (None, Some(width @ 1..=64)) => Kind::Bits {
            first: entry.bit.into(),
            width,
        },
        _ => {
            return wrong(
                spanned,
                "a field has a type, or else bits, which are 1 to 64",
            );
        }
    };
    if entry
        .count
        .is_some_and(|count| !(1..=LONGEST).contains(&count))
    {
        return wrong(spanned, format!("a count is from 1 to {LONGEST}"));
    }
    let mut field = Field {
        name: name.clone(),
        at: *entry.at.get_ref(),
        kind,
        count: entry.count,
        constant: None,
        margin: 0,
    };
    if let Some(value) = &entry.value {
        let constant = (*value.get_ref()).into();
        if field.is_array() || field.parse(&constant).is_err() {
            return wrong(
                value,
                "this value does not fit the field, or the field is an array",
            );
        }
        field.constant = Some(constant);
    }
    if field.at.is_from_end() && field.length().is_none() {
        let what = "what takes all that is left is counted from the front; or give a count";
        return wrong(&entry.at, what);
    }
    Ok(field)
}
