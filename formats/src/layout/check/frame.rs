//! The search for the shortest frame that a layout allows.

use super::{all_bits, get};
use crate::layout::{
    ByteOrder, Contradiction, FixedBits, KnownMessage, Layout, Length, LengthField, Number, Part,
    index,
};

/// Returns the length of the shortest frame, without a trailer, that the header allows.
pub(super) const fn shortest_frame(layout: &Layout) -> Result<usize, Contradiction> {
    let mut found = Found {
        has_sync: false,
        has_message: layout.messages.is_none(),
        length: usize::MAX,
    };
    let mut syncs = layout.sync.bytes;
    while let Some((sync, others)) = syncs.split_at_checked(layout.sync.length) {
        if sync_agrees(layout, sync) {
            found.has_sync = true;
            found = with_sync(layout, sync, found);
        }
        if others.is_empty() {
            break;
        }
        syncs = others;
    }
    let (part, message) = if !found.has_sync {
        (
            Part::Sync,
            "sync: the fixed bits at its offset have other values",
        )
    } else if !found.has_message {
        (
            Part::Messages,
            "messages: no known number fits into its bytes and agrees with the sync and the fixed bits",
        )
    } else if found.length < usize::MAX {
        return Ok(found.length);
    } else if matches!(layout.length, Length::Delimiter) {
        (
            Part::Terminator,
            "terminator: the fixed bits or the message contain it, so every frame would end too early",
        )
    } else {
        (
            Part::Length,
            "length: no number that the length field can hold gives a frame of shortest to longest bytes",
        )
    };
    Err(Contradiction::new(part, message))
}

/// The result of the search so far.
#[derive(Clone, Copy)]
struct Found {
    /// Whether a sync agrees with the fixed bits.
    has_sync: bool,
    /// Whether a known message agrees with the other parts.
    has_message: bool,
    /// The length of the shortest frame. `usize::MAX` if there is no frame.
    length: usize,
}

/// Updates the result with the shortest frames that have this sync.
const fn with_sync(layout: &Layout, sync: &[u8], mut found: Found) -> Found {
    let Some(messages) = &layout.messages else {
        return with_length(layout, sync, None, found);
    };
    let mut rest = messages.known;
    while let [message, others @ ..] = rest {
        if message_agrees(layout, sync, &messages.number, *message) {
            found.has_message = true;
            found = with_length(layout, sync, Some(*message), found);
        }
        rest = others;
    }
    found
}

/// Updates the result with the shortest frame that has this sync and this message.
const fn with_length(
    layout: &Layout,
    sync: &[u8],
    message: Option<KnownMessage>,
    mut found: Found,
) -> Found {
    let length = match &layout.length {
        Length::Fixed => Some(layout.longest),
        Length::Delimiter
            if ends_early(layout, layout.shortest, sync, message)
                && ends_early(layout, layout.longest, sync, message) =>
        {
            None
        }
        Length::Delimiter => Some(layout.shortest),
        Length::Field(field) => shortest_length(layout, field, sync, message),
    };
    if let Some(length) = length {
        if length < found.length {
            found.length = length;
        }
    }
    found
}

/// Returns the shortest length that a length field can give.
const fn shortest_length(
    layout: &Layout,
    field: &LengthField,
    sync: &[u8],
    message: Option<KnownMessage>,
) -> Option<usize> {
    let (mut known, mut values, mut byte) = (0_u32, 0_u32, 0_usize);
    while byte < field.number.bytes {
        let at = field.number.at.saturating_add(byte);
        let (mask, value) = known_bits(layout, layout.shortest, sync, message, at);
        let shift = shift_of(&field.number, byte);
        known |= (mask as u32).wrapping_shl(shift);
        values |= (value as u32).wrapping_shl(shift);
        byte = byte.wrapping_add(1);
    }
    if field.factor == 0 {
        return None;
    }
    let bits = (field.mask & all_bits(&field.number)) as u64;
    let (known, values) = (known as u64 & bits, (values & known) as u64 & bits);
    let wanted = (layout.shortest as u64).saturating_add_signed((field.plus as i64).wrapping_neg());
    let wanted = wanted.div_ceil(field.factor as u64);
    let Some(number) = smallest(wanted, bits, known, values) else {
        return None;
    };
    if let Some(message) = message {
        if number > message.longest_payload as u64 {
            return None;
        }
    }
    let counted = number.wrapping_mul(field.factor as u64);
    let length = counted.saturating_add_signed(field.plus as i64);
    if length > layout.longest as u64 {
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the result fits into a usize"
    )]
    Some(length as usize)
}

