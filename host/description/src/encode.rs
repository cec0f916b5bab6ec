//! Encodes values as a frame.

use framelock::{Classification, DiscardReason};
use serde_json::Value as Json;

use crate::field::{Class, Field};
use crate::kind::Kind;
use crate::text::{no_such, quote};
use crate::{Description, KIND};
use framelock_formats::layout::index;

/// The content to write into a field: the bits of each value, or the field's bytes.
enum Wanted {
    Bits(Vec<u64>),
    Bytes(Vec<u8>),
}

impl Description {
    /// Returns the frame with these values. The values are in the order of the columns. Ignores values in columns that
    /// the row's kind does not have.
    ///
    /// # Errors
    /// The error names the value that is missing or impossible.
    pub fn encode(&self, values: &[Option<Json>]) -> Result<Vec<u8>, String> {
        let value = |name: &str| {
            let place = self.columns.iter().position(|column| column.name == name)?;
            values.get(place)?.as_ref()
        };
        let wanted = match (&*self.kinds, value(KIND)) {
            ([kind], None) => &kind.name.as_str().into(),
            (_, wanted) => wanted.ok_or("missing field `kind`")?,
        };
        let mut outcome = Err(None);
        let is_given = |field: &Field| {
            let given = value(&field.name).filter(|value| !value.is_null());
            given.is_some_and(|value| value != "")
        };
        // Views of several kinds may have the same name. Use the first view that accepts the values.
        for (number, kind) in self.kinds.iter().enumerate() {
            let has_view = kind.views.iter().any(|view| wanted == &*view.name);
            // To encode a row that contains the whole payload, use the kind instead of the message's view.
            let mut rest = kind.fields.iter().filter(|field| field.length().is_none());
            let is_whole = kind.message_names.iter().any(|(_, name)| wanted == name)
                && (!has_view || rest.any(is_given));
            let whole = (is_whole || wanted == &*kind.name).then_some(kind);
            let views = kind
                .views
                .iter()
                .filter(|view| wanted == &*view.name && !is_whole);
            for shown in whole.into_iter().chain(views) {
                let made = self.encode_as(number, shown, wanted, value);
                outcome = outcome
                    .or_else(|first: Option<String>| made.map_err(|why| first.or(Some(why))));
            }
        }
        outcome.map_err(|why| {
            why.unwrap_or_else(|| {
                let wanted = wanted.as_str().map_or(wanted.to_string(), str::to_owned);
                format!("kind: {}", no_such(&wanted, &self.kind_names()))
            })
        })
    }

    /// Encodes a frame of the kind with this index. `shown` is this kind or one of the kind's views. `value` returns
    /// the value of a column.
    fn encode_as<'v>(
        &self,
        number: usize,
        shown: &Kind,
        wanted: &Json,
        value: impl Fn(&str) -> Option<&'v Json>,
    ) -> Result<Vec<u8>, String> {
        let frame = shown.encode(|field| {
            let all = (0..field.values()).map(|number| value(&field.column(number)));
            all.flatten().collect()
        })?;
        // Check which kind a receiver finds in the frame. A receiver tries the kinds in order, so an earlier kind may
        // accept the frame. If the row gives the name of a kind, the receiver may also find one of the kind's views or
        // named messages.
        let is_whole = !shown.views.is_empty() || !shown.message_names.is_empty();
        let is_it = |name: &str| wanted == name || is_whole && wanted == &*shown.name;
        if self.is_frame(&frame)
            && self.number(&frame) == number
            && self.name(&frame).is_some_and(is_it)
        {
            return Ok(frame);
        }
        Err("a frame with these values would be received as a frame of another kind".into())
    }
}

