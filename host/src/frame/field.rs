//! What stands in a frame: places, types, and how values are read from bytes and written to them.

use std::ops::Range;

use serde::Deserialize;
use serde_json::Value as Json;

use crate::hex;

/// A place in a frame: counted from the front, or, negative, from the end: -1 is the last byte.
#[derive(Clone, Copy, PartialEq, Default, Debug, Deserialize)]
pub(super) struct Place(pub(super) i16);

impl Place {
    pub(super) fn is_from_end(self) -> bool {
        self.0 < 0
    }

    /// How far it is from the front, or from the end.
    pub(super) fn distance(self) -> usize {
        self.0.unsigned_abs().into()
    }

    /// The index in a frame of that length, if there is one.
    pub(super) fn index(self, length: usize) -> Option<usize> {
        if self.is_from_end() {
            length.checked_sub(self.distance())
        } else {
            Some(self.distance())
        }
    }
}

/// A number of whole bytes, `u16le` for example.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "String")]
pub(super) struct Number {
    class: Class,
    pub(super) length: usize,
    is_big_endian: bool,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Class {
    Unsigned,
    Signed,
    Float,
}

impl TryFrom<String> for Number {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let (class, bits) = name.split_at_checked(1).unwrap_or_default();
        let (length, is_big_endian) = match bits {
            "8" => (1, false),
            "16le" => (2, false),
            "16be" => (2, true),
            "24le" => (3, false),
            "24be" => (3, true),
            "32le" => (4, false),
            "32be" => (4, true),
            "64le" => (8, false),
            "64be" => (8, true),
            _ => (0, false),
        };
        let class = match (class, length) {
            ("u", 1..) => Class::Unsigned,
            ("i", 1..) => Class::Signed,
            ("f", 4) => Class::Float,
            _ => {
                return Err(format!(
                    "there is no type {name:?}: u8, u16le, u24le, u32le and u64le have the lowest \
                     byte first, u16be and so on the highest; i8, i16le and so on have a sign; f32le, \
                     f32be; and for fields bytes and text"
                ));
            }
        };
        Ok(Self {
            class,
            length,
            is_big_endian,
        })
    }
}

/// A place that is counted from the front.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "i16")]
pub(super) struct Front(pub(super) usize);

impl TryFrom<i16> for Front {
    type Error = &'static str;

    fn try_from(at: i16) -> Result<Self, Self::Error> {
        usize::try_from(at).map(Self).map_err(
            |_| "this is needed before the end is known: count it from the front, 0 or more",
        )
    }
}

impl Number {
    /// The most that it holds, if it is unsigned.
    pub(super) fn most(self) -> u64 {
        u64::MAX >> (64 - 8 * self.length)
    }

    /// Its bits, from that many bytes.
    pub(super) fn bits(self, bytes: &[u8]) -> u64 {
        let add = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        if self.is_big_endian {
            bytes.iter().fold(0, add)
        } else {
            bytes.iter().rev().fold(0, add)
        }
    }

    /// Its bits at a place of a frame.
    pub(super) fn at(self, place: Front, frame: &[u8]) -> Option<u64> {
        let bytes = frame.get(place.0..place.0 + self.length)?;
        Some(self.bits(bytes))
    }

    /// The bytes of the lowest of these bits.
    pub(super) fn bytes(self, bits: u64) -> Vec<u8> {
        let mut bytes = bits.to_le_bytes().to_vec();
        bytes.truncate(self.length);
        if self.is_big_endian {
            bytes.reverse();
        }
        bytes
    }

    fn value(self, bits: u64) -> Json {
        let unused = 64 - 8 * self.length;
        match self.class {
            Class::Unsigned => bits.into(),
            Class::Signed => ((bits << unused).cast_signed() >> unused).into(),
            #[expect(clippy::cast_possible_truncation, reason = "it has four bytes")]
            Class::Float => {
                let number = f32::from_bits(bits as u32);
                // As short as it can be: as 64 bits 0.1 has seventeen digits.
                number.to_string().parse::<f64>().ok().into()
            }
        }
    }

    /// The bits of a value, or what it is not.
    fn parse(self, value: &Json) -> Result<u64, String> {
        let most = self.most();
        match self.class {
            Class::Unsigned => unsigned(value, most),
            Class::Signed => {
                let most = (most >> 1).cast_signed();
                let number = value.as_i64().filter(|it| (!most..=most).contains(it));
                number.map(i64::cast_unsigned).ok_or_else(|| {
                    let least = !most;
                    format!("is not a whole number from {least} to {most}")
                })
            }
            #[expect(clippy::cast_possible_truncation, reason = "the field has no more")]
            Class::Float => match value.as_f64() {
                Some(number) => Ok((number as f32).to_bits().into()),
                None => Err("is not a number".into()),
            },
        }
    }
}

fn unsigned(value: &Json, most: u64) -> Result<u64, String> {
    let number = value.as_u64().filter(|&number| number <= most);
    number.ok_or_else(|| format!("is not a whole number from 0 to {most}"))
}

/// What a field is.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "String")]
pub(super) enum Kind {
    Number(Number),
    /// This many bits; the first is this one, counted from the lowest of the first byte.
    Bits {
        first: usize,
        width: usize,
    },
    Bytes,
    Text,
}

