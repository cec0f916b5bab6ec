//! What each byte of a frame is, as far as its description and the bytes that are there tell it.

use std::ops::Range;

use framelock::Verdict;
use framelock_description::{Description, Field, Kind, Type};
use framelock_formats::layout::{Length, Patterns, Written, index};

/// The names of a frame's bytes that begins with these. Those that it has but nobody knows yet are empty.
pub(crate) fn names(description: &Description, bytes: &[u8]) -> Vec<String> {
    let mut common: Option<Vec<String>> = None;
    for kind in &description.kinds {
        let at_least = match kind.layout.judge(bytes) {
            Verdict::Reject(_) if !bytes.is_empty() => continue,
            Verdict::Incomplete { at_least } => at_least,
            _ => bytes.len(),
        };
        let names = names_of(kind, bytes, at_least);
        common = Some(match common {
            None => names,
            // It may be of either.
            Some(other) => {
                let both = names.into_iter().zip(other);
                both.map(|(one, other)| if one == other { one } else { String::new() })
                    .collect()
            }
        });
        // The first that has such a header says the rest.
        if bytes.len() >= kind.layout.header() {
            break;
        }
    }
    common.unwrap_or_default()
}

fn names_of(kind: &Kind, bytes: &[u8], at_least: usize) -> Vec<String> {
    let layout = &kind.layout;
    // What is counted from the end has a place when the length is known.
    let length = match &layout.length {
        Length::Fixed => Some(layout.longest),
        Length::Field(_) if bytes.len() >= kind.layout.header() => Some(at_least),
        Length::Field(_) | Length::Delimiter => None,
    };
    let appended = layout.appendix.filter(|appendix| {
        bytes
            .get(appendix.at)
            .is_some_and(|byte| byte & appendix.mask != 0)
    });
    let whole = length.unwrap_or(at_least.max(kind.layout.header()));
    let alone = whole.saturating_sub(appended.map_or(0, |appendix| appendix.bytes));
    let mut names = vec![String::new(); whole];
    let mut name = |place: Range<usize>, what: &str| {
        for name in names.get_mut(place).unwrap_or_default() {
            if !name.is_empty() {
                name.push(' ');
            }
            name.push_str(what);
        }
    };
    let is_here = |field: &&Field| !field.is_appended && (field.at >= 0 || length.is_some());
    for field in kind.fields.iter().filter(is_here) {
        // What takes all that is left goes on, as long as nobody knows where it ends.
        let until = alone + length.map_or(field.margin, |_| 0);
        for number in 0..field.values() {
            let what = match field.is_array() {
                true => format!("{}{}", field.name, number + 1),
                false => field.name.clone(),
            };
            name(place(field, number, until).unwrap_or_default(), &what);
        }
    }
    if let Some(field) = kind.fields.iter().find(|field| field.is_appended) {
        name(alone..whole, &field.name);
    }
    // The rest where there is no field.
    let mut rest = |from: usize, what: Vec<String>| {
        for (name, what) in names
            .iter_mut()
            .skip(from)
            .zip(what)
            .filter(|(name, _)| name.is_empty())
        {
            *name = what;
        }
    };
    rest(0, spelled(&layout.sync, "sync"));
    if let Length::Field(field) = &layout.length {
        rest(
            field.number.at,
            vec!["length".to_owned(); field.number.bytes],
        );
    }
    if let Some(messages) = &layout.messages {
        rest(
            messages.number.at,
            vec!["message".to_owned(); messages.number.bytes],
        );
    }
    if let Some(checksum) = layout
        .checksum
        .filter(|checksum| checksum.at >= 0 || length.is_some())
    {
        let digits = if checksum.written == Written::Hex {
            2
        } else {
            1
        };
        let from = index(checksum.at, alone).unwrap_or(whole);
        rest(from, vec!["checksum".to_owned(); digits * checksum.bytes]);
    }
    if length.is_some() {
        let from = alone.saturating_sub(layout.terminator.length);
        rest(from, spelled(&layout.terminator, "terminator"));
    }
    rest(0, vec!["any".to_owned(); whole]);
    names
}

/// The bytes of a field in a frame of that length without its appendix, or of one of its values.
pub(crate) fn place(field: &Field, number: usize, length: usize) -> Option<Range<usize>> {
    let from = index(field.at, length)?;
    let place = match field.kind {
        Type::Number(kind) => number * kind.bytes..(number + 1) * kind.bytes,
        Type::Bits { first, width } => {
            let first = first + number * width;
            first / 8..(first + width).div_ceil(8)
        }
        Type::Bytes | Type::Text => {
            0..field
                .length()
                .unwrap_or(length.saturating_sub(from + field.margin))
        }
    };
    Some(from + place.start..from + place.end)
}

/// The bytes that must be there; if there are several such, only what they are.
fn spelled(patterns: &Patterns, what: &str) -> Vec<String> {
    let is_text = |byte: &u8| matches!(byte, b'\n' | b'\r' | b'!'..=b'~');
    let is_text = patterns.bytes.iter().all(is_text);
    let spell = |byte: &u8| match byte {
        b'\n' if is_text => "LF".to_owned(),
        b'\r' if is_text => "CR".to_owned(),
        _ if is_text => format!("'{}'", char::from(*byte)),
        _ => format!("{byte:02X}"),
    };
    if patterns.each().count() > 1 {
        return vec![what.to_owned(); patterns.length];
    }
    patterns.bytes.iter().map(spell).collect()
}
