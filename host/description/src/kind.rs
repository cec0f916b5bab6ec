//! A kind of frames, and the values of its fields in a frame.

use framelock_formats::CheckedLayout;

use crate::field::{Class, Field, NumberType};
use crate::value::Value;

/// The largest length that a description may allow for a frame: the largest 16-bit number plus 256.
pub const LONGEST: usize = 0x1_00FF;

/// One kind of frames: their layout and their fields.
#[derive(Clone, Debug)]
pub struct Kind {
    /// The name of the kind.
    pub name: String,
    /// The layout of a frame.
    pub layout: CheckedLayout<'static>,
    /// The fields in the order of the description, including those that have the same value in every frame.
    pub fields: Vec<Field>,
    /// The exclusive end index of each field, in ascending order; `None` if a field takes the rest of the frame.
    pub(crate) ends: Option<Vec<usize>>,
    /// The number of bytes that must arrive before the length is known.
    pub(crate) header: usize,
    /// How many bytes at the frame's end hold the terminator and all parts whose positions are counted from the end.
    pub from_end: usize,
    /// The views of messages. Each view has fields for the values in one message's payload. A frame is shown by the
    /// first view that fits.
    pub views: Vec<Kind>,
    /// If this is a view: the bytes that identify the view's frames, and the index of the first of these bytes.
    pub sign: (usize, Vec<u8>),
    /// Whether the sender leaves out zero bytes at the end of the payload.
    pub has_truncated_zeros: bool,
    /// The numbers and names of messages, in ascending order of the numbers.
    pub message_names: Vec<(u32, &'static str)>,
}

impl Kind {
    /// Returns the kind and its views.
    pub(crate) fn with_views(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.views)
    }

    /// Returns the content of a field in a frame; `None` if the frame is too short to contain the field. Zeros that the
    /// sender has left out count as present.
    #[inline]
    #[must_use]
    pub fn content<'f>(&'f self, field: &'f Field, frame: &'f [u8]) -> Option<Content<'f>> {
        self.contents(frame).of(field)
    }

    /// Returns the parts of a frame, for reading many fields.
    #[inline]
    #[must_use]
    pub fn contents<'f>(&'f self, frame: &'f [u8]) -> Contents<'f> {
        let trailer = self.layout.trailer.map_or(0, |it| it.bytes_after(frame));
        let place = frame.len().saturating_sub(trailer);
        let (alone, appended) = frame.split_at_checked(place).unwrap_or_default();
        Contents {
            kind: self,
            alone,
            length: self.layout.counted_length(alone),
            appended,
        }
    }

    /// Returns the name of the message in a frame, or the name of the kind if the message has none.
    #[inline]
    #[must_use]
    pub fn name_of(&self, frame: &[u8]) -> &str {
        self.message_name(frame).unwrap_or(&self.name)
    }

    fn message_name(&self, frame: &[u8]) -> Option<&'static str> {
        if self.message_names.is_empty() {
            return None;
        }
        let number = self.layout.messages?.number;
        let kind = NumberType {
            class: Class::Unsigned,
            bytes: number.bytes,
            order: number.order,
        };
        let number = kind.bits(frame.get(number.at..number.end())?);
        let names = &self.message_names;
        let place = names.binary_search_by_key(&number, |(number, _)| u64::from(*number));
        Some(names.get(place.ok()?)?.1)
    }

    /// Returns true if `is_it` returns true for the name of the kind or of one of its messages.
    #[must_use]
    pub fn has_name(&self, is_it: impl Fn(&str) -> bool) -> bool {
        is_it(&self.name) || self.message_names.iter().any(|(_, name)| is_it(name))
    }

    /// Returns the index of the view that shows a frame; `None` if no view fits the frame's values and length.
    #[inline]
    pub(crate) fn view(&self, frame: &[u8]) -> Option<usize> {
        self.views.iter().position(|view| view.shows(frame))
    }

    #[inline]
    fn shows(&self, frame: &[u8]) -> bool {
        let (at, bytes) = &self.sign;
        frame.get(*at..at + bytes.len()) == Some(bytes) && self.has_length_of(frame)
    }

    /// Returns true if some field ends at the end of the frame, or takes the rest of the frame. Zeros that the sender
    /// has left out count as present.
    fn has_length_of(&self, frame: &[u8]) -> bool {
        let appended = self.layout.trailer.map_or(0, |it| it.bytes_after(frame));
        let length = self.layout.counted_length(frame);
        let end = length.saturating_sub(appended + self.from_end);
        match &self.ends {
            None => true,
            Some(ends) if self.has_truncated_zeros => ends.last().is_some_and(|last| end <= *last),
            Some(ends) => ends.binary_search(&end).is_ok(),
        }
    }

    /// Returns the exclusive end index of each field, in ascending order; `None` if a field takes the rest of the
    /// frame.
    pub(crate) fn ends_of(fields: &[Field]) -> Option<Vec<usize>> {
        let fields = || fields.iter().filter(|field| !field.is_appended);
        if fields().any(|field| field.length().is_none()) {
            return None;
        }
        let mut ends: Vec<usize> = fields().filter_map(|field| field.end(0)).collect();
        ends.sort_unstable();
        Some(ends)
    }

    /// Returns the fields whose values differ between frames.
    pub fn varying_fields(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().filter(|field| field.constant.is_none())
    }

    /// Returns the fields whose values differ between frames, with their contents. Fields for which the frame is too short
    /// are left out.
    pub fn shown<'f>(&'f self, frame: &'f [u8]) -> impl Iterator<Item = (&'f Field, Content<'f>)> {
        let contents = self.contents(frame);
        let fields = self.varying_fields();
        fields.filter_map(move |field| Some((field, contents.of(field)?)))
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
    /// Returns the content of a field, as [`Kind::content`] does.
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
            let length = self.kind.layout.counted_length(self.appended);
            field.bytes(self.appended, length)
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
        self.field.read(self.bytes)
    }
}
