//! What each byte of a frame is, as far as its description and the bytes that are there tell it.

use framelock::Classification;
use framelock_description::{Description, Kind, Part};
use framelock_formats::layout::Length;

/// Of a frame that is longer than this, no more bytes are drawn.
pub(crate) const MOST: usize = 64;

/// The names of the first bytes of a frame that begins with these; empty where nobody knows them yet.
pub(crate) fn names(description: &Description, bytes: &[u8]) -> Vec<String> {
    let mut common: Option<Vec<String>> = None;
    for kind in &description.kinds {
        let classification = kind.layout.classify(bytes);
        if matches!(classification, Classification::Rejected(_)) && !bytes.is_empty() {
            continue;
        }
        let mut names = names_of(kind, bytes, classification);
        if let Some(other) = &common {
            // It may be of either.
            names.truncate(other.len());
            let both = names.iter_mut().zip(other);
            both.filter(|(name, other)| *name != *other)
                .for_each(|(name, _)| name.clear());
        }
        common = Some(names);
        // While it is incomplete, the bytes may yet be of a later kind.
        if matches!(classification, Classification::Frame(_)) {
            break;
        }
    }
    common.unwrap_or_default()
}

fn names_of(kind: &Kind, bytes: &[u8], classification: Classification) -> Vec<String> {
    let (layout, header) = (&kind.layout, kind.layout.header());
    let is_fixed = layout.length() == Length::Fixed;
    // Then what is counted from the end has a place.
    let is_known = is_fixed || bytes.len() >= header && layout.length() != Length::Delimiter;
    let whole = match classification {
        _ if is_fixed => layout.longest(),
        Classification::Incomplete { at_least } => at_least.max(header),
        _ => header,
    };
    let trailer = layout.trailer().filter(|_| is_known);
    let alone = whole - trailer.map_or(0, |it| it.bytes_after(bytes)).min(whole);
    let positions = kind.positions(alone, is_known);
    let appended = kind.fields.iter().find(|field| field.is_appended);
    let name = |byte: usize| {
        let here = positions.iter().filter(|(_, bytes)| bytes.contains(&byte));
        let is_value = |(part, _): &&(Part, _)| matches!(part, Part::Value(..));
        let values = here
            .clone()
            .filter(is_value)
            .map(|(part, _)| part.to_string());
        let values: Vec<String> = values.collect();
        match (&values[..], here.clone().next(), appended) {
            ([_, ..], ..) => values.join(" "),
            ([], _, Some(field)) if byte >= alone => field.name.clone(),
            ([], Some((part, _)), _) => part.to_string(),
            ([], None, _) => "any".to_owned(),
        }
    };
    (0..whole.min(MOST)).map(name).collect()
}
