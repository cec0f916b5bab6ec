//! The name of each byte of a frame, if the description and the bytes received so far determine the
//! name.

use framelock::Classification;
use framelock_description::{Description, Kind, Part};
use framelock_formats::layout::Length;

/// The greatest number of bytes of one frame that the page draws.
pub(crate) const MOST: usize = 64;

/// Returns the names of the bytes of a frame that begins with `bytes`. A name is empty where the
/// bytes so far do not determine it.
pub(crate) fn names(description: &Description, bytes: &[u8]) -> Vec<String> {
    if description.format().packets().is_some() {
        // The stuffing moves the bytes of a packet.
        return vec!["packet".to_owned(); bytes.len().min(MOST)];
    }
    let mut common: Option<Vec<String>> = None;
    for kind in &description.kinds {
        let classification = kind.layout().classify(bytes);
        if matches!(classification, Classification::Rejected(_)) && !bytes.is_empty() {
            continue;
        }
        let mut names = names_of(kind, bytes, classification);
        if let Some(other) = &common {
            // The bytes may belong to this kind or to an earlier one, so keep only the names that
            // all these kinds give.
            names.truncate(other.len());
            let both = names.iter_mut().zip(other);
            both.filter(|(name, other)| *name != *other)
                .for_each(|(name, _)| name.clear());
        }
        common = Some(names);
        // As long as the bytes are not a whole frame of this kind, they may still turn out to be a
        // frame of one of the following kinds.
        if matches!(classification, Classification::Frame(_)) {
            break;
        }
    }
    common.unwrap_or_default()
}

fn names_of(kind: &Kind, bytes: &[u8], classification: Classification) -> Vec<String> {
    let (layout, header) = (kind.layout(), kind.layout().header());
    let is_fixed = layout.length == Length::Fixed;
    // Whether the frame's length is known. Without the length, the positions of parts that are
    // counted from the frame's end are unknown.
    let is_known = is_fixed || bytes.len() >= header && matches!(layout.length, Length::Field(_));
    let whole = match classification {
        _ if is_fixed => layout.longest,
        Classification::Incomplete { at_least } => at_least.max(header),
        _ => header,
    };
    let trailer = layout.trailer.filter(|_| is_known);
    let alone = whole - trailer.map_or(0, |it| it.bytes_after(bytes)).min(whole);
    let positions = kind.parts(alone, is_known);
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
