//! The fields of a frame: their positions and types, and how to read and write their values.

use std::fmt;
use std::ops::Range;

use framelock_formats::layout::{ByteOrder, Number, index};
use serde::Deserialize;
use serde_json::Value as Json;

use crate::item::Item;
use crate::kind::LONGEST;
use crate::problem::{Located, Misfit, Mistake};
use crate::table::Table;
use crate::value::{Decimal, Scale, Value};
use crate::{hex, text};

/// Names that no field may have, because other columns have them.
const RESERVED: &[&str] = &["offset", "length", "time"];

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

/// A number of whole bytes, such as `u16le`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NumberType {
    /// The meaning of the number's bits.
    pub class: Class,
    /// The number of bytes: 1, 2, 3, 4 or 8.
    pub bytes: usize,
    /// The order of the bytes.
    pub order: ByteOrder,
}

/// The meaning of the bits of a number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Class {
    /// An unsigned number.
    Unsigned,
    /// A signed number, in two's complement.
    Signed,
    /// A floating-point number of 32 bits, as in IEEE 754.
    Float,
}

/// The constant value of a field, or the list of its possible values.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a value is a whole number, or a list of them")]
enum Values {
    One(i64),
    OneOf(Vec<u32>),
}

impl Type {
    fn parse(name: &str) -> Result<Self, Mistake> {
        Ok(match name {
            "bytes" => Self::Bytes,
            "text" => Self::Text,
            _ => Self::Number(NumberType::parse(name)?),
        })
    }
}

impl NumberType {
    fn parse(name: &str) -> Result<Self, Mistake> {
        let unknown = || Mistake::UnknownType(name.to_owned());
        let (class, bits) = name.split_at_checked(1).ok_or_else(unknown)?;
        let bytes = match bits {
            "8" => 1,
            "16le" | "16be" => 2,
            "24le" | "24be" => 3,
            "32le" | "32be" => 4,
            "64le" | "64be" => 8,
            _ => return Err(unknown()),
        };
        let order = if bits.ends_with("be") {
            ByteOrder::Big
        } else {
            ByteOrder::Little
        };
        let class = match (class, bytes) {
            ("u", _) => Class::Unsigned,
            ("i", _) => Class::Signed,
            ("f", 4) => Class::Float,
            _ => return Err(unknown()),
        };
        Ok(Self {
            class,
            bytes,
            order,
        })
    }

    /// Parses the type of an unsigned number of up to four bytes.
    pub(crate) fn parse_unsigned(name: &str) -> Result<Self, Mistake> {
        let number = Self::parse(name)?;
        number
            .is_unsigned()
            .then_some(number)
            .ok_or(Mistake::NotUnsigned)
    }

    fn is_unsigned(self) -> bool {
        self.class == Class::Unsigned && self.bytes <= 4
    }

    /// Returns the layout's number that has this type and begins at this position of the frame.
    pub(crate) fn at(self, at: usize) -> Number {
        Number::new(at, self.bytes, self.order)
    }
}

impl fmt::Display for NumberType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let class = match self.class {
            Class::Unsigned => 'u',
            Class::Signed => 'i',
            Class::Float => 'f',
        };
        let order = match self.order {
            _ if self.bytes == 1 => "",
            ByteOrder::Little => "le",
            ByteOrder::Big => "be",
        };
        write!(f, "{class}{}{order}", 8 * self.bytes)
    }
}

impl NumberType {
    /// Returns a mask with all bits of the number.
    pub(crate) fn all(self) -> u64 {
        ones(8 * self.bytes)
    }

    /// Reads the bits of the number from its bytes. Missing bytes at the end are zero.
    #[inline]
    pub(crate) fn bits(self, bytes: &[u8]) -> u64 {
        let add = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        match (self.order, bytes) {
            (ByteOrder::Little, &[a, b]) => return u16::from_le_bytes([a, b]).into(),
            (ByteOrder::Little, &[a, b, c, d]) => return u32::from_le_bytes([a, b, c, d]).into(),
            _ => {}
        }
        match self.order {
            // Missing bytes at the end are zeros that the sender has left out.
            ByteOrder::Big => {
                let bits = bytes.iter().fold(0, add);
                (bytes.len()..self.bytes).fold(bits, |bits, _| bits << 8)
            }
            ByteOrder::Little => bytes.iter().rev().fold(0, add),
        }
    }

    /// Returns the position of a byte among the number's bytes in the frame. `byte` is 0 for the lowest byte.
    pub(crate) fn place(self, byte: usize) -> usize {
        match self.order {
            ByteOrder::Little => byte,
            ByteOrder::Big => self.bytes - 1 - byte,
        }
    }
}

