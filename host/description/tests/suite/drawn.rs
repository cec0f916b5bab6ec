//! Random descriptions, and random frames of descriptions.

use std::fmt::Write as _;

use framelock_description::{Description, Field, Kind, Type, Value, hex};
use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use serde_json::Value as Json;

/// Returns the value that a field has in every frame of a view; `None` if the field does not identify the view's
/// frames.
fn identifying(view: &Kind, name: &str) -> Option<Json> {
    let (from, bytes) = &view.sign;
    let mut frame = vec![0; view.layout().longest];
    frame[*from..][..bytes.len()].copy_from_slice(bytes);
    let (field, content) = view.values(&frame).find(|(field, _)| field.name == name)?;
    let at = usize::try_from(field.at).ok()?;
    let is_within = at >= *from && at + field.length()? <= from + bytes.len();
    is_within.then(|| json(content.value()))
}

fn json(value: Value) -> Json {
    let mut text = Vec::new();
    value.append_json_to(&mut text);
    serde_json::from_slice(&text).unwrap()
}

/// Returns a row for a frame of one of the kinds or views, with arbitrary values of the fields' types.
fn row(description: &Description, random: &mut ChaCha8Rng) -> Vec<Option<Json>> {
    // Draw small values, so that they fit the smallest type.
    let most = *[1, 1, 3, 7].choose(random).unwrap();
    let kind = description.kinds.choose(random).unwrap();
    let view = kind.views.choose(random).filter(|_| random.random());
    let shown = view.unwrap_or(kind);
    let sync = kind.layout().sync.each().next().unwrap_or_default();
    let end = kind.layout().terminator.each().last().unwrap_or_default();
    // Some rows lack the last fields, which then are not in the frame.
    let optional = shown.fields.iter();
    let optional = optional.filter(|field| shown.shortest_with(field).is_some());
    let mut missing: Vec<&str> = optional.map(|field| &*field.name).collect();
    if !missing.is_empty() {
        let present = random.random_range(0..=2 * missing.len());
        missing.drain(..present.min(missing.len()));
    }
    let values = description.columns.iter().map(|column| {
        let is_it =
            |field: &&Field| (0..field.values()).any(|number| field.column(number) == column.name);
        let field = shown.fields.iter().find(is_it);
        if field.is_some_and(|field| missing.contains(&&*field.name)) {
            return None;
        }
        if let Some(view) = view {
            if let Some(value) = identifying(view, &column.name) {
                return Some(value);
            }
            // A row that contains the whole payload does not belong to the view.
            if field.is_none() && column.name != "kind" {
                return None;
            }
        }
        Some(match (&*column.name, column.is_text) {
            ("kind", _) => shown.name.clone().into(),
            ("address", _) => (*[0xC8, 0, 0xEA, 0xEC, 0xEE].choose(random).unwrap()).into(),
            ("start", _) => sync
                .first()
                .map(|byte| char::from(*byte).to_string())
                .into(),
            ("end", _) => end.first().copied().into(),
            ("sentence", _) if view.is_some() => {
                format!("GP{}01", String::from_utf8_lossy(&shown.sign.1)).into()
            }
            ("sentence", _) => (*["GPTXT,01", "a\\\\\\x1B\\xFF", "\\x20 \\x20"]
                .choose(random)
                .unwrap())
            .into(),
            ("signature", _) => {
                (*["", "00112233445566778899AABBCC"].choose(random).unwrap()).into()
            }
            (_, true) => {
                // Draw short payloads, because some MAVLink messages allow only a few bytes. Also draw longer payloads,
                // because some layouts allow only longer frames.
                let long = kind.layout().shortest.max(21);
                let rest = *[1, 2, 3, long].choose(random).unwrap();
                let count = field.and_then(|field| field.count).unwrap_or(rest);
                let ranges = kind.layout().content;
                let is_content = |byte: &u8| ranges.iter().any(|(a, b)| (a..=b).contains(&byte));
                let all = (0..=u8::MAX).filter(|byte| ranges.is_empty() || is_content(byte));
                let all: Vec<u8> = all.collect();
                let mut bytes: Vec<u8> = (0..count).map(|_| *all.choose(random).unwrap()).collect();
                // Do not end with a zero, because encoding may leave out trailing zeros.
                bytes.last_mut().into_iter().for_each(|byte| *byte |= 1);
                let mut text = hex::glued(&bytes);
                if field.is_some_and(|field| field.kind == Type::Text) {
                    text.truncate(count);
                }
                text.into()
            }
            _ => {
                let number = random.random_range(0..=most);
                match field.and_then(|field| field.scale) {
                    Some(scale) => serde_json::from_str(&scale.text(number.into())).unwrap(),
                    None => number.into(),
                }
            }
        })
    });
    values.collect()
}

