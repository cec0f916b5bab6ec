#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::borrow::Cow;
use std::fmt::Write as _;

use framelock::{BufferedReceiver, Format, Found, Verdict};
use framelock_formats::check_laws;
use framelock_proofs::reference::framed;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value as Json;

use super::*;

/// What becomes of the bytes of a stream, each frame as the place at which it begins.
type Events = Vec<Found<usize>>;

/// What a receiver makes of a stream that is cut anywhere; byte by byte if `most` is 1.
fn received(described: &Described, stream: &[u8], most: usize, random: &mut ChaCha8Rng) -> Events {
    let mut receiver = BufferedReceiver::<_, { 2 * LONGEST }>::new(described.clone());
    let (mut rest, mut settled, mut events) = (stream, 0, vec![]);
    while !rest.is_empty() {
        let (piece, behind) = rest.split_at(random.random_range(1..=most.min(rest.len())));
        rest = behind;
        receiver.feed(piece, |found| {
            let count = found.bytes();
            events.push(found.map(|_| settled));
            settled += count;
        });
    }
    one_by_one(&events)
}

/// Discarded bytes one by one: in how many pieces they are told depends on the cuts.
fn one_by_one(events: &[Found<usize>]) -> Events {
    let each = events.iter().flat_map(|event| match *event {
        Found::Frame { .. } => vec![*event],
        Found::Discarded { count, why } => vec![Found::Discarded { count: 1, why }; count],
    });
    each.collect()
}

/// A row for a frame: any values of their types.
fn row(frame: &Frame, random: &mut ChaCha8Rng) -> Vec<Option<Json>> {
    // Fits the smallest of types.
    let most = *[1, 1, 7, 127].choose(random).unwrap();
    let values = frame.columns.iter().map(|column| {
        if column.is_text {
            let bytes: Vec<u8> = (0..random.random_range(0..9))
                .map(|_| random.random::<u8>())
                .collect();
            return Some(crate::hex::glued(&bytes).into());
        }
        Some(random.random_range(0..=most).into())
    });
    values.collect()
}

/// Frames with random values between noise that is made of pieces of such frames.
fn stream(frame: &Frame, random: &mut ChaCha8Rng) -> (Vec<u8>, usize) {
    let (mut stream, mut frames) = (Vec::new(), 0);
    for _ in 0..12 {
        let Ok(bytes) = frame.described.encode(&row(frame, random)) else {
            continue;
        };
        match random.random_range(0..4) {
            0 => stream.extend(bytes.iter().take(random.random_range(0..=bytes.len()))),
            1 => stream.extend(bytes.iter().skip(random.random_range(0..=bytes.len()))),
            2 => stream.push(random.random()),
            _ => {}
        }
        stream.extend(&bytes);
        frames += 1;
    }
    (stream, frames)
}

/// Whatever the stream and however it is cut, what the reference makes of it comes out.
fn agrees_with_the_reference(frame: &Frame, random: &mut ChaCha8Rng) -> usize {
    let (stream, frames) = stream(frame, random);
    let mut expected = Events::new();
    framed(&frame.described, &stream, false, |event| {
        expected.push(event);
    });
    let expected = one_by_one(&expected);
    for most in [1, 20, stream.len().max(1)] {
        let told = received(&frame.described, &stream, most, random);
        assert_eq!(told, expected, "{}\n{stream:02X?}", frame.text);
    }
    frames
}

#[test]
fn built_in_frames_agree_with_the_reference() {
    for (name, _) in BUILT_IN {
        let frame = Frame::named(name).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let frames: usize = (0..20)
            .map(|_| agrees_with_the_reference(&frame, &mut random))
            .sum();
        // Of MAVLink, a row whose message has no extra byte is none.
        assert!(
            frames > if *name == "mavlink2" { 5 } else { 100 },
            "{name}: {frames}"
        );
    }
}

#[test]
fn built_in_frames_keep_the_laws() {
    for (name, _) in BUILT_IN {
        let frame = Frame::named(name).unwrap();
        let row = frame.columns.iter().map(|column| {
            Some(if column.is_text {
                "01".into()
            } else {
                1.into()
            })
        });
        let mut bytes = frame.described.encode(&row.collect::<Vec<_>>()).unwrap();
        bytes.push(bytes[0]);
        // Longer ones take long, and agree with the reference above.
        bytes.truncate(14);
        check_laws(&frame.described, &mut bytes)
            .unwrap_or_else(|broken| panic!("{name}: {broken}"));
    }
}

