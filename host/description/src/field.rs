//! The fields of a frame: their positions and types, and how to read and write their values.

use std::collections::BTreeMap;
use std::ops::Range;

use framelock_formats::layout::index;
use serde::Deserialize;
use serde_json::Value as Json;
use toml::Spanned;

use crate::entries::{FieldEntry, parsed, parsed_if_any, span};
use crate::item::Item;
use crate::kind::LONGEST;
use crate::number::{Class, NumberType, ones};
use crate::problem::{Located, Misfit, Mistake, reject_if};
use crate::value::{Decimal, Scale, Value};
use crate::{hex, text};

/// A field of a frame.
#[derive(Clone, Default, Debug)]
pub struct Field {
    /// The field's name.
    pub name: String,
    /// The position of the field's first byte. Positions from 0 on count from the front: 0 is the first byte. Negative
    /// positions count from the end: -1 is the last byte. In a trailer, positions are relative to the trailer.
    pub at: i16,
    /// The field's type.
    pub kind: Type,
    /// The number of values. For bytes and text, the number of bytes. `None` means one value; for bytes and text, the
    /// rest of the frame.
    pub count: Option<usize>,
    /// The bits of a number that form the value. The lowest bit of the mask is the lowest bit of the value.
    pub mask: Option<u64>,
    /// The factor and the offset of a number.
    pub scale: Option<Scale>,
    /// The unit of measurement.
    pub unit: Option<String>,
    /// If the field has the same value in every frame: the bits of this value, at the positions of the mask.
    pub constant: Option<u64>,
    /// The values that the field may have; none if it may have any value.
    pub allowed: Vec<u32>,
    /// If the field takes the rest of the frame: the number of bytes after the field.
    pub margin: usize,
    /// The part of a comma-separated text that the field shows.
    pub item: Option<Item>,
    /// Whether the field is the trailer, which follows the frame.
    pub is_appended: bool,
    /// Properties that are needed for each frame. They are computed once, when the description is read.
    prepared: Prepared,
}

/// Properties of a field that are computed once. `place` is the field's range and the length of the shortest frame that
/// has the field; `None` if the range depends on the frame's length. `values` is the number of values. `is_plain` says
/// whether the field's bytes are the number itself.
#[derive(Clone, Default, Debug)]
struct Prepared {
    place: Option<(Range<usize>, usize)>,
    values: usize,
    /// 64 minus the number of bits in a value.
    unused: usize,
    is_plain: bool,
}

/// The type of a field.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub enum Type {
    /// A number of whole bytes.
    Number(NumberType),
    /// A sequence of bits.
    Bits {
        /// The index of the first bit, counted from the lowest bit of the first byte.
        first: usize,
        /// The number of bits.
        width: usize,
    },
    /// Bytes, shown in hex.
    #[default]
    Bytes,
    /// Text.
    Text,
}

/// The constant value of a field, or the list of its possible values.
#[derive(Clone, Deserialize)]
#[serde(untagged, expecting = "a value is a whole number, or a list of them")]
pub(crate) enum Values {
    One(i64),
    OneOf(Vec<u32>),
}

impl Values {
    pub(crate) fn is_list(&self) -> bool {
        matches!(self, Self::OneOf(_))
    }
}

impl Type {
    fn parse(name: &str) -> Result<Self, Mistake> {
        Ok(match name {
            "bytes" => Self::Bytes,
            "text" => Self::Text,
            _ => Self::Number(NumberType::parse(name, &["bytes", "text"])?),
        })
    }
}

