//! The fields of a frame: their types, their meanings, and their positions.

use std::collections::BTreeMap;
use std::ops::Range;

use framelock_formats::layout::index;

use crate::notation::Notation;
use crate::number::{Class, NumberType};
use crate::pattern::TextPlace;
use crate::value::{Scale, Value};

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
    /// The notation of the values.
    pub notation: Notation,
    /// The number of decimals with which a decimal number in text is encoded; `None` if the description gives none.
    pub decimals: Option<u32>,
    /// The greatest number of values in an array. For bytes and text, the number of bytes. `None` means a single value,
    /// or for bytes and text the rest of the frame.
    pub count: Option<usize>,
    /// The bits of a number that form the value. The lowest bit of the mask is the lowest bit of the value.
    pub mask: Option<u64>,
    /// The factor and the offset of a number.
    pub scale: Option<Scale>,
    /// The unit of measurement.
    pub unit: Option<String>,
    /// The names of unscaled numbers, in ascending order of the numbers.
    pub names: Vec<(i64, String)>,
    /// The unscaled number that means that there is no value.
    pub missing: Option<Value<'static>>,
    /// The byte that pads a text to its fixed number of bytes.
    pub padding: Option<u8>,
    /// If the field is a value in the frame's text: the place of the value in the text. The field's position `at` is
    /// then the position of the whole text.
    pub text: Option<TextPlace>,
    /// If the field has the same value in every frame: the bits of this value, at the positions of the mask.
    pub constant: Option<u64>,
    /// The values that the field may have; empty if the field may have any value.
    pub allowed: Vec<u32>,
    /// The number of bytes at the end of the frame that the field cannot occupy.
    pub margin: usize,
    /// Whether the field is the trailer, which follows the frame.
    pub is_appended: bool,
    /// Properties that are needed for each frame. They are computed once, when the description is read.
    pub(crate) prepared: Prepared,
}

/// Properties of a field that are computed once. `place` is the field's range and the length of the shortest frame that
/// has the field; `None` if the range depends on the frame's length. `values` is the greatest number of values.
/// `is_plain` says whether the field is one byte whose unsigned number is the value. `missing` is the bits that mean
/// that there is no value. `is_special` says whether the field has an unusual notation, padding, names, or NaN as the
/// missing value. `is_simple` says whether the field is neither a part of a text nor the trailer.
#[derive(Clone, Default, Debug)]
pub(crate) struct Prepared {
    pub(crate) place: Option<(Range<usize>, usize)>,
    pub(crate) values: usize,
    /// 64 minus the number of bits in a value.
    pub(crate) unused: usize,
    pub(crate) is_plain: bool,
    pub(crate) missing: Option<u64>,
    pub(crate) is_special: bool,
    pub(crate) is_simple: bool,
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

impl Type {
    /// Returns the notation that values have if their entry gives none.
    pub(crate) fn usual_notation(self) -> Notation {
        match self {
            Self::Number(number) => match number.class {
                Class::Unsigned => Notation::Unsigned,
                Class::Signed => Notation::Signed,
                Class::Float => Notation::Float,
            },
            Self::Bits { .. } => Notation::Unsigned,
            Self::Bytes | Self::Text => Notation::Text,
        }
    }
}

impl Field {
    /// Returns the field of a trailer of `bytes` bytes.
    pub(crate) fn of_trailer(name: String, bytes: usize) -> Self {
        Self {
            name,
            count: Some(bytes),
            is_appended: true,
            ..Self::default()
        }
    }

    /// Returns true if tables show the values as text, or as bytes in hex.
    #[must_use]
    pub fn is_text(&self) -> bool {
        self.notation == Notation::Text
    }

    /// Returns true if the field consists of bytes or text. The text may be the digits of a number.
    #[must_use]
    pub fn is_bytes(&self) -> bool {
        matches!(self.kind, Type::Bytes | Type::Text)
    }

    /// Returns true if the values are whole numbers or decimal numbers.
    #[must_use]
    pub fn is_decimal(&self) -> bool {
        !matches!(self.notation, Notation::Text | Notation::Float)
    }