impl TryFrom<String> for Kind {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        match &*name {
            "bytes" => Ok(Self::Bytes),
            "text" => Ok(Self::Text),
            _ => name.try_into().map(Self::Number),
        }
    }
}

/// A field of a frame.
#[derive(Debug)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) at: Place,
    pub(super) kind: Kind,
    /// How many values, or for bytes and text how many bytes; none is one value, or all that is left.
    pub(super) count: Option<usize>,
    /// What it always is.
    pub(super) constant: Option<Json>,
    /// Counted from the front, it ends before this many bytes at the end.
    pub(super) margin: usize,
}

impl Field {
    /// Whether its values are text, or bytes in hex.
    pub(super) fn is_text(&self) -> bool {
        matches!(self.kind, Kind::Bytes | Kind::Text)
    }

    /// Whether it has a number of values.
    pub(super) fn is_array(&self) -> bool {
        self.count.is_some() && !self.is_text()
    }

    /// The name of one of its values in a table, counted from 0.
    pub(super) fn column(&self, number: usize) -> String {
        if self.is_array() {
            format!("{}{}", self.name, number + 1)
        } else {
            self.name.clone()
        }
    }

    /// How many values it has.
    pub(super) fn values(&self) -> usize {
        self.count.filter(|_| !self.is_text()).unwrap_or(1)
    }

    /// Its bits, counted from the lowest of its first byte; none if it takes what is left.
    pub(super) fn bits(&self) -> Option<Range<usize>> {
        Some(match self.kind {
            Kind::Number(number) => 0..8 * number.length * self.values(),
            Kind::Bits { first, width } => first..first + width * self.values(),
            Kind::Bytes | Kind::Text => 0..8 * self.count?,
        })
    }

    /// How many bytes it takes from its place on.
    pub(super) fn length(&self) -> Option<usize> {
        self.bits().map(|bits| bits.end.div_ceil(8))
    }

    /// Its value, or all of an array; none if the frame is too short to have it.
    pub(super) fn read(&self, frame: &[u8]) -> Option<Json> {
        let end = frame.len().checked_sub(self.margin)?;
        let bytes = frame.get(self.at.index(frame.len())?..end)?;
        let bytes = bytes.get(..self.length().unwrap_or(bytes.len()))?;
        let bit = |bits: u64, place: usize| {
            let byte = bytes.get(place / 8).copied().unwrap_or_default();
            bits << 1 | u64::from(byte >> (place % 8) & 1)
        };
        let value = |number: usize| match self.kind {
            Kind::Number(kind) => {
                let bytes = bytes.chunks(kind.length).nth(number);
                kind.value(kind.bits(bytes.unwrap_or_default()))
            }
            Kind::Bits { first, width } => {
                let first = first + number * width;
                (first..first + width).rev().fold(0, bit).into()
            }
            Kind::Bytes => hex::glued(bytes).into(),
            Kind::Text => String::from_utf8_lossy(bytes).into(),
        };
        Some(if self.is_array() {
            (0..self.values()).map(value).collect()
        } else {
            value(0)
        })
    }

    /// Whether it is what it always is, if it is always something.
    pub(super) fn is_right(&self, frame: &[u8]) -> bool {
        self.constant.is_none() || self.read(frame) == self.constant
    }

    /// The bytes of one of its values, or what it is not. Those of bits are not in their place yet.
    pub(super) fn parse(&self, value: &Json) -> Result<Vec<u8>, String> {
        let bytes = match self.kind {
            Kind::Number(number) => return Ok(number.bytes(number.parse(value)?)),
            Kind::Bits { width, .. } => {
                return Ok(unsigned(value, u64::MAX >> (64 - width))?
                    .to_le_bytes()
                    .into());
            }
            Kind::Bytes => {
                let text = value.as_str().ok_or("is not bytes in hex, as text")?;
                hex::parse(&[text]).map_err(|why| format!("is not bytes in hex: {why}"))?
            }
            Kind::Text => value.as_str().ok_or("is not text")?.into(),
        };
        match self.count {
            Some(count) if count != bytes.len() => {
                Err(format!("has {} bytes, and {count} are wanted", bytes.len()))
            }
            _ => Ok(bytes),
        }
    }

    /// Writes the bytes of one of its values into a frame that has room for it.
    pub(super) fn write(&self, number: usize, bytes: &[u8], frame: &mut [u8]) {
        let from = self.at.index(frame.len()).unwrap_or_default();
        let Kind::Bits { first, width } = self.kind else {
            return put(frame, from + number * bytes.len(), bytes);
        };
        for bit in 0..width {
            let is_set = bytes
                .get(bit / 8)
                .is_some_and(|byte| byte >> (bit % 8) & 1 == 1);
            let place = first + number * width + bit;
            if let Some(byte) = frame.get_mut(from + place / 8) {
                *byte |= u8::from(is_set) << (place % 8);
            }
        }
    }
}

/// Writes bytes where there is room for them.
pub(super) fn put(frame: &mut [u8], at: usize, bytes: &[u8]) {
    for (place, &byte) in frame.iter_mut().skip(at).zip(bytes) {
        *place = byte;
    }
}
