//! Encodes values as a frame.

use framelock::{Classification, DiscardReason};
use framelock_formats::layout::index;
use serde_json::Value as Json;

use crate::field::{Field, Type};
use crate::kind::Kind;
use crate::notation::Notation;
use crate::number::Class;
use crate::pattern::TextPlace;
use crate::problem::{EncodeError, Misfit, UnknownName};
use crate::raw::{is_nothing, number_or_text};
use crate::text::quote;
use crate::{Description, KIND};

/// The content to write into a field: the bits of each value, or the field's bytes.
enum Bits {
    Numbers(Vec<u64>),
    Bytes(Vec<u8>),
}

/// The value of an empty cell.
static NOTHING: Json = Json::String(String::new());

impl Description {
    /// Returns the frame with these values. The values are in the order of the columns. Ignores values in columns that
    /// the row's kind does not have.
    ///
    /// # Errors
    /// Returns an error if a value is missing or impossible, or if no frame has these values.
    pub fn encode(&self, values: &[Option<Json>]) -> Result<Vec<u8>, EncodeError> {
        let value = |name: &str| {
            let place = self.columns.iter().position(|column| column.name == name)?;
            values.get(place)?.as_ref()
        };
        let wanted = match (&*self.kinds, value(KIND)) {
            ([kind], None) => &kind.name.as_str().into(),
            (_, wanted) => wanted.ok_or_else(|| EncodeError::Missing(KIND.to_owned()))?,
        };
        let is_given = |field: &Field| value(&field.name).is_some_and(|value| !is_nothing(value));
        let mut first_error = None;
        // Views of several kinds may have the same name. Use the first view that accepts the values.
        for (number, kind) in self.kinds.iter().enumerate() {
            let has_view = kind.views.iter().any(|view| wanted == &*view.name);
            // To encode a row that contains the whole payload, use the kind instead of the message's view.
            let mut rest = kind.fields.iter().filter(|field| field.length().is_none());
            let is_message = kind.message_names.iter().any(|(_, name)| wanted == name)
                && (!has_view || rest.any(is_given));
            let whole = (is_message || wanted == &*kind.name).then_some(kind);
            let views = kind
                .views
                .iter()
                .filter(|view| wanted == &*view.name && !is_message);
            for shown in whole.into_iter().chain(views) {
                match self.encode_as(number, shown, wanted, value) {
                    Ok(frame) => return Ok(frame),
                    Err(error) => first_error = first_error.or(Some(error)),
                }
            }
        }
        Err(first_error.unwrap_or_else(|| {
            let name = wanted.as_str().map_or(wanted.to_string(), str::to_owned);
            EncodeError::Kind(UnknownName::new(&name, self.kind_names()))
        }))
    }

    /// Encodes a frame of the kind with this index. `shown` is this kind or one of the kind's views. `value` returns
    /// the value of a column.
    fn encode_as<'v>(
        &self,
        number: usize,
        shown: &Kind,
        wanted: &Json,
        value: impl Fn(&str) -> Option<&'v Json>,
    ) -> Result<Vec<u8>, EncodeError> {
        let frame = shown.encode(|field| {
            let all = (0..field.values()).map(|number| value(&field.column(number)));
            let all: Vec<Option<&Json>> = all.collect();
            let given = all
                .iter()
                .rposition(Option::is_some)
                .map_or(0, |last| last + 1);
            all[..given]
                .iter()
                .map(|value| value.unwrap_or(&NOTHING))
                .collect()
        })?;
        // Check which kind a receiver finds in the frame. A receiver tries the kinds in order, so an earlier kind may
        // accept the frame. If the row gives the name of a kind, the receiver may also find one of the kind's views or
        // named messages.
        let is_whole = !shown.views.is_empty() || !shown.message_names.is_empty();
        let is_wanted = |name: &str| wanted == name || is_whole && wanted == &*shown.name;
        if self.is_frame(&frame)
            && self.number(&frame) == number
            && self.name(&frame).is_some_and(is_wanted)
        {
            return Ok(frame);
        }
        Err(EncodeError::OtherKind)
    }
}