/// Returns the values of a frame, in the order of the columns.
pub(crate) fn values(description: &Description, frame: &[u8]) -> Vec<Option<Json>> {
    let kind = description.kind(frame).unwrap();
    let mut row = vec![None; description.columns.len()];
    let place = |name: &str| {
        description
            .columns
            .iter()
            .position(|column| column.name == name)
    };
    if description.has_kinds() {
        row[0] = Some(kind.name_of(frame).into());
    }
    for (field, content) in kind.values(frame) {
        let from = place(&field.name)
            .or(place(&format!("{}1", field.name)))
            .unwrap();
        for (value, place) in content.values().zip(&mut row[from..]) {
            *place = Some(json(value));
        }
    }
    row
}

/// Returns frames with random values.
pub(crate) fn frames(description: &Description, random: &mut ChaCha8Rng) -> Vec<Vec<u8>> {
    let rows = (0..12).map(|_| description.encode(&row(description, random)));
    rows.filter_map(Result::ok).collect()
}

/// Returns the frame, or the same frame with another terminator.
pub(crate) fn with_any_end(
    description: &Description,
    frame: &[u8],
    random: &mut ChaCha8Rng,
) -> Vec<u8> {
    let layout = description.kinds[description.number(frame)].layout();
    let content = frame.len() - layout.terminator.length;
    let own = layout.terminator.length;
    let others: Vec<&[u8]> = layout
        .terminators()
        .filter(|end| end.len() != own)
        .collect();
    let end = others.choose(random);
    match end.filter(|end| random.random() && content + end.len() <= layout.longest) {
        Some(end) => [&frame[..content], end].concat(),
        None => frame.to_vec(),
    }
}

/// Returns a stream of frames with noise between them. The noise consists of pieces of these
/// frames, and of random bytes.
pub(crate) fn noisy(frames: &[Vec<u8>], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut stream = Vec::new();
    for bytes in frames {
        match random.random_range(0..4) {
            0 => stream.extend(bytes.iter().take(random.random_range(0..=bytes.len()))),
            1 => stream.extend(bytes.iter().skip(random.random_range(0..=bytes.len()))),
            2 => stream.push(random.random()),
            _ => {}
        }
        stream.extend(bytes);
    }
    stream
}

pub(crate) const ENDS: &[&str] = &[
    "'0D 0A'",
    "'0A'",
    "'04 | 1A'",
    "'0D 0A | 0A'",
    "'0A | 0D 0A | 0D 0D 0A'",
];
pub(crate) const CONTENTS: &[&str] = &[
    "",
    "content = '00-FF except 0A 0D'\n",
    "content = '05-19 1B-FF 00-03 except 0D 0A'\n",
];

/// Types of fields: the number of bytes, and the keys of the field's entry.
pub(crate) const FIELDS: &[(usize, &str)] = &[
    (9, "type = 'bytes'"),
    (9, "type = 'text'"),
    (3, "type = 'bytes'\ncount = 3"),
    (3, "bits = 7\nbit = 3\ncount = 2"),
    (3, "bits = 20\nbit = 3"),
    (9, "bits = 33\nbit = 6\ncount = 2"),
    (1, "type = 'u8'\nvalue = 3"),
    (1, "type = 'u8'\nvalue = [0, 1, 2, 3]"),
    (2, "type = 'u16be'\nmask = 0x0FF0"),
    (4, "type = 'i16le'\nmask = 0x3FC\ncount = 2"),
    (2, "type = 'i16be'\nscale = 0.25\nunit = 'deg'"),
    (1, "type = 'i8'"),
    (3, "type = 'u24be'\nscale = -10"),
    (8, "type = 'u64le'"),
    (4, "type = 'f32be'"),
];

