//! Where everything is in a frame.

use std::ops::Range;

use crate::build::checksum;
use crate::kind::Kind;
use crate::written::{Problem, Written, wrong};
use framelock_formats::layout::index;

/// A part of a frame: where in the text it is said, what it is called, its first byte, and which bits from there on.
struct Part<'a> {
    span: Range<usize>,
    name: &'a str,
    from: usize,
    bits: Vec<usize>,
}

/// That in a frame of this length, of `longest` at most, all is in its place, and nothing in that of another.
pub(crate) fn check_places(
    written: &Written,
    kind: &Kind,
    length: usize,
    longest: usize,
) -> Result<(), Problem> {
    let whole = |bytes: usize| (0..8 * bytes).collect();
    let mut parts = Vec::new();
    // Where there are several a field may say which.
    let terminator = written
        .terminator
        .as_ref()
        .filter(|it| it.get_ref().is_one());
    if let Some(terminator) = terminator {
        let bytes = terminator.get_ref().length;
        parts.push(Part {
            span: terminator.span(),
            name: "the terminator",
            from: length.saturating_sub(bytes),
            bits: whole(bytes),
        });
    }
    if let Some(entry) = &written.checksum {
        let check = checksum(entry)?;
        let bytes = entry.get_ref().stored.length();
        let place = |at| index(at, length).unwrap_or(length);
        let (at, from, to) = (place(check.at), place(check.from), place(check.to));
        if from > to + 1 || to >= length || (from < at + bytes && at <= to) {
            let what = format!(
                "in a frame of {length} bytes the checksum is at {at} and covers {from} to {to}: \
                 give from and to, the first and the last byte; it does not cover itself"
            );
            return wrong(entry, what);
        }
        parts.push(Part {
            span: entry.span(),
            name: "the checksum",
            from: at,
            bits: whole(bytes),
        });
    }
    for (field, entry) in kind.fields.iter().zip(&written.fields) {
        let entry = entry.get_ref();
        if length < longest && kind.shortest_with(field).is_some() {
            match &entry.value {
                Some(value) => {
                    return wrong(value, "a frame may be too short for this: give shortest");
                }
                None => continue,
            }
        }
        let position = field.position(length);
        let mut bits = Vec::new();
        if let Some(bytes) = &position {
            field.each_bit(bytes.len(), |place, _, _| bits.push(place));
        } else if field.length().is_some() {
            bits.push(0);
        }
        parts.push(Part {
            span: entry.at.span(),
            name: &field.name,
            // Past the end, if the frame has no room for it.
            from: position.map_or(length, |bytes| bytes.start),
            bits,
        });
    }
    let mut taken = vec![0_usize; 8 * length];
    for (number, part) in (1..).zip(&parts) {
        for bit in &part.bits {
            let Some(owner) = taken.get_mut(8 * part.from + bit) else {
                let what = format!("{} is not in a frame of {length} bytes", part.name);
                return Err(Problem(part.span.clone(), what));
            };
            let before = std::mem::replace(owner, number);
            if let Some(other) = parts.get(before.wrapping_sub(1)) {
                let what = format!("{} is in the place of {}", part.name, other.name);
                return Err(Problem(part.span.clone(), what));
            }
        }
    }
    Ok(())
}
