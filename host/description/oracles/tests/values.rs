//! Encodes random values of random descriptions, and decodes the frames again. Each form in the tables of this file
//! occurs.

#![allow(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "a panic fails the test"
)]

use std::fmt::Write as _;

use framelock_description::{Description, Value};
use framelock_description_oracles::values;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value as Json;

/// The values that the test draws for a column.
enum Domain {
    /// Whole numbers, from the first number to the second.
    Whole(i64, i64),
    /// Whole numbers, from the first number to the second, divided by ten to the power of the third.
    Decimal(i64, i64, usize),
    /// Floating-point numbers.
    Float,
    /// One of these values, in JSON.
    OneOf(&'static [&'static str]),
    /// Printable text of at most this number of characters, without a blank at either end.
    Text(usize),
    /// This number of bytes in hex.
    Bytes(usize),
}
use Domain::{Bytes, Decimal, Float, OneOf, Text, Whole};

/// Forms of fields with a position: the number of bytes, the keys, and the values.
const PLACED: &[(usize, &str, Domain)] = &[
    (1, "type = 'u8'", Whole(0, 255)),
    (5, "type = 'u40be'", Whole(0, (1 << 40) - 1)),
    (7, "type = 'i56le'", Whole(-(1 << 55), (1 << 55) - 1)),
    (
        2,
        "bits = 11\nbit = 3\nnotation = 'signed'",
        Whole(-1024, 1023),
    ),
    (2, "type = 'i16be'\nmask = 0x0FF0", Whole(-128, 127)),
    (
        2,
        "type = 'u16le'\nnotation = 'sign-magnitude'",
        Whole(-32767, 32767),
    ),
    (1, "bits = 7\nnotation = 'sign-magnitude'", Whole(-63, 63)),
    (
        1,
        "type = 'i8'\nnotation = 'magnitude'\nscale = -1",
        Whole(-127, 0),
    ),
    (
        5,
        "type = 'u40le'\nnotation = 'bcd'",
        Whole(0, 9_999_999_999),
    ),
    (2, "bits = 10\nbit = 1\nnotation = 'bcd'", Whole(0, 399)),
    (4, "type = 'u16be'\nnotation = 'hex'", Whole(0, 65535)),
    (
        6,
        "type = 'i24le'\nnotation = 'hex'",
        Whole(-(1 << 23), (1 << 23) - 1),
    ),
    (8, "type = 'f64be'", Float),
    (
        2,
        "type = 'i16le'\nscale = 0.01\noffset = -3",
        Decimal(-33068, 32467, 2),
    ),
    (
        1,
        "type = 'u8'\nnames = { 3 = 'three', 4 = 'a, \"b\"' }",
        OneOf(&["\"three\"", "\"a, \\\"b\\\"\"", "5"]),
    ),
    (
        2,
        "type = 'u16be'\nmissing = 65535\nscale = 10",
        OneOf(&["null", "0", "655340"]),
    ),
    (
        8,
        "type = 'u64le'\nmissing = 0xFFFFFFFFFFFFFFFF",
        OneOf(&["null", "18446744073709551614"]),
    ),
    (
        8,
        "type = 'f64le'\nmissing = nan",
        OneOf(&["null", "1.5", "-1e-300"]),
    ),
    (3, "type = 'bytes'\ncount = 3", Bytes(3)),
    (7, "type = 'text'\ncount = 7\npadding = '20'", Text(7)),
    (
        6,
        "type = 'text'\ncount = 6\nnotation = 'decimal'",
        Whole(-99999, 999_999),
    ),
    (
        4,
        "type = 'text'\ncount = 4\nnotation = 'hex'",
        Whole(0, 0xFFFF),
    ),
];

/// Forms of arrays at the end of a frame, which may have fewer values: the number of bytes in one value, the keys, and
/// the values.
const ARRAYS: &[(usize, &str, Domain)] = &[
    (2, "type = 'u16le'", Whole(0, 65535)),
    (2, "type = 'i8'\nnotation = 'hex'", Whole(-128, 127)),
    (
        1,
        "type = 'i8'\nmissing = -1",
        OneOf(&["null", "7", "-128"]),
    ),
];