impl Kind {
    /// Returns the frame with the values that `given` returns for each field.
    fn encode<'v>(&self, given: impl Fn(&Field) -> Vec<&'v Json>) -> Result<Vec<u8>, String> {
        let (mut written, mut ends, mut appended) = (Vec::new(), Vec::new(), Vec::new());
        for field in self.fields.iter().filter(|field| field.item.is_none()) {
            let wanted = match field.constant {
                Some(constant) => Wanted::Bits(vec![constant]),
                None => match self.wanted(field, &given(field))? {
                    Some(wanted) => wanted,
                    None => continue,
                },
            };
            if let (Wanted::Bytes(bytes), true) = (&wanted, field.is_appended) {
                appended.clone_from(bytes);
                continue;
            }
            let rest = match &wanted {
                Wanted::Bytes(bytes) => bytes.len(),
                Wanted::Bits(_) => 0,
            };
            ends.extend(field.end(rest));
            written.push((field, wanted));
        }
        // If no field takes the rest of the frame, pad the frame to its shortest length with bytes that belong to no
        // field.
        let takes_rest = written.iter().any(|(field, _)| field.length().is_none());
        let shortest = if takes_rest {
            0
        } else if self.has_truncated_zeros {
            // A sender that leaves out zeros still sends the payload's first byte, even if no value is given.
            let whole = self.least_length(self.fields.iter().filter_map(|field| field.end(0)));
            let first = self.first_zero() + self.from_end;
            whole.min(first).max(self.layout.shortest)
        } else {
            self.layout.shortest
        };
        let length = self.next_length(self.least_length(ends).max(shortest));
        let mut frame = vec![0; length];
        // Write the first of several syncs or terminators, unless a field selects another one.
        let end = length.saturating_sub(self.layout.terminator.length);
        for (at, patterns) in [(0, self.layout.sync), (end, self.layout.terminator)] {
            put_bytes(patterns.each().next().unwrap_or_default(), &mut frame, at);
        }
        if let Some(trailer) = self.layout.trailer.filter(|_| !appended.is_empty())
            && let Some(byte) = frame.get_mut(trailer.at)
        {
            *byte |= trailer.mask & trailer.mask.wrapping_neg();
        }
        for (field, wanted) in &written {
            put(field, wanted, &mut frame);
        }
        frame.extend(appended);
        // Check that the end of the text and the terminator do not together form another terminator.
        let is_sealed = self.layout.seal(&mut frame);
        if is_sealed && self.layout.counted_length(&frame) == frame.len() {
            let alone = frame.get(..length).unwrap_or_default();
            // Write the values again. If writing the value of a field changes a byte, the frame does not contain this
            // value.
            let mut again = alone.to_vec();
            let is_missing = |(field, wanted): &&(&Field, Wanted)| {
                put(field, wanted, &mut again);
                again != alone
            };
            return match written.iter().find(is_missing) {
                Some((field, _)) => Err(format!(
                    "{} cannot have this value: the description gives its bytes another value",
                    field.name
                )),
                None if self.has_truncated_zeros && !takes_rest => {
                    Ok(self.without_zeros(frame, length))
                }
                None => Ok(frame),
            };
        }
        Err(self.why_not(&frame))
    }

    /// For a sender that leaves out zeros, returns the index of the first byte that may be left out.
    #[must_use]
    pub fn first_zero(&self) -> usize {
        let shortest = self.layout.shortest.saturating_sub(self.from_end);
        self.header.max(shortest) + 1
    }

    /// Removes the zeros at the end of the payload, but keeps the payload's first byte. The frame has `length` bytes
    /// without its trailer.
    fn without_zeros(&self, frame: Vec<u8>, length: usize) -> Vec<u8> {
        let end = length.saturating_sub(self.from_end);
        let payload = frame.get(self.first_zero()..end).unwrap_or_default();
        let zeros = payload.iter().rev().take_while(|byte| **byte == 0).count();
        let mut shorter = frame.clone();
        shorter.drain(end - zeros..end);
        if self.layout.seal(&mut shorter) {
            shorter
        } else {
            frame
        }
    }

    /// Returns the content to write into a field. Returns `None` if the field is optional and no value is given.
    fn wanted(&self, field: &Field, given: &[&Json]) -> Result<Option<Wanted>, String> {
        // In a field of floating-point numbers, `null` means NaN.
        let is_float = field.class() == Class::Float;
        let is_nothing = |value: &&Json| value.is_null() && !is_float || *value == "";
        if self.shortest_with(field).is_some() && given.iter().all(is_nothing) {
            return Ok(None);
        }
        if given.len() < field.values() {
            return Err(format!("missing field `{}`", field.name));
        }
        let told = |number, value, why| format!("{} {} {why}", field.column(number), quote(value));
        if let (true, [value, ..]) = (field.is_text(), given) {
            let bytes = field.to_bytes(value).map_err(|why| told(0, value, why))?;
            return Ok(Some(Wanted::Bytes(bytes)));
        }
        let bits = given.iter().enumerate();
        let bits = bits
            .map(|(number, value)| field.to_bits(value).map_err(|why| told(number, value, why)));
        Ok(Some(Wanted::Bits(bits.collect::<Result<_, _>>()?)))
    }

    /// Returns the reason why these bytes cannot become a frame.
    fn why_not(&self, frame: &[u8]) -> String {
        let layout = &self.layout;
        match layout.classify(frame) {
            Classification::Rejected(DiscardReason::UnknownMessage) => {
                let what = "there is no such message: the description lists the messages";
                let Some(messages) = layout.messages else {
                    return what.into();
                };
                let at = messages.number.at;
                let is_it = |field: &&Field| usize::try_from(field.at) == Ok(at);
                let told = self.fields.iter().find(is_it).and_then(|field| {
                    let value = field.value(field.bytes(frame, frame.len())?, 0);
                    Some(format!("{} {value}: {what}", field.name))
                });
                told.unwrap_or(what.into())
            }
            _ => format!(
                "there is no frame of {} bytes with these values: the description allows frames of {} \
                 to {} bytes, and determines their first bytes, their content, their kind and their last bytes",
                frame.len(),
                layout.shortest,
                layout.longest
            ),
        }
    }
}

/// Copies bytes into a frame from index `at` on, and stops at the end of the frame.
fn put_bytes(bytes: &[u8], frame: &mut [u8], at: usize) {
    let place = frame.iter_mut().skip(at);
    place.zip(bytes).for_each(|(place, byte)| *place = *byte);
}

/// Writes the content of a field into a frame that has room for it.
fn put(field: &Field, wanted: &Wanted, frame: &mut [u8]) {
    let from = index(field.at, frame.len()).unwrap_or_default();
    match wanted {
        Wanted::Bytes(bytes) => put_bytes(bytes, frame, from),
        Wanted::Bits(values) => field.each_bit(0, |place, number, of_value| {
            let is_set = values
                .get(number)
                .is_some_and(|bits| bits >> of_value & 1 == 1);
            if let Some(byte) = frame.get_mut(from + place / 8) {
                let bit = 1 << (place % 8);
                *byte = if is_set { *byte | bit } else { *byte & !bit };
            }
        }),
    }
}