    /// Returns the class of the values: unsigned, signed or floating-point numbers. Bytes, and texts that are not
    /// numbers, count as unsigned.
    #[must_use]
    pub fn class(&self) -> Class {
        match (self.notation, self.kind) {
            (Notation::Hex, Type::Number(number)) => number.class,
            (
                Notation::Unsigned
                | Notation::Magnitude
                | Notation::Bcd
                | Notation::Hex
                | Notation::Text,
                _,
            ) => Class::Unsigned,
            (Notation::Float, _) => Class::Float,
            _ => Class::Signed,
        }
    }

    /// Returns true if the field is an array of values.
    #[must_use]
    pub fn is_array(&self) -> bool {
        self.count.is_some() && !self.is_bytes()
    }

    /// Returns the greatest number of values.
    #[must_use]
    pub fn values(&self) -> usize {
        self.count.filter(|_| !self.is_bytes()).unwrap_or(1)
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

    /// Returns the range of the field's bits, counted from the lowest bit of its first byte; `None` if the field takes
    /// the rest of the frame.
    pub(crate) fn bits(&self) -> Option<Range<usize>> {
        Some(match self.kind {
            Type::Number(_) => 0..8 * self.number_bytes() * self.values(),
            Type::Bits { first, width } => first..first + width * self.values(),
            Type::Bytes | Type::Text => 0..8 * self.count?,
        })
    }

    /// Returns the number of bytes that the field occupies; `None` if it takes the rest of the frame.
    #[must_use]
    #[inline]
    pub fn length(&self) -> Option<usize> {
        match self.kind {
            Type::Number(_) => Some(self.number_bytes() * self.values()),
            _ => self.bits().map(|bits| bits.end.div_ceil(8)),
        }
    }

    /// Returns the number of bytes that a number of whole bytes occupies. In hex, each byte takes two digits.
    #[inline]
    fn number_bytes(&self) -> usize {
        match (self.kind, self.notation) {
            (Type::Number(number), Notation::Hex) => 2 * number.bytes,
            (Type::Number(number), _) => number.bytes,
            _ => 0,
        }
    }

    /// Returns the number of bytes that the first `values` values occupy, including a last byte that the values fill
    /// only in part.
    fn bytes_of(&self, values: usize) -> usize {
        match self.kind {
            Type::Number(_) => self.number_bytes() * values,
            Type::Bits { first, width } => (first + width * values).div_ceil(8),
            Type::Bytes | Type::Text => self.count.unwrap_or(0),
        }
    }

    /// Returns the number of the field's values that fit into a number of bytes.
    fn fitting(&self, bytes: usize) -> usize {
        let all = match self.kind {
            Type::Number(_) => bytes / self.number_bytes(),
            Type::Bits { first, width } => (8 * bytes).saturating_sub(first) / width,
            Type::Bytes | Type::Text => 1,
        };
        all.min(self.values())
    }

    /// Returns the number of values that are in a frame of `length` bytes, and the range of bytes that they occupy.
    /// If the frame is too short for the whole field, an array that is counted from the front has fewer values, and any
    /// other field has none.
    #[must_use]
    pub fn present(&self, length: usize) -> (usize, Range<usize>) {
        let partial = || {
            let from = usize::try_from(self.at).ok().filter(|_| self.is_array())?;
            let count = self.fitting(length.checked_sub(from + self.margin)?);
            Some((count, from..from + self.bytes_of(count)))
        };
        let whole = self.position(length).map(|range| (self.values(), range));
        whole.or_else(partial).unwrap_or_default()
    }

    /// Returns the length of the shortest frame that has the first `values` values.
    pub(crate) fn needs(&self, values: usize) -> usize {
        match usize::try_from(self.at) {
            Ok(from) => from + self.bytes_of(values) + self.margin,
            Err(_) => self.at.unsigned_abs().into(),
        }
    }

    /// Returns the range of bytes that one value occupies, counted from the field's first byte. The first and the last
    /// of these bytes may also contain bits of other values. `all` is the number of bytes in the field.
    #[inline]
    pub(crate) fn value_bytes(&self, number: usize, all: usize) -> Range<usize> {
        match self.kind {
            Type::Number(_) => {
                let from = number * self.number_bytes();
                from..from + self.number_bytes()
            }
            Type::Bits { first, width } => {
                let first = first + number * width;
                first / 8..(first + width).div_ceil(8)
            }
            Type::Bytes | Type::Text => 0..all,
        }
    }

    /// Returns the index after the field's last byte; `None` if the field is counted from the end, or is the trailer.
    /// `rest` is the number of bytes of a field that takes the rest of the frame.
    #[must_use]
    pub fn end(&self, rest: usize) -> Option<usize> {
        let from = usize::try_from(self.at)
            .ok()
            .filter(|_| !self.is_appended)?;
        Some(from + self.length().unwrap_or(rest))
    }

    /// Returns the index after the first `values` values if the field is counted from the front.
    pub(crate) fn end_of(&self, values: usize) -> Option<usize> {
        Some(usize::try_from(self.at).ok()? + self.bytes_of(values))
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

    /// If frames vary in length, or the field is a part of a text, ends the field before the frame's last `from_end`
    /// bytes. Fields that are counted from the end, constant fields and the trailer are not limited. If all frames have
    /// the same length, a field that takes the rest of the frame gets a fixed length, unless the field is a part of a
    /// text. Also computes the properties that are needed for each frame. Returns false if no byte is left for the
    /// field.
    pub(crate) fn limit(&mut self, fixed_length: Option<usize>, from_end: usize) -> bool {
        let fixed_length = fixed_length.filter(|_| self.text.is_none());
        if let (Some(length), None) = (fixed_length, self.length()) {
            let left = length.saturating_sub(usize::from(self.at.unsigned_abs()) + from_end);
            self.count = Some(left);
        }
        if fixed_length.is_none() && self.at >= 0 && self.constant.is_none() && !self.is_appended {
            self.margin = from_end;
        }
        let from = usize::try_from(self.at).ok();
        let to = from.and_then(|from| Some(from + self.length()?));
        // The bits that mean that there is no value; `None` for NaN, because many bit patterns are NaN.
        let is_nan = matches!(self.missing, Some(Value::Double(number)) if number.is_nan());
        let missing = self.missing.filter(|_| !is_nan && !self.is_bytes());
        let missing = missing.and_then(|_| self.to_bits(&serde_json::Value::Null).ok());
        let missing = missing.map(|bits| bits >> self.mask.map_or(0, u64::trailing_zeros));
        let is_special = self.notation != self.kind.usual_notation()
            || self.padding.is_some()
            || !self.names.is_empty()
            || self.missing.is_some() && missing.is_none();
        self.prepared = Prepared {
            place: from.zip(to).map(|(from, to)| (from..to, to + self.margin)),
            values: self.values(),
            unused: 64 - self.value_width(),
            is_plain: self.length() == Some(1)
                && self.mask.is_none()
                && self.scale.is_none()
                && matches!(self.kind, Type::Number(_))
                && self.notation == Notation::Unsigned
                && !is_special
                && missing.is_none(),
            missing,
            is_special,
            is_simple: self.text.is_none() && !self.is_appended,
        };
        self.count != Some(0)
    }

    /// Returns the number of bits in a value, before applying the mask; 0 for bytes and text.
    pub(crate) fn width(&self) -> usize {
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

    /// Returns the bytes that have bits of a value. For each byte, the map has the byte's index in the field, a mask of
    /// these bits, and a mask of the bits that are 1 in a constant field. If the field takes the rest of the frame,
    /// `left` is its number of bytes.
    pub(crate) fn masks(&self, left: usize) -> BTreeMap<usize, (u8, u8)> {
        if self.notation == Notation::Hex && !self.is_bytes() {
            let digits = self.constant.map(|bits| self.hex_digits(bits));
            let digit = |byte: usize| digits.as_ref().map_or(0, |digits| digits[byte]);
            let bytes = 0..self.bytes_of(self.values());
            return bytes.map(|byte| (byte, (0xFF, digit(byte)))).collect();
        }
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

/// Returns the number of bits from the lowest to the highest bit of a mask.
pub(crate) fn width(mask: u64) -> usize {
    (64 - mask.leading_zeros() - mask.trailing_zeros().min(63)) as usize
}