/// Forms of values in a text.
const IN_TEXT: &[(&str, Domain)] = &[
    ("", Decimal(-99999, 99999, 0)),
    ("unit = 'deg'", Decimal(-99999, 99999, 3)),
    ("decimals = 2", Decimal(-99999, 99999, 2)),
    ("scale = 0.5\ndecimals = 1", Decimal(-9995, 9995, 2)),
    ("notation = 'hex'", Whole(0, i64::MAX)),
    ("notation = 'text'", Text(5)),
    (
        "names = { 0 = 'off', 1 = 'on' }",
        OneOf(&["\"off\"", "\"on\"", "2"]),
    ),
    ("missing = -1", OneOf(&["null", "17"])),
];

/// Literals of a text. No value contains them.
const LITERALS: &[&str] = &["|", "~~", "!{{", " ^ ", "\\x0B", "|\\t"];

impl Domain {
    /// Draws a value of this domain.
    fn draw(&self, random: &mut ChaCha8Rng) -> Json {
        let number = |number: i64, decimals: usize| {
            if decimals == 0 {
                number.to_string()
            } else {
                let sign = if number < 0 { "-" } else { "" };
                let digits = format!("{:0>1$}", number.unsigned_abs(), decimals + 1);
                let (whole, fraction) = digits.split_at(digits.len() - decimals);
                format!("{sign}{whole}.{fraction}")
            }
        };
        let text = match *self {
            Whole(least, most) => random.random_range(least..=most).to_string(),
            // With the scale 0.5 and one decimal, a shown number is a multiple of 0.05.
            Decimal(-9995, most, decimals) => {
                number(random.random_range(-most / 5..=most / 5) * 5, decimals)
            }
            Decimal(least, most, decimals) => number(random.random_range(least..=most), decimals),
            Float => format!("{:?}", random.random::<f64>() * 1e9 - 5e8),
            OneOf(values) => (*values.choose(random).unwrap()).to_owned(),
            Bytes(count) => {
                let bytes = (0..count).map(|_| format!("{:02X}", random.random::<u8>()));
                format!("\"x{}\"", bytes.collect::<String>())
            }
            Text(most) => {
                // A blank at the beginning would belong to a literal that ends with a blank.
                let count = random.random_range(2..=most);
                let mut text: Vec<u8> = (0..count)
                    .map(|_| *b" a,7\"".choose(random).unwrap())
                    .collect();
                (text[0], text[count - 1]) = (b'z', b'z');
                Json::from(String::from_utf8(text).unwrap()).to_string()
            }
        };
        serde_json::from_str(&text).unwrap()
    }
}

/// A description, and the domain of each column.
struct Drawn {
    text: String,
    domains: Vec<&'static Domain>,
    /// The smallest number of values in a row.
    least: usize,
}

fn placed(random: &mut ChaCha8Rng) -> Drawn {
    let (mut text, mut at, mut domains) = (String::new(), 2, Vec::new());
    for number in 0..random.random_range(1..5) {
        let (bytes, keys, domain) = PLACED.choose(random).unwrap();
        writeln!(
            text,
            "[[fields]]\nname = 'field{number}'\nat = {at}\n{keys}"
        )
        .unwrap();
        at += bytes;
        domains.push(domain);
    }
    let (mut least, shortest) = (domains.len(), at);
    if random.random() {
        let (bytes, keys, domain) = ARRAYS.choose(random).unwrap();
        let count = random.random_range(1..5);
        writeln!(
            text,
            "[[fields]]\nname = 'array'\nat = {at}\ncount = {count}\n{keys}"
        )
        .unwrap();
        at += count * bytes;
        domains.extend(vec![domain; count]);
    }
    let length = if random.random() {
        format!("length_field = {{ at = 1, type = 'u8' }}\nshortest = {shortest}\nlongest = {at}")
    } else {
        least = domains.len();
        format!("length = {at}")
    };
    let text = format!("sync = '24'\n{length}\n{text}");
    Drawn {
        text,
        domains,
        least,
    }
}