/// Returns the smallest number that is at least `from`, has no bits outside `bits`, and agrees with the known bits.
const fn smallest(from: u64, bits: u64, known: u64, values: u64) -> Option<u64> {
    if from & !bits == 0 && from & known == values {
        return Some(from);
    }
    // Otherwise the result is greater than `from`. The highest bit in which the two differ is 1 in the result and 0 in
    // `from`. Below this bit, the result has the smallest possible value.
    let mut bit = 1_u64;
    while bit != 0 {
        let below = bit.wrapping_sub(1);
        let above = from & !(bit | below);
        let is_possible = above & !bits == 0 && (above ^ values) & known & !(bit | below) == 0;
        let may_be_set = bits & bit != 0 && (known & bit == 0 || values & bit != 0);
        if from & bit == 0 && is_possible && may_be_set {
            return Some(above | bit | values & below);
        }
        bit <<= 1;
    }
    None
}

/// Returns which bits of the byte at index `at` are the same in every frame of `length` bytes with this sync and
/// message: the mask of these bits, and their values.
const fn known_bits(
    layout: &Layout,
    length: usize,
    sync: &[u8],
    message: Option<KnownMessage>,
    at: usize,
) -> (u8, u8) {
    if let Some(byte) = get(sync, at) {
        return (u8::MAX, byte);
    }
    if let (Some(messages), Some(message)) = (&layout.messages, message) {
        let number = &messages.number;
        if number.at <= at && at < number.end() {
            return (
                u8::MAX,
                byte_of(number, message.number, at.wrapping_sub(number.at)),
            );
        }
    }
    let (mut mask, mut value, mut rest) = (0, 0, layout.fixed);
    while let [bits, others @ ..] = rest {
        if is_at(*bits, length, at) {
            (mask, value) = (mask | bits.mask, value | bits.value);
        }
        rest = others;
    }
    (mask, value)
}

const fn sync_agrees(layout: &Layout, sync: &[u8]) -> bool {
    let (mut at, mut rest) = (0_usize, sync);
    while let [byte, others @ ..] = rest {
        if !agrees_with_fixed(layout.fixed, layout.shortest, at, *byte, u8::MAX) {
            return false;
        }
        (at, rest) = (at.wrapping_add(1), others);
    }
    true
}

/// Returns true if the message's number fits into the number's bytes, and agrees with the other parts of the header.
const fn message_agrees(
    layout: &Layout,
    sync: &[u8],
    number: &Number,
    message: KnownMessage,
) -> bool {
    let mut byte = 0_usize;
    while byte < number.bytes {
        let at = number.at.saturating_add(byte);
        let value = byte_of(number, message.number, byte);
        let has_other_sync = match get(sync, at) {
            Some(other) => other != value,
            None => !layout.content.is_empty() && !is_content(layout, value),
        };
        if has_other_sync || !agrees_with_fixed(layout.fixed, layout.shortest, at, value, u8::MAX) {
            return false;
        }
        byte = byte.wrapping_add(1);
    }
    message.number & !all_bits(number) == 0
}

/// Returns true if every frame of `length` bytes must contain a terminator before its end.
const fn ends_early(
    layout: &Layout,
    length: usize,
    sync: &[u8],
    message: Option<KnownMessage>,
) -> bool {
    let mut fixed = layout.fixed;
    while let [bits, others @ ..] = fixed {
        if let Some(at) = index(bits.at, length) {
            if ends_early_at(layout, length, sync, message, at) {
                return true;
            }
        }
        fixed = others;
    }
    if let (Some(messages), Some(_)) = (&layout.messages, message) {
        let mut at = messages.number.at;
        while at < messages.number.end() {
            if ends_early_at(layout, length, sync, message, at) {
                return true;
            }
            at = at.saturating_add(1);
        }
    }
    false
}

