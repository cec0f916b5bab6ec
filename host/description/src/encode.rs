//! Encodes values as a frame.

use framelock::{Classification, DiscardReason};
use framelock_formats::layout::index;
use serde_json::Value as Json;

use crate::field::Field;
use crate::kind::Kind;
use crate::number::Class;
use crate::problem::{EncodeError, Misfit, UnknownName};
use crate::text::quote;
use crate::{Description, KIND};

/// The content to write into a field: the bits of each value, or the field's bytes.
enum Bits {
    Numbers(Vec<u64>),
    Bytes(Vec<u8>),
}

impl Description {
    /// Returns the frame with these values. The values are in the order of the columns. Ignores values in columns that
    /// the row's kind does not have.
    ///
    /// # Errors
    /// The error names the value that is missing or impossible.
    pub fn encode(&self, values: &[Option<Json>]) -> Result<Vec<u8>, EncodeError> {
        let value = |name: &str| {
            let place = self.columns.iter().position(|column| column.name == name)?;
            values.get(place)?.as_ref()
        };
        let wanted = match (&*self.kinds, value(KIND)) {
            ([kind], None) => &kind.name.as_str().into(),
            (_, wanted) => wanted.ok_or_else(|| EncodeError::Missing(KIND.to_owned()))?,
        };
        let is_given =
            |field: &Field| value(&field.name).is_some_and(|value| !value.is_null() && value != "");
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
            all.flatten().collect()
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
        for field in self.fields.iter().filter(|field| field.item.is_none()) {
            let bits = match field.constant {
                Some(constant) => Bits::Numbers(vec![constant]),
                None => match self.bits(field, &given(field))? {
                    Some(bits) => bits,
                    None => continue,
                },
            };
            match bits {
                Bits::Bytes(bytes) if field.is_appended => appended = bytes,
                bits => {
                    let rest = match &bits {
                        Bits::Bytes(bytes) => bytes.len(),
                        Bits::Numbers(_) => 0,
                    };
                    ends.extend(field.end(rest));
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
        // Check that the end of the text and the terminator do not together form another terminator.
        if !layout.seal(&mut frame) || layout.counted_length(&frame) != frame.len() {
            return Err(self.why_not(&frame));
        }
        // Write the values again. If writing the value of a field changes a byte, the frame does not contain this value.
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
        // In a field of floating-point numbers, `null` means NaN.
        let is_float = field.class() == Class::Float;
        let is_nothing = |value: &&Json| value.is_null() && !is_float || *value == "";
        if self.shortest_with(field).is_some() && given.iter().all(is_nothing) {
            return Ok(None);
        }
        if given.len() < field.values() {
            return Err(EncodeError::Missing(field.name.clone()));
        }
        let misfit = |number, reason| EncodeError::Value {
            column: field.column(number),
            value: quote(given[number]),
            reason,
        };
        if field.is_text() {
            let bytes = field
                .to_bytes(given[0])
                .map_err(|reason| misfit(0, reason))?;
            return Ok(Some(Bits::Bytes(bytes)));
        }
        let bits = given.iter().enumerate();
        let bits = bits.map(|(number, value)| {
            field
                .to_bits(value)
                .map_err(|reason| misfit(number, reason))
        });
        Ok(Some(Bits::Numbers(bits.collect::<Result<_, _>>()?)))
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
        Bits::Numbers(values) => field.each_bit(0, |place, number, of_value| {
            let bit = 1 << (place % 8);
            if let Some(byte) = frame.get_mut(from + place / 8) {
                match values[number] >> of_value & 1 {
                    1 => *byte |= bit,
                    _ => *byte &= !bit,
                }
            }
        }),
    }
}