fn in_text(random: &mut ChaCha8Rng) -> Drawn {
    let (mut pattern, mut fields, mut domains) = (String::new(), String::new(), Vec::new());
    for number in 0..random.random_range(1..5) {
        let (keys, domain) = IN_TEXT.choose(random).unwrap();
        let literal = LITERALS.choose(random).unwrap();
        if number > 0 || random.random() {
            pattern += literal;
        }
        write!(pattern, "{{field{number}}}").unwrap();
        if !keys.is_empty() {
            writeln!(fields, "[[fields]]\nname = 'field{number}'\n{keys}").unwrap();
        }
        domains.push(domain);
    }
    if random.random() {
        pattern += "#}}";
    }
    let around = *[
        "sync = '24'\nterminator = '0A'\n",
        "terminator = '0D 0A'\n",
        "sync = '24'\nlength_field = { at = 1, type = 'u8' }\n",
    ]
    .choose(random)
    .unwrap();
    let text = format!("{around}longest = 200\ntext = '{pattern}'\n{fields}");
    let least = domains.len();
    Drawn {
        text,
        domains,
        least,
    }
}

#[test]
fn values_become_frames_and_the_same_values_again() {
    let keys = PLACED.iter().chain(ARRAYS).map(|(_, keys, _)| *keys);
    let keys = keys.chain(IN_TEXT.iter().map(|(keys, _)| *keys));
    let mut forms: Vec<(String, usize)> = keys
        .chain(LITERALS.iter().copied())
        .map(|form| (form.to_owned(), 0))
        .collect();
    let (mut shorter, mut missing) = (0, 0);
    for seed in 0..2_000 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let drawn = if random.random() {
            placed(&mut random)
        } else {
            in_text(&mut random)
        };
        let text = &drawn.text;
        for (form, count) in &mut forms {
            *count += usize::from(text.contains(&*form));
        }
        let description =
            Description::parse("my.toml", text).unwrap_or_else(|why| panic!("{why}\n{text}"));
        assert_eq!(description.columns.len(), drawn.domains.len(), "{text}");
        for _ in 0..4 {
            let count = random.random_range(drawn.least..=drawn.domains.len());
            let row: Vec<Json> = drawn.domains[..count]
                .iter()
                .map(|domain| domain.draw(&mut random))
                .collect();
            shorter += usize::from(count < drawn.domains.len());
            missing += row.iter().filter(|value| value.is_null()).count();
            let given: Vec<Option<Json>> = row.iter().cloned().map(Some).collect();
            let frame = description.encode(&given);
            let frame = frame.unwrap_or_else(|why| panic!("{why}\n{row:?}\n{text}"));
            assert!(description.is_frame(&frame), "{text}\n{frame:02X?}");
            let shown = values(&description, &frame);
            let shown_or_null = shown
                .iter()
                .take(count)
                .map(|value| value.clone().unwrap_or_default());
            let shown_row: Vec<Json> = shown_or_null.collect();
            assert_eq!(shown_row, row, "{text}\n{frame:02X?}");
            assert!(
                shown[count..].iter().all(Option::is_none),
                "{text}\n{shown:?}"
            );
            assert_eq!(
                description.encode(&shown).as_ref(),
                Ok(&frame),
                "{text}\n{shown:?}"
            );
            // In separated values, such as CSV, all cells are text.
            let kind = description.kind(&frame).unwrap();
            let contents = kind
                .values(&frame)
                .flat_map(|(_, content)| content.values());
            let has_no_gap = !row.contains(&Json::Null);
            let cells: Vec<Option<Json>> = contents
                .map(|value: Value| Some(value.to_string().into()))
                .collect();
            if has_no_gap {
                assert_eq!(description.encode(&cells), Ok(frame), "{text}\n{cells:?}");
            }
        }
    }
    assert!(forms.iter().all(|(_, count)| *count > 50), "{forms:#?}");
    assert!(shorter > 300 && missing > 300, "{shorter} {missing}");
}
