//! Finds the bytes of each field in a frame, and reads the field's values.

use std::cell::Cell;
use std::ops::Range;

use crate::field::{Field, Type};
use crate::kind::Kind;
use crate::notation::{Notation, bcd, hex_digits};
use crate::number::{Class, NumberType, ones};
use crate::pattern::TextPlace;
use crate::value::Value;

impl Kind {
    /// Returns the fields whose values differ between frames, with their contents. Leaves out fields for which
    /// [`Contents::of`] returns `None`. Also leaves out fields whose value is missing, except arrays. The writers of
    /// CSV and JSON prepare the names of all fields, and call [`Contents::of`] for each field instead.
    #[inline]
    pub fn values<'f>(&'f self, frame: &'f [u8]) -> impl Iterator<Item = (&'f Field, Content<'f>)> {
        let contents = self.contents(frame);
        let fields = self.varying_fields();
        let present = fields.filter_map(move |field| Some((field, contents.of(field)?)));
        present.filter(|(field, content)| field.is_array() || content.value() != Value::Missing)
    }

    /// Returns the parts of a frame, for reading many fields.
    #[inline]
    #[must_use]
    pub fn contents<'f>(&'f self, frame: &'f [u8]) -> Contents<'f> {
        let layout = self.layout();
        let trailer = layout
            .trailer
            .map_or(0, |trailer| trailer.bytes_after(frame));
        let (alone, appended) = frame.split_at(frame.len().saturating_sub(trailer));
        Contents {
            kind: self,
            alone,
            length: layout.counted_length(alone),
            appended,
            last_part: Cell::new((NOWHERE, 0)),
        }
    }
}

/// The place in `last_part` before any value has been found. No pattern has this index.
const NOWHERE: TextPlace = TextPlace {
    pattern: usize::MAX,
    value: 0,
};

/// The parts of a frame.
#[derive(Clone)]
pub struct Contents<'f> {
    kind: &'f Kind,
    /// The frame without its trailer.
    alone: &'f [u8],
    /// The length from which positions relative to the end are counted.
    length: usize,
    /// The trailer.
    appended: &'f [u8],
    /// The place of the last value that was found in the text, and the index after the literal that follows this value.
    last_part: Cell<(TextPlace, usize)>,
}

impl<'f> Contents<'f> {
    /// Returns the content of a field; `None` if the frame has none of the field's values, or if the frame's text
    /// differs from the pattern before the value. Zeros that the sender has left out count as present.
    #[inline]
    #[must_use]
    pub fn of(&self, field: &'f Field) -> Option<Content<'f>> {
        match field.bytes(self.alone, self.length) {
            Some(bytes) if field.prepared.is_simple => Some(Content {
                field,
                bytes,
                values: field.prepared.values,
            }),
            _ => self.of_rarer(field),
        }
    }

    #[inline(never)]
    fn of_rarer(&self, field: &'f Field) -> Option<Content<'f>> {
        let (frame, length) = if field.is_appended {
            (self.appended, self.appended.len())
        } else {
            (self.alone, self.length)
        };
        let (bytes, values) = match field.bytes(frame, length) {
            Some(bytes) => (bytes, field.prepared.values),
            None if self.kind.has_truncated_zeros && !field.is_appended => {
                (field.first_bytes(frame, length)?, field.prepared.values)
            }
            None => {
                let (values, range) = field.present(length);
                (frame.get(range).filter(|_| values > 0)?, values)
            }
        };
        let bytes = match field.text {
            Some(place) => self.part(bytes, place)?,
            None => bytes,
        };
        Some(Content {
            field,
            bytes,
            values,
        })
    }
}

impl<'f> Contents<'f> {
    /// Returns the part of the text that belongs to this place of a pattern. If the part found last comes before this
    /// place in the same pattern, the search continues after that part.
    fn part(&self, text: &'f [u8], place: TextPlace) -> Option<&'f [u8]> {
        let pattern = &self.kind.texts[place.pattern];
        let (last, from) = self.last_part.get();
        let is_before = last.pattern == place.pattern && last.value < place.value;
        let from = if is_before {
            (last.value + 1, from)
        } else {
            pattern.start(text)?
        };
        let (part, next) = pattern.find(text, place.value, from)?;
        self.last_part.set((place, next));
        Some(part)
    }
}

/// The content of a field in a frame.
#[derive(Clone, Copy)]
pub struct Content<'f> {
    field: &'f Field,
    bytes: &'f [u8],
    values: usize,
}

impl<'f> Content<'f> {
    /// Returns the value, or the first value of an array.
    #[inline]
    #[must_use]
    pub fn value(self) -> Value<'f> {
        self.field.value(self.bytes, 0)
    }

    /// Returns the number of values, which is 1 unless the field is an array.
    #[inline]
    #[must_use]
    pub fn count(self) -> usize {
        self.values
    }

    /// Returns the value, or each value of an array that the frame has.
    #[inline]
    pub fn values(self) -> impl Iterator<Item = Value<'f>> {
        (0..self.values).map(move |number| self.field.value(self.bytes, number))
    }
}

