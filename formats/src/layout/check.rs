//! Checks that the parts of a layout agree, but not that the layout has any frames.

mod checksum;
mod content;

use core::fmt;

use super::{Layout, Length, Number, Patterns, index, larger};
use checksum::check_checksum;
use content::check_content;

/// A contradiction between the parts of a [`Layout`](super::Layout). The message says which part is wrong, and states
/// the reason.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Contradiction {
    /// The part that is wrong.
    pub part: Part,
    /// The message, without the index of [`Part::Fixed`]. `Display` writes the message and the index.
    pub message: &'static str,
}

/// A part of a [`Layout`](super::Layout), named after the field.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum Part {
    /// The sync.
    Sync,
    /// The length.
    Length,
    /// The length of the shortest frame.
    Shortest,
    /// The length of the longest frame.
    Longest,
    /// The fixed bits with this index.
    Fixed(usize),
    /// The known messages.
    Messages,
    /// The checksum.
    Checksum,
    /// The terminator.
    Terminator,
    /// The bytes after the terminator that belong to the frame.
    Behind,
    /// The content.
    Content,
    /// The other terminators.
    OtherTerminators,
    /// The trailer.
    Trailer,
}

impl Contradiction {
    const fn new(part: Part, message: &'static str) -> Self {
        Self { part, message }
    }
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message)?;
        if let Part::Fixed(index) = self.part {
            write!(f, " (fixed bits with index {index})")?;
        }
        Ok(())
    }
}

impl core::error::Error for Contradiction {}

/// If a step finds a contradiction, makes the calling function return it.
macro_rules! try_step {
    ($step:expr) => {
        if let Err(contradiction) = $step {
            return Err(contradiction);
        }
    };
}

/// Makes the calling function return a contradiction if the condition holds.
macro_rules! reject_if {
    ($condition:expr, $part:expr, $message:expr) => {
        if $condition {
            return Err($crate::layout::Contradiction::new($part, $message));
        }
    };
}
use reject_if;

/// Returns the first contradiction of a layout.
pub(super) const fn check(layout: &Layout) -> Result<(), Contradiction> {
    try_step!(check_each_part(layout));
    try_step!(check_content(layout));
    try_step!(check_bounds(layout));
    try_step!(check_fixed_bits(layout));
    if let Some(trailer) = &layout.trailer {
        reject_if!(
            layout.shortest.saturating_add(trailer.bytes) > layout.longest,
            Part::Trailer,
            "trailer: the shortest frame with a trailer is longer than longest: raise longest"
        );
    }
    try_step!(check_checksum(layout, layout.shortest));
    check_checksum(layout, without_trailer(layout))
}

/// Returns the minimum number of bytes in a frame: the header, and the parts that are counted from the end.
pub(super) const fn least(layout: &Layout) -> usize {
    // A frame may consist of only the delimiter.
    let header = match layout.length {
        Length::Delimiter if layout.sync.length == 0 && layout.messages.is_none() => 0,
        _ => layout.header(),
    };
    let mut from_end = layout.terminator.length.saturating_add(layout.behind);
    // In a format of fixed length, these parts may lie in the header, because their offsets from the start are fixed
    // too.
    if !matches!(layout.length, Length::Fixed) {
        if let Some(checksum) = &layout.checksum {
            from_end = larger(from_end, distance_from_end(checksum.at));
        }
        let mut rest = layout.fixed;
        while let [bits, others @ ..] = rest {
            from_end = larger(from_end, distance_from_end(bits.at));
            rest = others;
        }
    }
    let parts = header.saturating_add(from_end);
    match layout.length {
        Length::Field(field) if field.plus > 0 => larger(parts, field.plus.unsigned_abs() as usize),
        _ => parts,
    }
}

const fn distance_from_end(place: i16) -> usize {
    if place.is_negative() {
        place.unsigned_abs() as usize
    } else {
        0
    }
}

