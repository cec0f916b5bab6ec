//! The positions of all parts in a frame, and the lengths of frames.
//!
//! In this module, a frame does not include its trailer, as in the [`Layout`](framelock_formats::Layout): the trailer
//! follows the frame.

use std::fmt;
use std::ops::Range;

use framelock_formats::layout::{Checksum, Length, index};

use crate::field::Field;
use crate::kind::Kind;

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

impl fmt::Display for Part<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sync => f.write_str("sync"),
            Self::Length => f.write_str("length"),
            Self::Checksum => f.write_str("checksum"),
            Self::Terminator => f.write_str("terminator"),
            Self::Value(field, number) => f.write_str(&field.column(*number)),
        }
    }
}

impl Field {
    /// Returns the index after the field's last byte if the field is counted from the front. `rest` is the number of bytes
    /// of a field that takes the rest of the frame.
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

    /// Returns the range of one of the field's values in a frame of `length` bytes.
    fn value_position(&self, number: usize, length: usize) -> Option<Range<usize>> {
        let all = self.position(length)?;
        let bytes = self.value_bytes(number, all.len());
        Some(all.start + bytes.start..all.start + bytes.end)
    }
}

impl Kind {
    /// Returns the parts of a frame of `length` bytes and their positions. Fields come first, and may share bytes with
    /// other parts. If the frame is incomplete, leaves out parts that are counted from the end, and extends a field
    /// that takes the rest to `length`.
    #[must_use]
    pub fn positions(&self, length: usize, is_whole: bool) -> Vec<(Part<'_>, Range<usize>)> {
        let mut positions = Vec::new();
        let fields = self.fields.iter().filter(|field| !field.is_appended);
        for field in fields.filter(|field| is_whole || field.at >= 0) {
            let length = length + if is_whole { 0 } else { field.margin };
            for number in 0..field.values() {
                let bytes = field.value_position(number, length);
                positions.extend(bytes.map(|bytes| (Part::Value(field, number), bytes)));
            }
        }
        positions.push((Part::Sync, 0..self.layout.sync.length));
        if let Length::Field(field) = self.layout.length {
            positions.push((Part::Length, field.number.at..field.number.end()));
        }
        let checksum = self.layout.checksum;
        let checksum = checksum.filter(|checksum| is_whole || checksum.at >= 0);
        let checksum = checksum.and_then(|checksum| checksum_position(&checksum, length));
        positions.extend(checksum.map(|bytes| (Part::Checksum, bytes)));
        if is_whole {
            let from = length.saturating_sub(self.layout.terminator.length);
            positions.push((Part::Terminator, from..length));
        }
        positions
    }

    /// Returns the length of the shortest frame that contains a field; `None` if every frame contains it.
    #[must_use]
    pub fn shortest_with(&self, field: &Field) -> Option<usize> {
        if field.is_appended {
            return Some(self.layout.shortest);
        }
        let shortest = field.end(0)? + field.margin;
        (shortest > self.layout.shortest).then_some(shortest)
    }

    /// Returns the length of the shortest frame with room for three things: the header, fields with these
    /// [`end`](Field::end)s, and all parts that are counted from the end. The format's shortest frame may be longer. If
    /// all frames have the same length, returns this length.
    pub fn least_length(&self, ends: impl IntoIterator<Item = usize>) -> usize {
        match self.layout.length {
            Length::Fixed => self.layout.longest,
            _ => ends.into_iter().fold(self.header, usize::max) + self.from_end,
        }
    }

    /// Returns a divisor and a remainder: the length of each frame is a multiple of the divisor, plus the remainder.
    /// Returns `None` if any length is possible.
    #[must_use]
    pub fn multiple(&self) -> Option<(usize, usize)> {
        let Length::Field(field) = self.layout.length else {
            return None;
        };
        let factor = i64::from(field.factor);
        let more = i64::from(field.plus).checked_rem_euclid(factor)?;
        let [factor, more] = [factor, more].map(usize::try_from);
        factor.ok().zip(more.ok()).filter(|(factor, _)| *factor > 1)
    }

    /// Returns the smallest length that a frame can have and that is not below `length`.
    #[must_use]
    pub fn next_length(&self, length: usize) -> usize {
        match self.multiple() {
            Some((factor, more)) => length + (factor + more - length % factor) % factor,
            None => length,
        }
    }
}

/// Returns the range of a checksum in a frame of `length` bytes; `None` if the frame is shorter than the checksum's distance
/// from the end.
pub(crate) fn checksum_position(checksum: &Checksum, length: usize) -> Option<Range<usize>> {
    let from = index(checksum.at, length)?;
    Some(from..from + checksum.encoded_bytes())
}
