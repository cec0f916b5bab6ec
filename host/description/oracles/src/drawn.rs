//! Random descriptions, and random frames of descriptions.

use std::fmt::Write as _;

use framelock_description::{Description, Kind, Notation, Value};
use framelock_oracles::frame;
use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;
use serde_json::Value as Json;

fn json(value: Value) -> Json {
    let mut text = Vec::new();
    value.append_json_to(&mut text);
    serde_json::from_slice(&text).unwrap()
}

/// Returns the values of a frame, in the order of the columns.
pub fn values(description: &Description, frame: &[u8]) -> Vec<Option<Json>> {
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

/// Values for texts: numbers in several notations, texts that are no numbers, and two numbers with a separator.
const IN_TEXT: &[&str] = &[
    "0",
    "127",
    "5;6",
    "255",
    "-5",
    "-90",
    " +12.5 ",
    "- 3.25",
    "007",
    ".5",
    "1e3",
    "2147483647",
    "-2147483648.4",
    "2147483647.5",
    "99999999999",
    "0000000000000000001",
    "1A",
    "",
    "-",
];

/// Returns a frame whose text follows one of the kind's patterns. Some of the values may be no numbers.
pub fn text_frame(kind: &Kind, random: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let text = kind.texts.choose(random)?;
    let numbers = &IN_TEXT[..*[5, 10, IN_TEXT.len()].choose(random)?];
    let mut content = text.first.clone();
    for value in &text.values {
        content.extend(numbers.choose(random)?.bytes());
        for byte in &value.after {
            let count = if *byte == b' ' {
                random.random_range(1..3)
            } else {
                1
            };
            content.extend(std::iter::repeat_n(*byte, count));
        }
    }
    let choose = |count| random.random_range(0..count);
    // A layout without a sync has a header of one byte, which is the first byte of the text.
    let more = kind.layout().header().checked_sub(kind.text_at)?;
    let mut frame = frame(kind.layout(), content.get(more..)?, choose).ok()?;
    frame[kind.text_at..][..more].copy_from_slice(&content[..more]);
    kind.layout().seal(&mut frame).then_some(frame)
}

/// Returns random frames of the kinds and views. For each frame, decodes a frame of random bytes, and encodes the
/// decoded values.
pub fn frames(description: &Description, random: &mut ChaCha8Rng) -> Vec<Vec<u8>> {
    let made = (0..12).map(|_| {
        let kind = description.kinds.choose(random)?;
        let view = kind.views.choose(random).filter(|_| random.random());
        let shown = view.unwrap_or(kind);
        // The content ends after one of the fields.
        let rest = random.random_range(0..24);
        let ends: Vec<usize> = shown
            .fields
            .iter()
            .filter_map(|field| field.end(rest))
            .collect();
        let end = ends.choose(random).copied().unwrap_or(rest);
        let most = *[1, 3, u8::MAX].choose(random)?;
        let checksum = kind.layout().checksum;
        let is_hex = checksum.is_some_and(|checksum| checksum.over_hex_digits);
        let content = kind.layout().header()..end;
        let content = content.map(|_| {
            if is_hex {
                *b"0123456789ABCDEFabcdef".choose(random).unwrap()
            } else {
                random.random_range(0..=most)
            }
        });
        let content: Vec<u8> = content.collect();
        let filled = frame(kind.layout(), &content, |count| {
            random.random_range(0..count)
        });
        let mut frame = filled.unwrap_or_else(|almost| almost);
        let text = text_frame(shown, random);
        let has_text = text.is_some();
        frame = text.unwrap_or(frame);
        let fields = shown.fields.iter();
        for field in fields.filter(|it| it.notation == Notation::Hex && !it.is_bytes()) {
            for byte in field.position(frame.len()).unwrap_or_default() {
                frame[byte] = *b"0123456789ABCDEFabcdef".choose(random)?;
            }
        }
        let (at, sign) = &shown.sign;
        // If the beginning of the text identifies the frames, write the first literal of the text.
        let literal = shown.texts.first().map(|text| match &*text.values {
            [first, ..] if text.first.is_empty() => &first.after,
            _ => &text.first,
        });
        let sign = literal
            .filter(|_| sign.is_empty() && !has_text)
            .unwrap_or(sign);
        frame.get_mut(*at..at + sign.len())?.copy_from_slice(sign);
        let is_sealed = kind.layout().seal(&mut frame) && description.is_frame(&frame);
        let values = is_sealed.then(|| values(description, &frame))?;
        description.encode(&values).ok()
    });
    made.flatten().collect()
}

/// Returns the frame, or the same frame with another terminator.
pub fn with_any_end(description: &Description, frame: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let layout = description.kinds[description.number(frame)].layout();
    let content = frame.len() - layout.terminator.length;
    let own = layout.terminator.length;
    if layout.behind > 0 {
        return frame.to_vec();
    }
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

/// Terminators.
pub const ENDS: &[&str] = &[
    "'0D 0A'",
    "'0A'",
    "'04 | 1A'",
    "'0D 0A | 0A'",
    "'0A | 0D 0A | 0D 0D 0A'",
];
/// The forms of packets.
pub const PACKETS: &[&str] = &[
    "'slip'",
    "'hdlc'",
    "'cobs'",
    "'dle'",
    "'break'",
    "{ delimiter = '24', escape = '7D', xor = '20' }",
    "{ delimiter = '00', escape = '01', delimiter_code = '02', escape_code = '03' }",
    "{ escape = '10', start = '24', end = 'B5' }",
    "{ escape = '10', end = '03' }",
];
/// Contents.
pub const CONTENTS: &[&str] = &[
    "",
    "content = '00-FF except 0A 0D'\n",
    "content = '05-19 1B-FF 00-03 except 0D 0A'\n",
];

/// Types of fields: the number of bytes (unused if the field takes the rest of the frame), and the keys of the field's
/// entry.
pub const FIELDS: &[(usize, &str)] = &[
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

/// Syncs.
pub const SYNCS: &[&str] = &["", "'24'", "'B5 62'", "'C8 | EE'", "'24 01 | 24 24'"];
/// Fixed lengths.
pub const LENGTHS: &[&str] = &["5", "9", "17", "24", "300"];
/// Types of a length field.
pub const LENGTH_TYPES: &[&str] = &["'u8'", "'u16be'", "'u24le'"];
/// Further keys of a length field.
pub const COUNTED: &[&str] = &[
    "",
    ", plus = 7",
    ", plus = -1",
    ", factor = 2, plus = 6",
    ", factor = 4",
    ", mask = 0x3F",
    ", mask = 0xFC",
];

/// The forms of checksums: their algorithm, their type, and their number of bytes in the frame.
pub const CHECKSUMS: &[(&str, &str, usize)] = &[
    ("name = 'xor'", "u8", 1),
    ("name = 'xor'", "hex8", 2),
    ("name = 'sum'", "u16le", 2),
    ("name = 'sum', xor = 0xFFFF", "u16le", 2),
    ("name = 'sum', initial = 0xFF, xor = 0xFF", "u8", 1),
    ("name = 'carry-sum'", "u16be", 2),
    ("name = 'carry-sum', xor = 0xFF", "u8", 1),
    ("name = 'sum-words', initial = 3", "u16be", 2),
    ("name = 'xor', initial = 0x55", "u8", 1),
    ("name = 'xor-words'", "u16le", 2),
    ("name = 'sum', over = 'hex digits'", "hex8", 2),
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
pub fn description(random: &mut ChaCha8Rng) -> String {
    let mut text = String::new();
    let (mut checksum, has_checksum) = (*CHECKSUMS.choose(random).unwrap(), random.random());
    let from = *[0, 0, 1, 3].choose(random).unwrap();
    let mut one_of = |these: &[&str]| (*these.choose(random).unwrap()).to_owned();
    let sync = one_of(SYNCS);
    if !sync.is_empty() {
        writeln!(text, "sync = {sync}").unwrap();
    }
    let packets = one_of(&[&[""; 12], PACKETS].concat());
    if !packets.is_empty() {
        writeln!(text, "packets = {packets}").unwrap();
    }
    let (mut at, mut from_end) = (2, 0);
    let length = one_of(&["fixed", "terminator", "field", "field", "silence"]);
    let sync_length = sync
        .split('|')
        .next()
        .unwrap()
        .matches(|c: char| c.is_ascii_hexdigit())
        .count()
        / 2;
    let has_sum_of_digits = checksum.0.contains("over");
    match &*length {
        "fixed" => writeln!(text, "length = {}", one_of(LENGTHS)).unwrap(),
        "terminator" => {
            let end = one_of(ENDS);
            writeln!(text, "terminator = {end}\nlongest = 60").unwrap();
            if has_checksum && one_of(&["", "behind"]) == "behind" {
                writeln!(text, "behind = {}", checksum.2).unwrap();
            } else {
                from_end = if end.starts_with("'0D") { 2 } else { 1 };
            }
            write!(text, "{}", one_of(CONTENTS)).unwrap();
            at = sync_length;
        }
        "silence" => {
            let ends = if packets.is_empty() {
                "ends = 'silence'\n"
            } else {
                ""
            };
            writeln!(text, "{ends}longest = 60").unwrap();
            at = sync_length;
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
    // A sum over hex digits is drawn only for frames that begin with a sync and end with a terminator or silence.
    let is_text = ["terminator", "silence"].contains(&&*length)
        && has_sum_of_digits
        && has_checksum
        && !sync.is_empty();
    if has_sum_of_digits && !is_text {
        checksum = CHECKSUMS[0];
    }
    if length != "fixed" && !is_text {
        writeln!(text, "{}", one_of(&["", "shortest = 24"])).unwrap();
    }
    let (name, kind, bytes) = checksum;
    if length != "terminator" || has_checksum {
        let from = if is_text { at } else { from };
        let place = bytes + from_end;
        writeln!(
            text,
            "checksum = {{ {name}, type = '{kind}', at = -{place}, from = {from} }}"
        )
        .unwrap();
    }
    let fields = if is_text { &FIELDS[..2] } else { FIELDS };
    for number in 0..random.random_range(usize::from(is_text)..5) {
        let (length, rest) = *fields.choose(random).unwrap();
        writeln!(
            text,
            "[[fields]]\nname = 'field{number}'\nat = {at}\n{rest}\n"
        )
        .unwrap();
        at += length;
        // A field that takes the rest of the frame is the last one, because a later field would share bytes with it.
        if rest == "type = 'bytes'" || rest == "type = 'text'" {
            break;
        }
    }
    text
}