/// Checks everything that does not depend on a frame's length, except the content and the checksum.
const fn check_each_part(layout: &Layout) -> Result<(), Contradiction> {
    reject_if!(
        !are_whole(&layout.sync),
        Part::Sync,
        "sync: its bytes must be one pattern or more, each of the given length"
    );
    reject_if!(
        !are_whole(&layout.terminator),
        Part::Terminator,
        "terminator: its bytes must be one pattern or more, each of the given length"
    );
    let [other, another] = &layout.other_terminators;
    reject_if!(
        !(are_whole(other) && are_whole(another)),
        Part::OtherTerminators,
        "other terminators: the bytes must be one pattern or more, each of the given length"
    );
    reject_if!(
        layout.sync.length == 0
            && layout.terminator.length == 0
            && layout.checksum.is_none()
            && layout.fixed.is_empty()
            && !matches!(layout.length, Length::Silence),
        Part::Sync,
        "sync: nothing tells a frame from noise: give a sync, fixed bits, a checksum or a terminator"
    );
    reject_if!(
        layout.behind > 0
            && (!matches!(layout.length, Length::Delimiter) || layout.has_other_terminators()),
        Part::Behind,
        "behind: only frames that one delimiter ends can have bytes behind the terminator"
    );
    match &layout.length {
        Length::Fixed | Length::Silence => {}
        Length::Delimiter => reject_if!(
            layout.terminator.length == 0,
            Part::Terminator,
            "terminator: a delimiter ends each frame, but there is no terminator: give one"
        ),
        Length::Field(field) => {
            reject_if!(
                !is_number(&field.number),
                Part::Length,
                "length: the length field must have 1 to 4 bytes"
            );
            reject_if!(
                field.mask & all_bits(&field.number) == 0 || field.factor == 0,
                Part::Length,
                "length: with this mask or factor every length is the same: neither may be 0, and the mask needs \
                 bits that the number has"
            );
        }
    }
    if let Some(messages) = &layout.messages {
        reject_if!(
            !is_number(&messages.number),
            Part::Messages,
            "messages: the number must have 1 to 4 bytes"
        );
        let mut rest = messages.known;
        while let [one, others @ ..] = rest {
            if let [next, ..] = others {
                reject_if!(
                    one.number >= next.number,
                    Part::Messages,
                    "messages: the numbers are not in ascending order, or one is listed twice"
                );
            }
            rest = others;
        }
    }
    if let Some(trailer) = &layout.trailer {
        let is_announced = trailer.mask != 0 && matches!(layout.length, Length::Field(_));
        reject_if!(
            !is_announced || trailer.bytes == 0,
            Part::Trailer,
            "trailer: only frames with a length field can have one, of 1 byte or more, which a mask announces"
        );
    }
    Ok(())
}

/// Checks the lengths of the shortest and the longest frame.
pub(crate) const fn check_bounds(layout: &Layout) -> Result<(), Contradiction> {
    let (shortest, longest) = (layout.shortest, layout.longest);
    let is_fixed = matches!(layout.length, Length::Fixed);
    reject_if!(
        is_fixed && longest < least(layout),
        Part::Longest,
        "longest: the header and the terminator do not fit into a frame of this length"
    );
    reject_if!(
        longest < shortest,
        Part::Longest,
        "longest: it is less than shortest, or too short for the bytes that every frame has"
    );
    reject_if!(
        is_fixed && shortest < longest,
        Part::Shortest,
        "shortest: each frame has exactly longest bytes: leave shortest out, or give a length field or a delimiter"
    );
    reject_if!(
        shortest < least(layout),
        Part::Shortest,
        "shortest: a frame of this length has no room for its header and for the parts that are counted from the end"
    );
    let most = match &layout.trailer {
        Some(trailer) => without_trailer(layout).saturating_add(trailer.bytes),
        None => without_trailer(layout),
    };
    reject_if!(
        longest > most,
        Part::Longest,
        "longest: it is more than the greatest length that the length field can give"
    );
    Ok(())
}

/// Checks that every frame contains the bytes of the fixed bits.
const fn check_fixed_bits(layout: &Layout) -> Result<(), Contradiction> {
    let (mut number, mut rest) = (0_usize, layout.fixed);
    while let [bits, others @ ..] = rest {
        let is_inside = matches!(index(bits.at, layout.shortest), Some(at) if at < layout.shortest);
        reject_if!(
            !is_inside,
            Part::Fixed(number),
            "fixed: the shortest frame has no byte at this offset: give a greater shortest"
        );
        (number, rest) = (number.wrapping_add(1), others);
    }
    Ok(())
}

/// Returns the length of the longest frame without a trailer.
pub(super) const fn without_trailer(layout: &Layout) -> usize {
    let Length::Field(field) = &layout.length else {
        return layout.longest;
    };
    let number = field.value(all_bits(&field.number));
    let counted = (number as u64).wrapping_mul(field.factor as u64);
    let most = counted.saturating_add_signed(field.plus as i64);
    if most < layout.longest as u64 {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the result fits into a usize"
        )]
        return most as usize;
    }
    layout.longest
}

/// Returns true if the bytes are one or more whole patterns. If the length of a pattern is 0, there must be no bytes.
const fn are_whole(patterns: &Patterns) -> bool {
    match patterns.bytes.len().checked_rem(patterns.length) {
        Some(rest) => rest == 0 && !patterns.bytes.is_empty(),
        None => patterns.bytes.is_empty(),
    }
}

const fn is_number(number: &Number) -> bool {
    1 <= number.bytes && number.bytes <= 4
}

/// Returns the mask of all bits of a number of 1 to 4 bytes.
const fn all_bits(number: &Number) -> u32 {
    match number.bytes {
        1 => 0xFF,
        2 => 0xFFFF,
        3 => 0xFF_FFFF,
        _ => u32::MAX,
    }
}

/// Returns the value at an index.
const fn get<T: Copy>(values: &[T], index: usize) -> Option<T> {
    match values.split_at_checked(index) {
        Some((_, [value, ..])) => Some(*value),
        _ => None,
    }
}
