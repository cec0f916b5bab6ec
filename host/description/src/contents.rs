//! The walk along the fields of a frame, which finds the bytes of each field and reads its values. All output goes this
//! way.

use std::ops::Range;

use crate::field::{Field, Type};
use crate::kind::Kind;
use crate::number::{Class, ones};
use crate::value::Value;

impl Kind {
    /// Returns the fields whose values differ between frames, with their contents. Leaves out fields for which the frame
    /// is too short. CSV and JSON, which prepare the names of all fields, call [`Contents::of`] for each field instead.
    #[inline]
    pub fn values<'f>(&'f self, frame: &'f [u8]) -> impl Iterator<Item = (&'f Field, Content<'f>)> {
        let contents = self.contents(frame);
        let fields = self.varying_fields();
        fields.filter_map(move |field| Some((field, contents.of(field)?)))
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
        }
    }
}

/// The parts of a frame.
#[derive(Clone, Copy)]
pub struct Contents<'f> {
    kind: &'f Kind,
    /// The frame without its trailer.
    alone: &'f [u8],
    /// The length from which positions relative to the end are counted.
    length: usize,
    /// The trailer.
    appended: &'f [u8],
}

impl<'f> Contents<'f> {
    /// Returns the content of a field; `None` if the frame is too short to contain the field. Zeros that the sender has
    /// left out count as present.
    #[inline]
    #[must_use]
    pub fn of(&self, field: &'f Field) -> Option<Content<'f>> {
        match field.bytes(self.alone, self.length) {
            Some(bytes) if field.is_simple() => Some(Content { field, bytes }),
            _ => self.of_rarer(field),
        }
    }

    #[inline(never)]
    fn of_rarer(&self, field: &'f Field) -> Option<Content<'f>> {
        let bytes = if field.is_appended {
            field.bytes(self.appended, self.appended.len())
        } else {
            let cut = || field.first_bytes(self.alone, self.length);
            let bytes = field.bytes(self.alone, self.length);
            bytes.or_else(|| self.kind.has_truncated_zeros.then(cut)?)
        };
        let bytes = field.item(bytes?)?;
        Some(Content { field, bytes })
    }
}

/// The content of a field in a frame.
#[derive(Clone, Copy)]
pub struct Content<'f> {
    field: &'f Field,
    bytes: &'f [u8],
}

impl<'f> Content<'f> {
    /// Returns the value, or the first value of an array.
    #[inline]
    #[must_use]
    pub fn value(self) -> Value<'f> {
        self.field.value(self.bytes, 0)
    }

    /// Returns the value, or each value of an array.
    #[inline]
    pub fn values(self) -> impl Iterator<Item = Value<'f>> {
        self.field.values_in(self.bytes)
    }
}

impl Field {
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
            Class::Float if self.prepared.unused == 0 => Value::Double(f64::from_bits(bits)),
            #[expect(clippy::cast_possible_truncation, reason = "it has four bytes")]
            Class::Float => Value::Float(f32::from_bits(bits as u32)),
        };
        match &self.scale {
            Some(scale) => scale.of(&value),
            None => value,
        }
    }
}