impl Kind {
    /// Returns the frame with the values that `given` returns for each field.
    fn encode<'v>(&self, given: impl Fn(&Field) -> Vec<&'v Json>) -> Result<Vec<u8>, EncodeError> {
        let layout = self.layout();
        let (mut contents, mut ends, mut appended) = (Vec::new(), Vec::new(), Vec::new());
        // Make the text from its values, unless the row gives the whole text.
        let mut wholes = self.fields.iter().filter(|field| self.is_whole_text(field));
        let is_whole_given = wholes.any(|field| !given(field).into_iter().all(is_nothing));
        let made = (!self.texts.is_empty() && !is_whole_given).then(|| self.text(&given));
        let made = made.transpose()?;
        let text = Field {
            at: i16::try_from(self.text_at).expect("the header is short"),
            kind: Type::Text,
            ..Field::default()
        };
        if let Some(bytes) = made {
            ends.push(self.text_at + bytes.len());
            contents.push((&text, Bits::Bytes(bytes)));
        }
        let is_made = !contents.is_empty();
        let fields = self
            .fields
            .iter()
            .filter(|field| field.text.is_none() && !(is_made && self.is_whole_text(field)));
        for field in fields {
            let mut bits = match field.constant {
                Some(constant) => Bits::Numbers(vec![constant]),
                None => match self.bits(field, &given(field))? {
                    Some(bits) => bits,
                    None => continue,
                },
            };
            if let Bits::Numbers(values) = &mut bits {
                self.complete(field, values, layout.shortest)?;
            }
            match bits {
                Bits::Bytes(bytes) if field.is_appended => appended = bytes,
                bits => {
                    let end = match &bits {
                        Bits::Bytes(bytes) => field.end(bytes.len()),
                        Bits::Numbers(values) if values.is_empty() => None,
                        Bits::Numbers(values) => field.end_of(values.len()),
                    };
                    ends.extend(end);
                    contents.push((field, bits));
                }
            }
        }
        // If no field takes the rest of the frame, pad the frame to its shortest length with bytes that belong to no
        // field.
        let takes_rest = contents.iter().any(|(field, _)| field.length().is_none());
        let shortest = if takes_rest {
            0
        } else if self.has_truncated_zeros {
            // A sender that leaves out zeros still sends the payload's first byte, even if no value is given.
            let whole = self.least_length(self.fields.iter().filter_map(|field| field.end(0)));
            let first = self.first_zero() + self.from_end;
            whole.min(first).max(layout.shortest)
        } else {
            layout.shortest
        };
        let least = self.least_length(ends).max(shortest);
        let length = match self.multiple() {
            Some((factor, more)) => least + (factor + more - least % factor) % factor,
            None => least,
        };
        for (field, bits) in &mut contents {
            if let Bits::Numbers(values) = bits {
                self.complete(field, values, length)?;
            }
        }
        let mut frame = vec![0; length];
        // Write the first of several syncs or terminators, unless a field selects another one.
        let end = layout.terminator_at(length);
        for (at, patterns) in [(0, layout.sync), (end, layout.terminator)] {
            put_bytes(patterns.each().next().unwrap_or(&[]), &mut frame, at);
        }
        if let Some(trailer) = layout.trailer.filter(|_| !appended.is_empty()) {
            frame[trailer.at] |= trailer.mask & trailer.mask.wrapping_neg();
        }
        for (field, bits) in &contents {
            put(field, bits, &mut frame);
        }
        frame.extend(appended);
        // If the end of the text and the terminator together form another terminator, the counted length differs from
        // the frame's length.
        if !layout.seal(&mut frame) || layout.counted_length(&frame) != frame.len() {
            return Err(self.why_not(&frame));
        }
        // Write the values again. If writing the value of a field changes a byte, the frame does not contain this
        // value.
        let mut again = frame[..length].to_vec();
        for (field, bits) in &contents {
            put(field, bits, &mut again);
            if again != frame[..length] {
                return Err(EncodeError::Determined(field.name.clone()));
            }
        }
        if self.has_truncated_zeros && !takes_rest {
            return Ok(self.without_zeros(frame, length));
        }
        Ok(frame)
    }

    /// Removes the zeros at the end of the payload, but keeps the payload's first byte. The frame has `length` bytes
    /// without its trailer.
    fn without_zeros(&self, frame: Vec<u8>, length: usize) -> Vec<u8> {
        let end = length.saturating_sub(self.from_end);
        let payload = frame.get(self.first_zero()..end).unwrap_or(&[]);
        let zeros = payload.iter().rev().take_while(|byte| **byte == 0).count();
        let mut shorter = frame.clone();
        shorter.drain(end - zeros..end);
        if self.layout().seal(&mut shorter) {
            shorter
        } else {
            frame
        }
    }

    /// Returns the content to write into a field. Returns `None` if the field is optional and no value is given.
    fn bits(&self, field: &Field, given: &[&Json]) -> Result<Option<Bits>, EncodeError> {
        let of_text = |value: &&Json| (*value).clone();
        let of_number = |value: &&Json| number_or_text(value);
        let given = given.iter();
        let mut given: Vec<Json> = if field.is_text() {
            given.map(of_text).collect()
        } else {
            given.map(of_number).collect()
        };
        let misfit = |number: usize, value: &Json, reason| EncodeError::Value {
            column: field.column(number),
            value: quote(value),
            reason,
        };
        let is_optional = self.shortest_with(field).is_some();
        if field.is_bytes() {
            let has_missing = field.missing.is_some();
            return match given.first().or(has_missing.then_some(&Json::Null)) {
                Some(value) if is_nothing(value) && is_optional => Ok(None),
                None if is_optional => Ok(None),
                None => Err(EncodeError::Missing(field.name.clone())),
                Some(value) => match field.to_bytes(value) {
                    Ok(bytes) => Ok(Some(Bits::Bytes(bytes))),
                    Err(reason) => Err(misfit(0, value, reason)),
                },
            };
        }
        // Leave out the empty cells at the end of an array. In a field of floating-point numbers, `null` means NaN.
        let is_float = field.class() == Class::Float && field.missing.is_none();
        while given.last().is_some_and(|value| match value {
            Json::Null => !field.is_array() && !is_float,
            value => is_nothing(value),
        }) {
            given.pop();
        }
        if given.is_empty() && !field.is_array() && field.missing.is_none() {
            reject_missing(!is_optional, field, 0)?;
            return Ok(None);
        }
        let bits = given.iter().enumerate();
        let bits = bits.map(|(number, value)| {
            let bits = field.to_bits(value);
            bits.map_err(|reason| misfit(number, value, reason))
        });
        Ok(Some(Bits::Numbers(bits.collect::<Result<_, _>>()?)))
    }

    /// If fewer values are given than a frame of `length` bytes has, adds the number that means "no value". If the
    /// field has no such number, adds zeros, but only if no value is given and the sender leaves out zeros. Otherwise
    /// returns an error. If the sender leaves out zeros, every frame has all values of the field.
    fn complete(
        &self,
        field: &Field,
        values: &mut Vec<u64>,
        length: usize,
    ) -> Result<(), EncodeError> {
        let (mut present, _) = field.present(length);
        if self.has_truncated_zeros {
            present = field.values();
        }
        if values.len() < present {
            let zeros = (self.has_truncated_zeros && values.is_empty()).then_some(0);
            let missing = field.missing.and_then(|_| field.to_bits(&Json::Null).ok());
            reject_missing(missing.or(zeros).is_none(), field, values.len())?;
            values.resize(present, missing.or(zeros).unwrap_or(0));
        }
        Ok(())
    }

    /// Returns whether a field contains the whole text of a frame.
    fn is_whole_text(&self, field: &Field) -> bool {
        let end = self.layout().longest - self.from_end;
        field.text.is_none()
            && field.is_bytes()
            && usize::try_from(field.at).is_ok_and(|at| at <= self.text_at)
            && field.end(end).is_some_and(|field_end| field_end >= end)
    }

    /// Returns the text with the values that `given` returns.
    fn text<'v>(&self, given: &impl Fn(&Field) -> Vec<&'v Json>) -> Result<Vec<u8>, EncodeError> {
        let whole = self.fields.iter().find(|field| self.is_whole_text(field));
        let name = whole.map_or("text", |field| &field.name);
        let impossible = || EncodeError::NoText(name.to_owned());
        let [pattern] = &*self.texts else {
            return Err(impossible());
        };
        let mut values = Vec::new();
        for (number, value) in pattern.values.iter().enumerate() {
            let place = Some(TextPlace {
                pattern: 0,
                value: number,
            });
            let mut fields = self
                .fields
                .iter()
                .filter(|field| field.text == place && value.name.is_some());
            let field = fields.next().ok_or_else(impossible)?;
            match self.bits(field, &given(field))? {
                Some(Bits::Bytes(bytes)) => values.push(bytes),
                _ => return Err(EncodeError::Missing(field.name.clone())),
            }
        }
        let text = pattern.text(&values);
        // If a value contains the literal that follows the value, decoding would return another value.
        for (number, value) in pattern.values.iter().enumerate() {
            let start = pattern.start(&text);
            let found = start.and_then(|start| pattern.find(&text, number, start));
            if found.map(|(found, _)| found) != Some(&*values[number]) {
                return Err(EncodeError::Determined(
                    value.name.clone().unwrap_or_default(),
                ));
            }
        }
        Ok(text)
    }

    /// Returns the reason why these bytes cannot become a frame.
    fn why_not(&self, frame: &[u8]) -> EncodeError {
        let layout = self.layout();
        if let (Classification::Rejected(DiscardReason::UnknownMessage), Some(messages)) =
            (layout.classify(frame), layout.messages)
        {
            let is_number = |field: &&Field| usize::try_from(field.at) == Ok(messages.number.at);
            let field = self.fields.iter().find(is_number);
            let value = self.message_number(frame).map(|number| number.to_string());
            return EncodeError::Value {
                column: field.map_or("message", |field| &field.name).to_owned(),
                value: value.expect("the frame has a header"),
                reason: Misfit::NoMessage,
            };
        }
        EncodeError::NoFrame {
            length: frame.len(),
            shortest: layout.shortest,
            longest: layout.longest,
        }
    }
}

