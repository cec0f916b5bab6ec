//! What each byte of a frame is, as far as its description and the bytes that are there tell it.

use std::ops::Range;

use framelock::Verdict;
use framelock_description::{Description, Field, Kind, Type};
use framelock_formats::layout::{Length, Written, index};

/// Of a frame that is longer than this, no more bytes are drawn.
pub(crate) const MOST: usize = 64;

/// The names of the first bytes of a frame that begins with these; empty where nobody knows them yet.
pub(crate) fn names(description: &Description, bytes: &[u8]) -> Vec<String> {
    let mut common: Option<Vec<String>> = None;
    for kind in &description.kinds {
        let verdict = kind.layout.judge(bytes);
        if matches!(verdict, Verdict::Reject(_)) && !bytes.is_empty() {
            continue;
        }
        let mut names = names_of(kind, bytes, verdict);
        if let Some(other) = &common {
            // It may be of either.
            names.truncate(other.len());
            let both = names.iter_mut().zip(other);
            both.filter(|(name, other)| *name != *other)
                .for_each(|(name, _)| name.clear());
        }
        common = Some(names);
        // The first that has such a header says the rest.
        if bytes.len() >= kind.layout.header() {
            break;
        }
    }
    common.unwrap_or_default()
}

fn names_of(kind: &Kind, bytes: &[u8], verdict: Verdict) -> Vec<String> {
    let (layout, header) = (&kind.layout, kind.layout.header());
    let is_fixed = layout.length == Length::Fixed;
    // Then what is counted from the end has a place.
    let is_known = is_fixed || bytes.len() >= header && layout.length != Length::Delimiter;
    let whole = match verdict {
        _ if is_fixed => layout.longest,
        Verdict::Incomplete { at_least } => at_least.max(header),
        _ => header,
    };
    let appendix = layout.appendix.filter(|_| is_known);
    let alone = whole - appendix.map_or(0, |it| it.appended_to(bytes)).min(whole);
    let mut fields: Vec<(Range<usize>, String)> = Vec::new();
    for field in &kind.fields {
        if field.is_appended {
            fields.push((alone..whole, field.name.clone()));
        } else if field.at >= 0 || is_known {
            // What takes all that is left goes on, as long as nobody knows where it ends.
            let length = alone + if is_known { 0 } else { field.margin };
            for number in 0..field.values() {
                let place = place(field, number, length);
                fields.extend(place.map(|place| (place, field.column(number))));
            }
        }
    }
    let length = match layout.length {
        Length::Field(field) => field.number.at..field.number.end(),
        _ => 0..0,
    };
    let checksum = layout.checksum.and_then(|it| {
        let bytes = it.bytes * (1 + usize::from(it.written == Written::Hex));
        let from = index(it.at, alone).filter(|_| it.at >= 0 || is_known)?;
        Some(from..from + bytes)
    });
    let end = alone.saturating_sub(usize::from(is_known) * layout.terminator.length);
    let rest = [
        (0..layout.sync.length, "sync"),
        (length, "length"),
        (checksum.unwrap_or_default(), "checksum"),
        (end..alone, "terminator"),
        (0..whole, "any"),
    ];
    let name = |byte: usize| {
        let here = fields.iter().filter(|(place, _)| place.contains(&byte));
        let here: Vec<&str> = here.map(|(_, name)| &**name).collect();
        let rest = rest.iter().find(|(place, _)| place.contains(&byte));
        match (&here[..], rest) {
            ([], Some((_, name))) => (*name).to_owned(),
            _ => here.join(" "),
        }
    };
    (0..whole.min(MOST)).map(name).collect()
}

/// The bytes of one of a field's values, in a frame of that length without its appendix that has it.
fn place(field: &Field, number: usize, length: usize) -> Option<Range<usize>> {
    let from = index(field.at, length)?;
    let rest = length.checked_sub(from + field.margin)?;
    let bytes = field.length().unwrap_or(rest);
    let place = match field.kind {
        Type::Number(kind) => number * kind.bytes..(number + 1) * kind.bytes,
        Type::Bits { first, width } => {
            let first = first + number * width;
            first / 8..(first + width).div_ceil(8)
        }
        Type::Bytes | Type::Text => 0..bytes,
    };
    (bytes <= rest).then_some(from + place.start..from + place.end)
}
