//! A kind of frames: its layout, its fields, and the values of the fields in a frame.

use std::fmt;
use std::ops::Range;

use framelock_formats::layout::{ByteOrder, CheckedLayout, Length, index};

use crate::field::Field;
use crate::layouts::{Layouts, header};
use crate::number::{Class, NumberType};
use crate::pattern::Pattern;

/// The largest length that a description may allow for a frame: the largest 16-bit number plus 256.
pub const LONGEST: usize = 0x1_00FF;

/// One kind of frames: their layout and their fields.
#[derive(Clone, Debug)]
pub struct Kind {
    /// The name of the kind.
    pub name: String,
    /// The layout of the kind alone.
    pub(crate) layouts: Layouts,
    /// The fields in the order of the description, including those that have the same value in every frame.
    pub fields: Vec<Field>,
    /// If this is a view: the length of the shortest frame that has one of the view's own fields, and of the shortest
    /// frame that has all of them.
    pub(crate) room: (usize, usize),
    /// The number of bytes at the frame's end that hold the terminator and all parts whose positions are counted from
    /// the end.
    pub from_end: usize,
    /// The views. Each view has fields for the values of one message or text. A view matches a frame that has the
    /// view's identifying bytes or text. A frame is shown by the first matching view whose fields all fit. If there is
    /// no such view, the frame is shown by the first matching view of which at least one field fits.
    pub views: Vec<Kind>,
    /// If this is a view: the bytes that identify the view's frames, and the index of the first of these bytes. If
    /// there are no such bytes, the beginning of the frame's text identifies the frames.
    pub sign: (usize, Vec<u8>),
    /// The patterns of the frame's text. If there are several patterns, a frame may have values of each.
    pub texts: Vec<Pattern>,
    /// The index of the first byte of the frame's text. The text ends before the last [`from_end`](Self::from_end)
    /// bytes.
    pub text_at: usize,
    /// Whether the sender leaves out zero bytes at the end of the payload.
    pub has_truncated_zeros: bool,
    /// The numbers and names of messages, in ascending order of the numbers.
    pub message_names: Vec<(u32, &'static str)>,
}

/// A part of a frame. `Display` writes the part's name: `sync` for example, or the column of a value.
#[derive(Clone, Copy, Debug)]
pub enum Part<'k> {
    /// The bytes that a frame begins with.
    Sync,
    /// The number that determines the frame's length.
    Length,
    /// The checksum, as it is encoded in the frame: in hex, each byte of the checksum takes two bytes of the frame.
    Checksum,
    /// The bytes that a frame ends with.
    Terminator,
    /// A value of a field and its index, from 0. Only arrays have several values.
    Value(&'k Field, usize),
}

impl Part<'_> {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Sync => "sync",
            Self::Length => "length",
            Self::Checksum => "checksum",
            Self::Terminator => "terminator",
            Self::Value(..) => "value",
        }
    }
}

impl fmt::Display for Part<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value(field, number) => f.write_str(&field.column(*number)),
            other => f.write_str(other.name()),
        }
    }
}