/// A description of any shape; it may contradict itself.
fn description(random: &mut ChaCha8Rng) -> String {
    let mut text = String::new();
    let number = |random: &mut ChaCha8Rng| {
        *["u8", "i8", "u16le", "i16be", "u24be", "u32le", "f32be"]
            .choose(random)
            .unwrap()
    };
    let sync = *["", "'24'", "'B5 62'", "'C8 | EE'", "'24 01 | 24 24'"]
        .choose(random)
        .unwrap();
    if !sync.is_empty() {
        writeln!(text, "sync = {sync}").unwrap();
    }
    let mut at = random.random_range(1..4);
    match random.random_range(0..4) {
        0 => writeln!(text, "length = {}", random.random_range(5..24)).unwrap(),
        1 => writeln!(text, "terminator = '0D 0A'\nlongest = 30").unwrap(),
        _ => {
            let plus = random.random_range(-1..8);
            let kind = *["u8", "u16be"].choose(random).unwrap();
            writeln!(
                text,
                "length_field = {{ at = {at}, type = '{kind}', plus = {plus} }}\nlongest = 40"
            )
            .unwrap();
            at += 2;
        }
    }
    let (name, kind) = *[
        ("xor", "u8"),
        ("sum", "u16le"),
        ("fletcher-8", "u16le"),
        ("CRC-16/MODBUS", "u16be"),
    ]
    .choose(random)
    .unwrap();
    if random.random_ratio(3, 4) {
        let place = -random.random_range(1..4);
        let from = random.random_range(0..4);
        writeln!(
            text,
            "checksum = {{ name = '{name}', type = '{kind}', at = {place}, from = {from} }}"
        )
        .unwrap();
    }
    for field in 0..random.random_range(0..4) {
        let rest = match random.random_range(0..5) {
            0 => "type = 'bytes'".to_owned(),
            1 => format!(
                "bits = {}, bit = {}, count = 2",
                random.random_range(3..15),
                field
            ),
            2 => format!("type = '{}', value = {}", number(random), field),
            _ => format!("type = '{}'", number(random)),
        };
        writeln!(text, "[[fields]]\nname = 'field{field}'\nat = {at}\n{rest}").unwrap();
        at += random.random_range(1..5);
    }
    text
}

/// Of any description: the receiver and the reference agree, laws hold, and what is written is read.
#[test]
fn described_frames_agree_with_the_reference_and_are_read_as_they_are_written() {
    let (mut right, mut frames, mut read_again) = (0, 0, 0);
    for seed in 0..600 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let text = description(&mut random);
        let Ok(described) = description::parse("any.toml", &text) else {
            continue;
        };
        let columns = described.columns();
        let (name, setpoints) = ("any.toml".to_owned(), None);
        let frame = Frame {
            name,
            setpoints,
            described,
            columns,
            text,
        };
        right += 1;
        frames += agrees_with_the_reference(&frame, &mut random);
        let row = row(&frame, &mut random);
        let Ok(bytes) = frame.described.encode(&row) else {
            continue;
        };
        assert_eq!(frame.described.judge(&bytes), Verdict::Frame(bytes.len()));
        let values = frame.described.values(&bytes);
        let read: Vec<String> = values
            .flat_map(|field| {
                // A float is written with its point.
                let plain = |text: Cow<str>| text.trim_end_matches(".0").to_owned();
                field.texts().map(plain).collect::<Vec<_>>()
            })
            .collect();
        let written = row.iter().flatten().map(|value| match value {
            Json::String(text) => text.clone(),
            number => number.to_string(),
        });
        assert_eq!(read, written.collect::<Vec<_>>(), "{}", frame.text);
        read_again += read.len();
        if seed % 4 == 0 {
            let mut beginning: Vec<u8> = bytes.into_iter().take(6).collect();
            check_laws(&frame.described, &mut beginning).unwrap();
        }
    }
    assert!(
        right > 100 && frames > 1000 && read_again > 40,
        "{right} {frames} {read_again}"
    );
}