pub(crate) fn ones(width: usize) -> u64 {
    u64::MAX >> 64_usize.saturating_sub(width).min(63)
}

impl Field {
    /// Reads a field's table.
    pub(crate) fn read(table: &mut Table) -> Result<Self, Located> {
        let name = table.need_parsed("name", column_name)?;
        let at = table.need("at")?;
        let number_type = table.parse("type", Type::parse)?;
        let (width, first) = (table.get("bits")?, table.get::<u16>("bit")?);
        let count = table.get("count")?;
        let mask = table.get("mask")?;
        let value = table.get("value")?;
        let factor = table.get::<Decimal>("scale")?;
        let offset = table.get::<Decimal>("offset")?;
        let unit: Option<String> = table.get("unit")?;
        let item = table.get("item")?;
        table.finish()?;
        let kind = match (number_type, width) {
            (Some(kind), None) => kind,
            (None, Some(width @ 1..=64)) => Type::Bits {
                first: first.unwrap_or(0).into(),
                width,
            },
            _ => return Err(Located::new(table.span.clone(), Mistake::FieldType)),
        };
        if !count.is_none_or(|count| (1..=LONGEST).contains(&count)) {
            return Err(Located::new(table.span.clone(), Mistake::Count));
        }
        let whole_number = match kind {
            Type::Number(number) if number.class != Class::Float => Some(number),
            _ => None,
        };
        if mask
            .is_some_and(|mask| whole_number.is_none_or(|number| mask == 0 || mask > number.all()))
        {
            return table.wrong("mask", Mistake::Mask);
        }
        let scale = (factor.is_some() || offset.is_some()).then(|| {
            let one = Decimal {
                digits: 1,
                decimals: 0,
            };
            Scale::new(factor.unwrap_or(one), offset.unwrap_or_default())
        });
        if scale.is_some() && whole_number.is_none() && width.is_none() {
            let key = if factor.is_some() { "scale" } else { "offset" };
            return table.wrong(key, Mistake::Scale);
        }
        if factor.is_some_and(|factor| factor.digits == 0) {
            return table.wrong("scale", Mistake::ZeroScale);
        }
        let is_blank = |c: char| c.is_control() || c.is_whitespace();
        if unit.as_ref().is_some_and(|unit| unit.contains(is_blank)) {
            return table.wrong("unit", Mistake::Unit);
        }
        if item.is_some() && kind != Type::Text {
            return table.wrong("item", Mistake::Item);
        }
        let mut field = Self {
            name,
            at,
            kind,
            count,
            mask,
            scale,
            unit,
            item,
            ..Self::default()
        };
        match value {
            Some(Values::One(number)) => match field.to_bits(&number.into()) {
                Ok(bits) if !field.is_array() && !field.is_text() => field.constant = Some(bits),
                _ => return table.wrong("value", Mistake::UnfitValue),
            },
            Some(Values::OneOf(numbers)) => {
                let number = whole_number.filter(|number| number.is_unsigned());
                let Some(number) = number.filter(|_| mask.is_none() && count.is_none() && at >= 0)
                else {
                    return table.wrong("value", Mistake::ValueList);
                };
                if numbers.is_empty()
                    || numbers.iter().any(|value| u64::from(*value) > number.all())
                {
                    return table.wrong("value", Mistake::UnfitValues);
                }
                field.allowed = numbers;
            }
            None => {}
        }
        if at < 0 && field.length().is_none() {
            return table.wrong("at", Mistake::RestFromEnd);
        }
        Ok(field)
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
            let number = value.as_f64().or(nan).ok_or(Misfit::NotNumber)?;
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
                let text = value.as_str().ok_or(Misfit::NotBytes)?;
                hex::parse(&[text.strip_prefix('x').unwrap_or(text)]).map_err(Misfit::Hex)?
            }
            _ => text::unescaped(value.as_str().ok_or(Misfit::NotText)?),
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
}

/// Checks that a name is valid for a column, and returns it.
pub(crate) fn column_name(name: &str) -> Result<String, Mistake> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(plain) {
        return Err(Mistake::ColumnName);
    }
    if RESERVED
        .iter()
        .any(|reserved| name.eq_ignore_ascii_case(reserved))
    {
        return Err(Mistake::ReservedName(RESERVED));
    }
    Ok(name.to_owned())
}

/// Returns the number of bits from the lowest to the highest bit of a mask.
fn width(mask: u64) -> usize {
    (64 - mask.leading_zeros() - mask.trailing_zeros().min(63)) as usize
}