impl Kind {
    /// Returns a part of the layout that shares a bit with this field in a frame of `length` bytes. A sync with several
    /// alternatives does not count, because a field may select one of them. For the same reason, a terminator with
    /// several alternatives does not count if they all have the same length.
    pub(crate) fn overlapped(
        &self,
        field: &Field,
        bytes: Range<usize>,
        length: usize,
    ) -> Option<Part<'static>> {
        let layout = self.layout();
        let has_one_length = layout.other_terminators.iter().all(|end| end.length == 0);
        let masks = field.masks(bytes.len());
        let overlaps = |(part, place): &(Part, Range<usize>)| {
            let is_choice = match part {
                Part::Sync => layout.sync.each().count() > 1,
                Part::Terminator => has_one_length && layout.terminator.each().count() > 1,
                _ => false,
            };
            let mask_at = |byte: usize| match (part, layout.length) {
                (Part::Length, Length::Field(field)) => match field.number.order {
                    ByteOrder::Little => field.mask >> (8 * byte),
                    ByteOrder::Big => field.mask >> (8 * (place.len() - 1 - byte)),
                },
                _ => u32::MAX,
            };
            let shares_bit = |(byte, (mask, _)): (&usize, &(u8, u8))| {
                let at = bytes.start + byte;
                place.contains(&at) && mask_at(at - place.start) & u32::from(*mask) != 0
            };
            !is_choice && masks.iter().any(shares_bit)
        };
        let mut parts = self.layout_parts(length, true).into_iter();
        parts.find(overlaps).map(|(part, _)| part)
    }

    /// Returns the layout of a frame.
    #[must_use]
    #[inline]
    pub fn layout(&self) -> &CheckedLayout<'_> {
        &self.layouts.all()[0]
    }

    /// Returns the kind and its views.
    pub(crate) fn with_views(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.views)
    }

    /// Returns the parts of a frame of `length` bytes, without its trailer, and their positions. Fields come first, and
    /// may share bytes with other parts. If the frame is incomplete, leaves out parts that are counted from the end,
    /// and extends a field that takes the rest to `length`.
    #[must_use]
    pub fn parts(&self, length: usize, is_whole: bool) -> Vec<(Part<'_>, Range<usize>)> {
        let mut parts = Vec::new();
        let fields = self.fields.iter().filter(|field| !field.is_appended);
        for field in fields.filter(|field| is_whole || field.at >= 0) {
            let (count, all) = field.present(length + if is_whole { 0 } else { field.margin });
            for number in 0..count {
                let bytes = field.value_bytes(number, all.len());
                parts.push((
                    Part::Value(field, number),
                    all.start + bytes.start..all.start + bytes.end,
                ));
            }
        }
        parts.extend(self.layout_parts(length, is_whole));
        parts
    }

    /// Returns the positions of the parts that are not fields.
    fn layout_parts(&self, length: usize, is_whole: bool) -> Vec<(Part<'static>, Range<usize>)> {
        let layout = self.layout();
        let mut parts = vec![(Part::Sync, 0..layout.sync.length)];
        if let Length::Field(field) = layout.length {
            parts.push((Part::Length, field.number.at..field.number.end()));
        }
        if let Some(checksum) = layout
            .checksum
            .filter(|checksum| is_whole || checksum.at >= 0)
            && let Some(from) = index(checksum.at, length)
        {
            parts.push((Part::Checksum, from..from + checksum.encoded_bytes()));
        }
        if is_whole {
            let end = length.saturating_sub(layout.behind);
            parts.push((Part::Terminator, layout.terminator_at(length)..end));
        }
        parts
    }

    /// Returns the length of the shortest frame that contains a field; `None` if every frame contains it.
    #[must_use]
    pub fn shortest_with(&self, field: &Field) -> Option<usize> {
        if field.is_appended {
            return Some(self.layout().shortest);
        }
        let shortest = field.end(0)? + field.margin;
        (shortest > self.layout().shortest).then_some(shortest)
    }

    /// Returns the length of the shortest frame with room for three things: the header, fields with these
    /// [`end`](Field::end)s, and all parts that are counted from the end. The format's shortest frame may be longer. If
    /// all frames have the same length, returns this length.
    pub fn least_length(&self, ends: impl IntoIterator<Item = usize>) -> usize {
        match self.layout().length {
            Length::Fixed => self.layout().longest,
            _ => ends.into_iter().fold(header(self.layout()), usize::max) + self.from_end,
        }
    }

    /// Returns a divisor and a remainder: the length of each frame is a multiple of the divisor, plus the remainder.
    /// Returns `None` unless the frames have a length field with a factor greater than 1.
    #[must_use]
    pub fn multiple(&self) -> Option<(usize, usize)> {
        let Length::Field(field) = self.layout().length else {
            return None;
        };
        let factor = field.factor as usize;
        let more = i64::from(field.plus).checked_rem_euclid(field.factor.into())?;
        (factor > 1).then_some((factor, usize::try_from(more).ok()?))
    }

    /// For a sender that leaves out zeros, returns the index of the first byte that may be left out.
    #[must_use]
    pub fn first_zero(&self) -> usize {
        let shortest = self.layout().shortest.saturating_sub(self.from_end);
        header(self.layout()).max(shortest) + 1
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
        let number = self.message_number(frame)?;
        let names = &self.message_names;
        let place = names.binary_search_by_key(&number, |(number, _)| u64::from(*number));
        Some(names[place.ok()?].1)
    }

    /// Returns the number of the message in a frame.
    pub(crate) fn message_number(&self, frame: &[u8]) -> Option<u64> {
        let number = self.layout().messages?.number;
        let number_type = NumberType {
            class: Class::Unsigned,
            bytes: number.bytes,
            order: number.order,
        };
        Some(number_type.bits(frame.get(number.at..number.end())?))
    }

    /// Returns true if the condition holds for the name of the kind or of one of its messages.
    #[must_use]
    pub fn has_name(&self, is_wanted: impl Fn(&str) -> bool) -> bool {
        is_wanted(&self.name) || self.message_names.iter().any(|(_, name)| is_wanted(name))
    }

    /// Returns the index of the view that shows a frame; `None` if no view fits the frame's values and length.
    #[inline]
    pub(crate) fn view_of(&self, frame: &[u8]) -> Option<usize> {
        let mut shown = None;
        for (number, view) in self.views.iter().enumerate() {
            match view.shows(frame) {
                Some(true) => return Some(number),
                Some(false) => shown = shown.or(Some(number)),
                None => {}
            }
        }
        shown
    }

    /// Returns whether a frame has room for all of the view's fields; `None` if the frame does not have the view's
    /// identifying bytes or text, or has room for no field. Zeros that the sender has left out count as present.
    #[inline]
    fn shows(&self, frame: &[u8]) -> Option<bool> {
        let (at, bytes) = &self.sign;
        if frame.get(*at..at + bytes.len()) != Some(bytes) {
            return None;
        }
        let trailer = self
            .layout()
            .trailer
            .map_or(0, |trailer| trailer.bytes_after(frame));
        let length = self.layout().counted_length(frame) - trailer;
        let has_text = bytes.is_empty() && !self.texts.is_empty();
        let (one, all) = self.room;
        let has = |least: usize| self.has_truncated_zeros || length >= least;
        (has(one) && (!has_text || self.has_text(frame, length))).then(|| has(all))
    }

    #[inline(never)]
    fn has_text(&self, frame: &[u8], length: usize) -> bool {
        let text = frame.get(self.text_at..length.saturating_sub(self.from_end));
        let mut texts = self.texts.iter();
        text.is_some_and(|text| texts.any(|pattern| pattern.begins(text)))
    }

    /// Returns the fields whose values differ between frames.
    pub fn varying_fields(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().filter(|field| field.constant.is_none())
    }
}