impl Field {
    /// Returns the field with these entries.
    pub(crate) fn read(entry: &Spanned<FieldEntry>) -> Result<Self, Located> {
        let (span, entry) = (entry.span(), entry.get_ref());
        let kind = match (
            parsed_if_any(entry.r#type.as_ref(), Type::parse)?,
            entry.bits,
        ) {
            (Some(kind), None) => kind,
            (None, Some(width @ 1..=64)) => Type::Bits {
                first: entry.bit.into(),
                width,
            },
            _ => {
                let rule = "a field must have either a type, or bits from 1 to 64";
                return Err(Located::new(span, rule));
            }
        };
        let [factor, offset] = [&entry.scale, &entry.offset].map(Option::as_ref);
        let scale = factor.or(offset).map(|_| {
            let [factor, offset] = [factor, offset].map(|it| it.map(|it| *it.get_ref()));
            let one = Decimal {
                digits: 1,
                decimals: 0,
            };
            Scale::new(factor.unwrap_or(one), offset.unwrap_or_default())
        });
        let field = Self {
            name: parsed(&entry.name, column_name)?,
            at: *entry.at.get_ref(),
            kind,
            count: entry.count.as_ref().map(|count| *count.get_ref()),
            mask: entry.mask.as_ref().map(|mask| *mask.get_ref()),
            scale,
            unit: parsed_if_any(entry.unit.as_ref(), unit)?,
            item: entry.item.as_ref().map(|item| *item.get_ref()),
            ..Self::default()
        };
        field.check(entry)?;
        match &entry.value {
            Some(value) => {
                let valued = field.with(value.get_ref());
                valued.map_err(|mistake| Located::new(value.span(), mistake))
            }
            None => Ok(field),
        }
    }

    /// Returns the number's type if the field has whole numbers of whole bytes.
    fn whole_number(&self) -> Option<NumberType> {
        match self.kind {
            Type::Number(number) if number.class != Class::Float => Some(number),
            _ => None,
        }
    }

    /// Checks that each entry suits the field's type.
    fn check(&self, entry: &FieldEntry) -> Result<(), Located> {
        let (whole, is_bits) = (self.whole_number(), matches!(self.kind, Type::Bits { .. }));
        let is_out = |number: usize| !(1..=LONGEST).contains(&number);
        let what = "a count";
        let most = LONGEST;
        let count = span(entry.count.as_ref());
        reject_if(
            self.count.is_some_and(is_out),
            count,
            Mistake::OutOfRange { what, most },
        )?;
        let bits = 1..=whole.map_or(0, NumberType::all_bits);
        reject_if(
            self.mask.is_some_and(|mask| !bits.contains(&mask)),
            span(entry.mask.as_ref()),
            "only a whole number can have a mask, and the mask must have some of its bits",
        )?;
        reject_if(
            self.scale.is_some() && whole.is_none() && !is_bits,
            span(entry.scale.as_ref().or(entry.offset.as_ref())),
            "only a whole number can have a scale and an offset",
        )?;
        reject_if(
            self.scale.as_ref().is_some_and(|scale| scale.factor == 0),
            span(entry.scale.as_ref()),
            "a scale must not be 0",
        )?;
        reject_if(
            self.item.is_some() && self.kind != Type::Text,
            span(entry.item.as_ref()),
            "only text can have an item",
        )?;
        reject_if(
            self.at < 0 && self.length().is_none(),
            entry.at.span(),
            "a field that takes the rest of the frame must be counted from the front: change at, or give a count",
        )
    }

    /// Returns the field with this constant value, or with these possible values.
    fn with(self, value: &Values) -> Result<Self, Mistake> {
        match value {
            Values::One(number) => match self.to_bits(&(*number).into()) {
                Ok(bits) if !self.is_array() && !self.is_text() => Ok(Self {
                    constant: Some(bits),
                    ..self
                }),
                _ => Err("this value does not fit the field, or the field is an array".into()),
            },
            Values::OneOf(numbers) => {
                let number = self.whole_number().filter(|number| number.is_unsigned());
                let is_alone = self.mask.is_none() && self.count.is_none() && self.at >= 0;
                let number = number.filter(|_| is_alone).ok_or(ONE_LIST)?;
                let fits = |value: &u32| u64::from(*value) <= number.all_bits();
                if numbers.is_empty() || !numbers.iter().all(fits) {
                    return Err("these values do not fit the field".into());
                }
                let allowed = numbers.clone();
                Ok(Self { allowed, ..self })
            }
        }
    }

    /// Returns the field of a trailer of `bytes` bytes.
    pub(crate) fn of_trailer(name: String, bytes: usize) -> Self {
        Self {
            name,
            count: Some(bytes),
            is_appended: true,
            ..Self::default()
        }
    }

    /// Returns true if the values are text, or bytes in hex.
    #[must_use]
    pub fn is_text(&self) -> bool {
        matches!(self.kind, Type::Bytes | Type::Text) && self.item.is_none_or(Item::is_text)
    }

    /// Returns true if the field is neither an item nor the trailer.
    #[inline]
    pub(crate) fn is_simple(&self) -> bool {
        self.item.is_none() && !self.is_appended
    }

    /// Returns the part of the field's bytes that contains the value; `None` if the field is an item without a value.
    #[inline]
    pub(crate) fn item<'a>(&self, bytes: &'a [u8]) -> Option<&'a [u8]> {
        match self.item {
            Some(item) => item.part(bytes),
            None => Some(bytes),
        }
    }

    /// Returns the meaning of a value's bits. Values of fields of bits, bytes and text have no sign.
    #[must_use]
    pub fn class(&self) -> Class {
        match self.kind {
            Type::Number(number) => number.class,
            _ => Class::Unsigned,
        }
    }

    /// Returns true if the field is an array of values.
    #[must_use]
    pub fn is_array(&self) -> bool {
        self.count.is_some() && !self.is_text()
    }

    /// Returns the number of values.
    #[must_use]
    pub fn values(&self) -> usize {
        self.count.filter(|_| !self.is_text()).unwrap_or(1)
    }

    /// Returns the column name of a value in a table. `number` counts the field's values from 0.
    #[must_use]
    pub fn column(&self, number: usize) -> String {
        if self.is_array() {
            format!("{}{}", self.name, number + 1)
        } else {
            self.name.clone()
        }
    }

    /// Returns the range of the field's bits, counted from the lowest bit of its first byte; `None` if the field takes the
    /// rest of the frame.
    pub(crate) fn bits(&self) -> Option<Range<usize>> {
        Some(match self.kind {
            Type::Number(number) => 0..8 * number.bytes * self.values(),
            Type::Bits { first, width } => first..first + width * self.values(),
            Type::Bytes | Type::Text => 0..8 * self.count?,
        })
    }

    /// Returns the number of bytes that the field occupies; `None` if it takes the rest of the frame.
    #[must_use]
    #[inline]
    pub fn length(&self) -> Option<usize> {
        match self.kind {
            Type::Number(number) => Some(number.bytes * self.values()),
            _ => self.bits().map(|bits| bits.end.div_ceil(8)),
        }
    }

    /// Returns the range of bytes that one value occupies, counted from the field's first byte. The first and the last
    /// of these bytes may also contain bits of other values. `all` is the number of bytes in the field.
    #[inline]
    pub(crate) fn value_bytes(&self, number: usize, all: usize) -> Range<usize> {
        match self.kind {
            Type::Number(kind) => {
                let from = number * kind.bytes;
                from..from + kind.bytes
            }
            Type::Bits { first, width } => {
                let first = first + number * width;
                first / 8..(first + width).div_ceil(8)
            }
            Type::Bytes | Type::Text => 0..all,
        }
    }

    /// Returns the index after the field's last byte if the field is counted from the front. `rest` is the number of
    /// bytes of a field that takes the rest of the frame.
    #[must_use]
    pub fn end(&self, rest: usize) -> Option<usize> {
        let from = usize::try_from(self.at)
            .ok()
            .filter(|_| !self.is_appended)?;
        Some(from + self.length().unwrap_or(rest))
    }

    /// Returns the range of the field in a frame of `length` bytes; `None` if the frame is too short to contain the
    /// field.
    #[must_use]
    pub fn position(&self, length: usize) -> Option<Range<usize>> {
        let from = index(self.at, length)?;
        let end = length.checked_sub(self.margin)?;
        let to = self.length().map_or(end, |bytes| from + bytes);
        (from <= to && to <= end).then_some(from..to)
    }

    /// Ends a field that takes the rest of the frame before the frame's last `from_end` bytes. If all frames have the
    /// same length, the field has a fixed length too. Returns false if no bytes are left for the field.
    pub(crate) fn limit(&mut self, fixed_length: Option<usize>, from_end: usize) -> bool {
        if let (Some(length), None) = (fixed_length, self.length()) {
            let left = length.saturating_sub(usize::from(self.at.unsigned_abs()) + from_end);
            self.count = Some(left);
        }
        if fixed_length.is_none() && self.at >= 0 && self.constant.is_none() && !self.is_appended {
            self.margin = from_end;
        }
        let from = usize::try_from(self.at).ok();
        let to = from.and_then(|from| Some(from + self.length()?));
        self.prepared = Prepared {
            place: from.zip(to).map(|(from, to)| (from..to, to + self.margin)),
            values: self.values(),
            unused: 64 - self.value_width(),
            is_plain: self.length() == Some(1)
                && self.mask.is_none()
                && self.scale.is_none()
                && matches!(self.kind, Type::Number(number) if number.class == Class::Unsigned),
        };
        self.count != Some(0)
    }

    /// Returns the field's bytes in a frame; `None` if the frame is too short to contain the field. Positions relative
    /// to the end are counted from `length`.
    #[inline]
    pub(crate) fn bytes<'a>(&self, frame: &'a [u8], length: usize) -> Option<&'a [u8]> {
        match &self.prepared.place {
            Some((place, shortest)) if *shortest <= length => frame.get(place.clone()),
            Some(_) => None,
            None => self.other_bytes(frame, length),
        }
    }

    /// Does the same as [`bytes`](Self::bytes), for a field that is counted from the end or takes the rest of the
    /// frame.
    #[inline(never)]
    fn other_bytes<'a>(&self, frame: &'a [u8], length: usize) -> Option<&'a [u8]> {
        frame.get(self.position(length)?)
    }

    /// Returns the bytes of the field that lie in a frame which is too short for the whole field. If the frame ends
    /// before the field, these are no bytes.
    #[inline(never)]
    pub(crate) fn first_bytes<'a>(&self, frame: &'a [u8], length: usize) -> Option<&'a [u8]> {
        let (place, _) = self.prepared.place.as_ref()?;
        let end = length.checked_sub(self.margin)?;
        frame.get(place.start.min(end)..place.end.min(end))
    }

    /// Reads the field's values from its bytes.
    #[inline]
    pub(crate) fn values_in<'a>(&'a self, bytes: &'a [u8]) -> impl Iterator<Item = Value<'a>> {
        (0..self.prepared.values).map(|number| self.value(bytes, number))
    }

    /// Reads one of the field's values from its bytes.
    #[inline]
    pub(crate) fn value<'a>(&self, bytes: &'a [u8], number: usize) -> Value<'a> {
        if let ([byte], true) = (bytes, self.prepared.is_plain) {
            return Value::Unsigned((*byte).into());
        }
        self.any_value(bytes, number)
    }

    #[inline(never)]
    fn any_value<'a>(&self, bytes: &'a [u8], number: usize) -> Value<'a> {
        // Each arm calls this closure separately, so that the compiler knows the type in each call. This is faster than
        // a single call before the match.
        let own = || {
            let Range { start, end } = self.value_bytes(number, bytes.len());
            // Treat bytes that the sender has left out as zero.
            &bytes[start.min(bytes.len())..end.min(bytes.len())]
        };
        if let Some(value) = self.item.and_then(|item| item.value(bytes)) {
            return value;
        }
        match self.kind {
            Type::Number(kind) => self.of_bits(kind.class, kind.bits(own())),
            Type::Bits { first, width } => {
                let shift = (first + number * width) % 8;
                let bits = match own() {
                    &[a, b] => u64::from(u16::from_le_bytes([a, b])) >> shift,
                    &[a, b, c] => u64::from(u32::from_le_bytes([a, b, c, 0])) >> shift,
                    #[expect(
                        clippy::cast_possible_truncation,
                        reason = "a field has up to 64 bits"
                    )]
                    bytes => {
                        let bytes = bytes.iter().rev();
                        let all = bytes.fold(0_u128, |all, byte| all << 8 | u128::from(*byte));
                        (all >> shift) as u64
                    }
                };
                self.of_bits(Class::Unsigned, bits & ones(width))
            }
            Type::Bytes => Value::Bytes(bytes),
            Type::Text => Value::Text(bytes),
        }
    }

    /// Returns the value that these bits represent.
    fn of_bits(&self, class: Class, bits: u64) -> Value<'static> {
        let bits = match self.mask {
            Some(mask) => (bits & mask) >> mask.trailing_zeros(),
            None => bits,
        };
        let value = match class {
            Class::Unsigned => Value::Unsigned(bits),
            Class::Signed => {
                let unused = self.prepared.unused;
                Value::Signed((bits << unused).cast_signed() >> unused)
            }
            #[expect(clippy::cast_possible_truncation, reason = "it has four bytes")]
            Class::Float => Value::Float(f32::from_bits(bits as u32)),
        };
        match &self.scale {
            Some(scale) => scale.of(&value),
            None => value,
        }
    }

    /// Returns the number of bits in a value, before applying the mask.
    fn width(&self) -> usize {
        match self.kind {
            Type::Number(number) => 8 * number.bytes,
            Type::Bits { width, .. } => width,
            Type::Bytes | Type::Text => 0,
        }
    }

    /// Returns the number of bits in a value.
    #[must_use]
    pub fn value_width(&self) -> usize {
        self.mask.map_or(self.width(), width)
    }

    /// Returns the bits of a value, at the positions of the mask. The error says why the value does not fit the field.
    pub(crate) fn to_bits(&self, value: &Json) -> Result<u64, Misfit> {
        let class = self.class();
        #[expect(clippy::cast_possible_truncation, reason = "the field has no more")]
        if class == Class::Float {
            let nan = value.is_null().then_some(f64::NAN);
            let number = value.as_f64().or(nan).ok_or(Misfit::Not("a number"))?;
            return Ok((number as f32).to_bits().into());
        }
        let all = ones(self.width());
        let mask = self.mask.unwrap_or(all);
        let most = ones(width(mask));
        let (least, most) = match class {
            Class::Signed => (!i128::from(most >> 1), i128::from(most >> 1)),
            _ => (0, i128::from(most)),
        };
        let number = match &self.scale {
            Some(scale) => scale.number(value),
            None => value.as_number().and_then(serde_json::Number::as_i128),
        };
        let is_in = |number: &i128| (least..=most).contains(number);
        let Some(number) = number.filter(is_in) else {
            let shown = |number: i128| match &self.scale {
                Some(scale) => scale.text(number),
                None => number.to_string(),
            };
            return Err(Misfit::NotBetween {
                is_whole: self.scale.is_none(),
                least: shown(least),
                most: shown(most),
            });
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the lowest bits are the value"
        )]
        let bits = (number as u64 & ones(width(mask))) << mask.trailing_zeros();
        if bits & !mask != 0 {
            return Err(Misfit::OutsideMask(mask));
        }
        Ok(bits)
    }

    /// Returns the bytes of a text, or of bytes in hex. The error says why the value does not fit the field.
    pub(crate) fn to_bytes(&self, value: &Json) -> Result<Vec<u8>, Misfit> {
        let bytes = match self.kind {
            Type::Bytes => {
                let text = value.as_str();
                let text = text.ok_or(Misfit::Not("bytes in hex, as text"))?;
                hex::parse(&[text.strip_prefix('x').unwrap_or(text)]).map_err(Misfit::Hex)?
            }
            _ => text::unescaped(value.as_str().ok_or(Misfit::Not("text"))?),
        };
        match self.count {
            Some(wanted) if wanted != bytes.len() => Err(Misfit::Length {
                given: bytes.len(),
                wanted,
            }),
            _ => Ok(bytes),
        }
    }

    /// Calls `bit` for each bit that belongs to a value. The first argument is the position of the bit, counted from
    /// the lowest bit of the field's first byte. The second is the index of the value. The third is the index of the
    /// bit in the value. If the field takes the rest of the frame, `left` is its number of bytes.
    pub(crate) fn each_bit(&self, left: usize, mut bit: impl FnMut(usize, usize, usize)) {
        let all = self.bits().unwrap_or(0..8 * left);
        let width = self.width();
        for (count, place) in all.enumerate() {
            let (number, of_value) = match width {
                0 => (0, count),
                width => (count / width, count % width),
            };
            let place = match self.kind {
                Type::Number(kind) => {
                    8 * (number * kind.bytes + kind.place(of_value / 8)) + of_value % 8
                }
                _ => place,
            };
            if width == 0 || self.mask.is_none_or(|mask| mask >> of_value & 1 == 1) {
                bit(place, number, of_value);
            }
        }
    }
    /// Returns the bytes that have bits of a value: the index of each byte in the field, its bits, and those of them that
    /// are 1 in a constant field. If the field takes the rest of the frame, `left` is its number of bytes.
    pub(crate) fn masks(&self, left: usize) -> BTreeMap<usize, (u8, u8)> {
        let mut masks = BTreeMap::<usize, (u8, u8)>::new();
        let constant = self.constant.unwrap_or(0);
        self.each_bit(left, |place, _, of_value| {
            let (mask, value) = masks.entry(place / 8).or_default();
            let bit = 1 << (place % 8);
            *mask |= bit;
            if self.constant.is_some() && constant >> of_value & 1 == 1 {
                *value |= bit;
            }
        });
        masks
    }
}

/// The rule for a list of values.
pub(crate) const ONE_LIST: &str = "only one field can have a list of values, and only without messages: an unsigned \
    number without mask and count, counted from the front";

/// Checks that a name is valid for a column, and returns it.
pub(crate) fn column_name(name: &str) -> Result<String, Mistake> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let small = name.to_ascii_lowercase();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(plain) {
        Err("a name must have only letters, digits and _, and begin with a letter".into())
    } else if ["offset", "length", "time"].contains(&&*small) {
        Err("offset, length, time are the names of other columns: choose another name".into())
    } else {
        Ok(name.to_owned())
    }
}

fn unit(unit: &str) -> Result<String, Mistake> {
    match unit.contains(|c: char| c.is_control() || c.is_whitespace()) {
        true => Err("a unit must be a word, such as deg or m/s".into()),
        false => Ok(unit.to_owned()),
    }
}

/// Returns the number of bits from the lowest to the highest bit of a mask.
fn width(mask: u64) -> usize {
    (64 - mask.leading_zeros() - mask.trailing_zeros().min(63)) as usize
}