/// Descriptions, in which `\n` is what it is called, and what is wrong with them.
const WRONG: &str = r#"
    sync = "2G" => 1:8: word 1, '2G', has 'G', which is no hex digit
    sync = "" => 1:8: no bytes: leave the key out
    sync = 5 => 1:8: invalid type: integer `5`, expected a string
    sync = "C8 | EE 01"\nlength = 4 => 1:8: all that a frame may begin with must have the same length
    length = 4 => 1:1: nothing tells a frame from noise
    sync = "24" => 1:1: nothing ends a frame
    sync = "24"\nlenght = 4 => 2:1: unknown field `lenght`
    sync = "24"\nlength = 4\nlength = 5 => 3:1: duplicate key
    sync = "24"\nlength = 4\nlongest = 5 => 2:10: length says it all
    sync = "24"\nlength = 4000 => 2:10: frames of 4000 to 4000 bytes
    sync = "24 25"\nlength = 2\nterminator = "0A" => 2:10: frames of 2 to 2 bytes: the parts that each has are 3
    sync = "24"\nlength = 4\nlength_field = { at = 1, type = "u8", plus = 2 } => 2:10: length is for frames that all have it
    sync = "24"\nlength_field = { at = -1, type = "u8", plus = 2 }\nlongest = 9 => 2:23: this is needed before the end is known
    sync = "24"\nlength_field = { at = 1, type = "u16", plus = 2 } => 2:33: there is no type "u16": u8, u16le
    sync = "24"\nlength_field = { at = 1, type = "u8", plus = 2 } => 1:1: give longest
    sync = "24"\nlongest = 300\nlength_field = { at = 1, type = "u8", plus = 2 } => 2:11: frames of 2 to 300 bytes: the parts that each has are 2, and 257 is the most
    sync = "24"\nlongest = 1\nlength_field = { at = 1, type = "u8", plus = 2 } => 2:11: frames of 2 to 1 bytes
    sync = "24"\nlength = 4\nchecksum = { name = "CRC-8/DVBS3", type = "u8", at = -1 } => 3:21: there is no checksum "CRC-8/DVBS3"; the nearest names are CRC-8/DVB-S2
    sync = "24"\nlength = 4\nchecksum = { name = "CRC-16/MODBUS", type = "u8", at = -1 } => 3:12: this checksum has 2 bytes
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = -1, to = -1 } => 3:12: in a frame of 4 bytes the checksum is at 3 and covers 0 to 3
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = -2, from = 3 } => 3:12: in a frame of 4 bytes
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = 4 } => 3:12: the checksum is not in a frame of 4 bytes
    sync = "24"\nlength = 4\nchecksum = { name = "xor", type = "u8", at = -1 }\nterminator = "0A" => 3:12: the checksum is in the place of the terminator
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 4, type = "bytes" }] => 3:11: nothing of the frame is left
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 3, type = "u16le" }] => 3:30: a is not in a frame of 4 bytes
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u16le" }, { name = "b", at = 2, type = "u8" }] => 3:70: b is in the place of a
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, bits = 5 }, { name = "b", at = 1, bit = 4, bits = 2 }] => 3:64: b is in the place of a
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8" }, { name = "a", at = 2, type = "u8" }] => two values are called a
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", count = 2 }, { name = "a1", at = 3, type = "u8" }] => two values are called a1
    sync = "24"\nlength = 4\nfields = [{ name = "time", at = 1, type = "u8" }] => 3:20: offset, length, time are other columns' names
    sync = "24"\nlength = 4\nfields = [{ name = "A b", at = 1, type = "u8" }] => 3:20: a name has small letters
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1 }] => 3:11: a field has a type, or else bits
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", value = 256 }] => 3:54: this value does not fit
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = 1, type = "u8", unit = "m" }] => 3:46: unknown field `unit`
    sync = "24"\nlength = 4\nfields = [{ name = "a", at = -1, type = "bytes" }] => 3:30: what takes all that is left is counted from the front
    sync = "24"\nlongest = 40\nlength_field = { at = 1, type = "u8", plus = 2 }\nfields = [{ name = "a", at = 9, type = "u8", value = 1 }] => 4:54: a frame may be too short for this: give shortest
    sync = "24"\nlength = 9\nchecksum = { name = "xor", type = "u8", at = -1, extra = { at = 1, type = "u8", of = { x = 1 } } } => x is not a number
"#;

#[test]
fn what_is_wrong_with_a_description_is_told_with_its_place() {
    for case in WRONG.lines().filter(|line| !line.trim().is_empty()) {
        let (text, told) = case.trim().split_once(" => ").unwrap();
        let problem = description::parse("my.toml", &text.replace("\\n", "\n")).err();
        let problem = problem.unwrap_or_else(|| panic!("nothing is wrong with {text}"));
        let place = if told.starts_with(|c: char| c.is_ascii_digit()) {
            "my.toml:"
        } else {
            ""
        };
        assert!(
            problem.contains(&format!("{place}{told}")),
            "{text}:\n {problem}\n not {told}"
        );
    }
}