pub(crate) const SYNCS: &[&str] = &["", "'24'", "'B5 62'", "'C8 | EE'", "'24 01 | 24 24'"];
pub(crate) const LENGTHS: &[&str] = &["5", "9", "17", "24", "300"];
pub(crate) const LENGTH_TYPES: &[&str] = &["'u8'", "'u16be'", "'u24le'"];
pub(crate) const COUNTED: &[&str] = &[
    "",
    ", plus = 7",
    ", plus = -1",
    ", factor = 2, plus = 6",
    ", factor = 4",
    ", mask = 0x3F",
];

/// The forms of checksums: their algorithm, their type, and their number of bytes.
pub(crate) const CHECKSUMS: &[(&str, &str, usize)] = &[
    ("name = 'xor'", "u8", 1),
    ("name = 'xor'", "hex8", 2),
    ("name = 'sum'", "u16le", 2),
    ("name = 'fletcher-8'", "u16le", 2),
    ("name = 'CRC-16'", "u16be", 2),
    ("name = 'CRC-24/BLE'", "u24le", 3),
    ("name = 'CRC-15'", "hex16", 4),
    ("width = 8, polynomial = 0x4D", "u8", 1),
    (
        "width = 32, polynomial = 0x04C11DB7, initial = 1, reflected = true, xor = 0xFF",
        "u32le",
        4,
    ),
];

/// Returns a random description, which may contradict itself.
pub(crate) fn description(random: &mut ChaCha8Rng) -> String {
    let mut text = String::new();
    let mut one_of = |these: &[&str]| (*these.choose(random).unwrap()).to_owned();
    let sync = one_of(SYNCS);
    if !sync.is_empty() {
        writeln!(text, "sync = {sync}").unwrap();
    }
    let (mut at, mut end_length) = (2, 0);
    let length = one_of(&["fixed", "terminator", "field", "field"]);
    match &*length {
        "fixed" => writeln!(text, "length = {}", one_of(LENGTHS)).unwrap(),
        "terminator" => {
            let end = one_of(ENDS);
            end_length = if end.starts_with("'0D") { 2 } else { 1 };
            writeln!(text, "terminator = {end}\nlongest = 60").unwrap();
            write!(text, "{}", one_of(CONTENTS)).unwrap();
            at = sync.matches(|c: char| c.is_ascii_hexdigit()).count() / 2;
        }
        _ => {
            let (kind, rest) = (one_of(LENGTH_TYPES), one_of(COUNTED));
            writeln!(
                text,
                "length_field = {{ at = {at}, type = {kind}{rest} }}\nlongest = 60"
            )
            .unwrap();
            at += if kind == "'u8'" { 1 } else { 3 };
        }
    }
    if length != "fixed" {
        writeln!(text, "{}", one_of(&["", "shortest = 24"])).unwrap();
    }
    let (name, kind, bytes) = *CHECKSUMS.choose(random).unwrap();
    if length != "terminator" || random.random() {
        let place = bytes
            + if length == "terminator" {
                end_length
            } else {
                0
            };
        let from = [0, 0, 1, 3].choose(random).unwrap();
        writeln!(
            text,
            "checksum = {{ {name}, type = '{kind}', at = -{place}, from = {from} }}"
        )
        .unwrap();
    }
    for number in 0..random.random_range(0..5) {
        let (length, rest) = *FIELDS.choose(random).unwrap();
        writeln!(
            text,
            "[[fields]]\nname = 'field{number}'\nat = {at}\n{rest}\n"
        )
        .unwrap();
        at += length;
        // A field that takes the rest of the frame is the last one, because fields may share bytes.
        if rest == "type = 'bytes'" || rest == "type = 'text'" {
            break;
        }
    }
    text
}