impl Field {
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
    /// before the field, returns an empty slice.
    #[inline(never)]
    pub(crate) fn first_bytes<'a>(&self, frame: &'a [u8], length: usize) -> Option<&'a [u8]> {
        let (place, _) = self.prepared.place.as_ref()?;
        let end = length.checked_sub(self.margin)?;
        frame.get(place.start.min(end)..place.end.min(end))
    }

    /// Reads one of the field's values from its bytes.
    #[inline]
    pub(crate) fn value<'a>(&'a self, bytes: &'a [u8], number: usize) -> Value<'a> {
        if let ([byte], true) = (bytes, self.prepared.is_plain) {
            return Value::Unsigned((*byte).into());
        }
        self.any_value(bytes, number)
    }

    #[inline(never)]
    fn any_value<'a>(&'a self, bytes: &'a [u8], number: usize) -> Value<'a> {
        // Each arm calls this closure separately, so that the compiler knows the type of the field. This is faster than
        // a single call before the match.
        let own = || self.own(bytes, number);
        match self.kind {
            _ if self.prepared.is_special => self.special_value(bytes, number),
            Type::Number(kind) => self.of_bits(kind.class, kind.bits(own())),
            Type::Bits { first, width } => self.of_bits(
                Class::Unsigned,
                bits_of(own(), first + number * width, width),
            ),
            Type::Bytes => Value::Bytes(bytes),
            Type::Text => Value::Text(bytes),
        }
    }

    /// Returns the bytes of one value. If the sender has left out some of them, the slice is shorter.
    #[inline]
    fn own<'a>(&self, bytes: &'a [u8], number: usize) -> &'a [u8] {
        let Range { start, end } = self.value_bytes(number, bytes.len());
        &bytes[start.min(bytes.len())..end.min(bytes.len())]
    }

    /// Returns the number that these bits represent.
    #[inline]
    fn of_bits(&self, class: Class, bits: u64) -> Value<'static> {
        let number = self.masked(bits).map(|bits| self.of_class(class, bits));
        number.map_or(Value::Missing, |number| self.scaled(number))
    }

    /// Returns the bits that the mask selects, moved to the lowest bit; `None` if these bits mean that there is no
    /// value.
    #[inline]
    fn masked(&self, bits: u64) -> Option<u64> {
        let bits = match self.mask {
            Some(mask) => (bits & mask) >> mask.trailing_zeros(),
            None => bits,
        };
        (self.prepared.missing != Some(bits)).then_some(bits)
    }

    #[inline]
    fn of_class(&self, class: Class, bits: u64) -> Value<'static> {
        let unused = self.prepared.unused;
        match class {
            Class::Unsigned => Value::Unsigned(bits),
            Class::Signed => Value::Signed((bits << unused).cast_signed() >> unused),
            Class::Float if unused == 0 => Value::Double(f64::from_bits(bits)),
            #[expect(clippy::cast_possible_truncation, reason = "the number has four bytes")]
            Class::Float => Value::Float(f32::from_bits(bits as u32)),
        }
    }

    /// Returns a value of a field whose property `is_special` is true.
    #[inline(never)]
    fn special_value<'a>(&'a self, bytes: &'a [u8], number: usize) -> Value<'a> {
        let own = self.own(bytes, number);
        let bits = match self.kind {
            Type::Bytes | Type::Text => return self.of_text(bytes),
            Type::Bits { first, width } => Some(bits_of(own, first + number * width, width)),
            Type::Number(kind) if self.notation == Notation::Hex => bits_of_hex(kind, own),
            Type::Number(kind) => Some(kind.bits(own)),
        };
        let number = bits
            .and_then(|bits| self.masked(bits))
            .map(|bits| self.number(bits));
        number.map_or(Value::Missing, |number| self.meaning(number))
    }

    /// Returns the text without its padding, or the number in the text.
    fn of_text<'a>(&'a self, mut bytes: &'a [u8]) -> Value<'a> {
        while let Some((last, rest)) = bytes.split_last()
            && Some(*last) == self.padding
        {
            bytes = rest;
        }
        match self.notation.read(bytes) {
            _ if self.kind == Type::Bytes => Value::Bytes(bytes),
            _ if self.notation == Notation::Text => Value::Text(bytes),
            Some(number) => self.meaning(number),
            None => Value::Missing,
        }
    }

    /// Returns the number that these bits represent in the field's notation.
    fn number(&self, bits: u64) -> Value<'static> {
        let unused = self.prepared.unused;
        let sign = 1 << (63 - unused);
        let magnitude = (bits & !sign).cast_signed();
        match self.notation {
            Notation::SignMagnitude if bits & sign == 0 => Value::Signed(magnitude),
            Notation::SignMagnitude => Value::Signed(-magnitude),
            Notation::Magnitude => {
                let signed = (bits << unused).cast_signed() >> unused;
                Value::Unsigned(signed.unsigned_abs())
            }
            Notation::Bcd => bcd(bits).map_or(Value::Missing, Value::Unsigned),
            _ => self.of_class(self.class(), bits),
        }
    }

    #[inline]
    fn scaled(&self, number: Value<'static>) -> Value<'static> {
        match &self.scale {
            Some(scale) => scale.of(&number),
            None => number,
        }
    }

    /// Returns the meaning of a number: its name, [`Value::Missing`], or the scaled number.
    fn meaning(&self, number: Value<'static>) -> Value<'_> {
        self.known_meaning(number)
            .unwrap_or_else(|| self.scaled(number))
    }

    fn known_meaning(&self, number: Value) -> Option<Value<'_>> {
        let missing = self.missing.filter(|_| self.prepared.missing.is_none());
        if missing.is_some_and(|missing| missing.is_same(number)) {
            return Some(Value::Missing);
        }
        if self.names.is_empty() {
            return None;
        }
        let (digits, decimals) = number.digits()?;
        let unit = 10_i128.pow(decimals);
        let whole = (digits % unit == 0).then_some(digits / unit)?;
        let names = &self.names;
        let place = names.binary_search_by_key(&whole, |(number, _)| i128::from(*number));
        Some(Value::Text(names[place.ok()?].1.as_bytes()))
    }
}

/// Returns `width` bits of a field's value, beginning with the bit at the index `first`.
#[inline]
fn bits_of(bytes: &[u8], first: usize, width: usize) -> u64 {
    let shift = first % 8;
    let bits = match bytes {
        &[a, b] => u64::from(u16::from_le_bytes([a, b])) >> shift,
        &[a, b, c] => u64::from(u32::from_le_bytes([a, b, c, 0])) >> shift,
        #[expect(clippy::cast_possible_truncation, reason = "a field has up to 64 bits")]
        bytes => {
            let bytes = bytes.iter().rev();
            let all = bytes.fold(0_u128, |all, byte| all << 8 | u128::from(*byte));
            (all >> shift) as u64
        }
    };
    bits & ones(width)
}

/// Returns the bits of a number in hex digits. Each byte has two digits, and the bytes are in the order of the number's
/// type.
fn bits_of_hex(kind: NumberType, digits: &[u8]) -> Option<u64> {
    let mut bytes = [0; 8];
    for (byte, pair) in bytes.iter_mut().zip(digits.chunks(2)) {
        *byte = u8::try_from(hex_digits(pair)?).ok()?;
    }
    Some(kind.bits(&bytes[..kind.bytes]))
}