/// If a value of the field is missing, returns an error that names the value.
fn reject_missing(is_missing: bool, field: &Field, number: usize) -> Result<(), EncodeError> {
    if is_missing {
        return Err(EncodeError::Missing(field.column(number)));
    }
    Ok(())
}

/// Copies bytes into a frame from index `at` on, and stops at the end of the frame.
fn put_bytes(bytes: &[u8], frame: &mut [u8], at: usize) {
    let place = frame.iter_mut().skip(at);
    place.zip(bytes).for_each(|(place, byte)| *place = *byte);
}

/// Writes the content of a field into a frame that has room for it.
fn put(field: &Field, bits: &Bits, frame: &mut [u8]) {
    let from = index(field.at, frame.len()).unwrap_or(0);
    match bits {
        Bits::Bytes(bytes) => put_bytes(bytes, frame, from),
        Bits::Numbers(values) if field.notation == Notation::Hex => {
            let digits = values.iter().flat_map(|bits| field.hex_digits(*bits));
            put_bytes(&digits.collect::<Vec<u8>>(), frame, from);
        }
        Bits::Numbers(values) => field.each_bit(0, |place, number, of_value| {
            let bit = 1 << (place % 8);
            if let (Some(byte), Some(value)) = (frame.get_mut(from + place / 8), values.get(number))
            {
                match value >> of_value & 1 {
                    1 => *byte |= bit,
                    _ => *byte &= !bit,
                }
            }
        }),
    }
}