/// Returns true if the bytes from index `at` on are a terminator in every frame of `length` bytes.
const fn ends_early_at(
    layout: &Layout,
    length: usize,
    sync: &[u8],
    message: Option<KnownMessage>,
    at: usize,
) -> bool {
    let width = layout.terminator.length;
    if at < sync.len() || length.saturating_sub(width) <= at {
        return false;
    }
    let mut terminators = layout.terminator.bytes;
    while let Some((terminator, others)) = terminators.split_at_checked(width) {
        let (mut place, mut rest, mut is_there) = (at, terminator, true);
        while let [byte, behind @ ..] = rest {
            let (mask, value) = known_bits(layout, length, sync, message, place);
            is_there &= mask == u8::MAX && value == *byte;
            (place, rest) = (place.wrapping_add(1), behind);
        }
        if is_there {
            return true;
        }
        if others.is_empty() {
            break;
        }
        terminators = others;
    }
    false
}

/// Returns true if a terminator agrees with the fixed bits at the end of the frame.
pub(super) const fn ends_with_a_terminator(layout: &Layout, length: usize) -> bool {
    let from = length.saturating_sub(layout.terminator.length);
    let mut terminators = layout.terminator.bytes;
    while let Some((terminator, others)) = terminators.split_at_checked(layout.terminator.length) {
        let (mut at, mut rest, mut agrees) = (from, terminator, true);
        while let [byte, behind @ ..] = rest {
            agrees &= agrees_with_fixed(layout.fixed, length, at, *byte, u8::MAX);
            (at, rest) = (at.wrapping_add(1), behind);
        }
        if agrees {
            return true;
        }
        if others.is_empty() {
            break;
        }
        terminators = others;
    }
    false
}

/// Returns true if some byte with these bits is content.
pub(super) const fn agrees_with_content(layout: &Layout, value: u8, mask: u8) -> bool {
    let mut byte = 0_u8;
    loop {
        if byte & mask == value && is_content(layout, byte) {
            return true;
        }
        byte = match byte.checked_add(1) {
            Some(next) => next,
            None => return false,
        };
    }
}

/// Returns true if a byte is content.
pub(super) const fn is_content(layout: &Layout, byte: u8) -> bool {
    let mut rest = layout.content;
    while let [(first, last), others @ ..] = rest {
        if *first <= byte && byte <= *last {
            return true;
        }
        rest = others;
    }
    false
}

/// Returns true if the fixed bits of a frame of `length` bytes allow its byte at index `at` to equal `byte`. Compares
/// only the bits of `mask`.
pub(super) const fn agrees_with_fixed(
    fixed: &[FixedBits],
    length: usize,
    at: usize,
    byte: u8,
    mask: u8,
) -> bool {
    let mut rest = fixed;
    while let [bits, others @ ..] = rest {
        if is_at(*bits, length, at) && (bits.value ^ byte) & bits.mask & mask != 0 {
            return false;
        }
        rest = others;
    }
    true
}

const fn is_at(bits: FixedBits, length: usize, at: usize) -> bool {
    match index(bits.at, length) {
        Some(place) => place == at,
        None => false,
    }
}

/// Encodes `value` as the frame encodes this number, and returns the byte with index `byte` of the result.
const fn byte_of(number: &Number, value: u32, byte: usize) -> u8 {
    let [lowest, ..] = value.wrapping_shr(shift_of(number, byte)).to_le_bytes();
    lowest
}

/// Returns by how many bits to shift the number to get the byte with index `byte` of its encoding.
const fn shift_of(number: &Number, byte: usize) -> u32 {
    let below = match number.order {
        ByteOrder::Little => byte,
        ByteOrder::Big => number.bytes.saturating_sub(byte).saturating_sub(1),
    };
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a number has 4 bytes at most"
    )]
    (below as u32).wrapping_mul(8)
}
