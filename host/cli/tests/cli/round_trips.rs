//! Tests that frames which `decode` writes as a table become the same frames again with `encode`, byte for byte,
//! whatever texts and numbers the frames contain.

use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::process::{described, shown, written};

/// Frames with text of any length and with numbers at the limits of their types.
const TEXTS: &str = "
    sync = 'AA 55'
    length_field = { at = 2, type = 'u8', plus = 3 }
    longest = 120
    fields = [
        { name = 'whole', at = 3, type = 'u64le' },
        { name = 'signed', at = 11, type = 'i64be' },
        { name = 'float', at = 19, type = 'f32le' },
        { name = 'degrees', at = 23, type = 'i32le', scale = 0.001, unit = 'deg' },
        { name = 'volts', at = 27, type = 'u16be', scale = 0.25, offset = -3.5, unit = 'V' },
        { name = 'text', at = 29, type = 'text' },
    ]
";

/// The number of bytes before the text.
const NUMBERS: usize = 29;

/// Texts that a table might change: blanks, separators, quotes, line ends, comments, numbers, escapes, and bytes that
/// are no text.
const PIECES: [&[u8]; 30] = [
    b" ",
    b"  ",
    b"\t",
    b",",
    b";",
    b"\"",
    b"\"\"",
    b"'",
    b"\\",
    b"\\x20",
    b"\\\\",
    b"\n",
    b"\r",
    b"\r\n",
    b"#",
    b"0",
    b"1e5",
    b"-0",
    b"NaN",
    b"null",
    b"{",
    b"[",
    "é".as_bytes(),
    "é ".as_bytes(),
    "\u{A0}".as_bytes(),
    "\u{3000}".as_bytes(),
    "\u{FEFF}".as_bytes(),
    "😀".as_bytes(),
    b"\0",
    b"\xFF",
];

fn any_text(random: &mut ChaCha8Rng) -> Vec<u8> {
    let pieces = (0..random.random_range(0..6)).map(|_| match random.random_range(0..3) {
        0 => vec![random.random()],
        1 => vec![random.random_range(b' '..=b'~')],
        _ => PIECES.choose(random).unwrap().to_vec(),
    });
    pieces.collect::<Vec<_>>().concat()
}

/// Returns a number that is often at a limit of its type.
fn any_number<const N: usize>(random: &mut ChaCha8Rng) -> [u8; N] {
    match random.random_range(0..6) {
        0 => [0; N],
        1 => [0xFF; N],
        2 => std::array::from_fn(|at| if at == 0 { 0x80 } else { 0 }),
        3 => std::array::from_fn(|at| if at == N - 1 { 0x7F } else { 0xFF }),
        _ => random.random::<[u8; 8]>()[..N].try_into().unwrap(),
    }
}

/// Returns the bits of a float. The only NaN is `f32::NAN`, because the tables do not distinguish NaNs.
fn any_float(random: &mut ChaCha8Rng) -> [u8; 4] {
    let special = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        0.0,
        -0.0,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        f32::from_bits(1),
    ];
    let number = if random.random_range(0..3) == 0 {
        *special.choose(random).unwrap()
    } else {
        f32::from_bits(random.random())
    };
    let number = if number.is_nan() { f32::NAN } else { number };
    number.to_le_bytes()
}

fn frame(random: &mut ChaCha8Rng, text: &[u8]) -> Vec<u8> {
    let (whole, signed) = (any_number::<8>(random), any_number::<8>(random));
    let (float, degrees, volts) = (
        any_float(random),
        any_number::<4>(random),
        any_number::<2>(random),
    );
    let length = u8::try_from(NUMBERS + text.len() - 3).unwrap();
    [
        &[0xAA, 0x55, length][..],
        &whole,
        &signed,
        &float,
        &degrees,
        &volts,
        text,
    ]
    .concat()
}

/// Asserts that the frames of this stream pass through each table unchanged.
#[track_caller]
fn check(frame: &str, stream: &[u8], frames: usize) {
    let json = shown(&["decode", frame], stream);
    let csv = shown(&["decode", frame, "--format=csv"], stream);
    assert_eq!(
        [json.lines().count(), csv.lines().count()],
        [frames, frames + 1]
    );
    // A spreadsheet may end lines with CR and LF.
    let spreadsheet = csv.replace('\n', "\r\n");
    for table in [json, csv, spreadsheet] {
        let again = written(&["encode", frame], &table);
        let mut pairs = again.iter().zip(stream);
        let differs = pairs.position(|(one, other)| one != other);
        assert!(again == stream, "byte {differs:?} differs in\n{table}");
    }
}

#[test]
fn any_texts_and_numbers_come_back_through_each_table() {
    let (_folder, option) = described(TEXTS);
    let mut random = ChaCha8Rng::seed_from_u64(63);
    let count = 3_000;
    let frames = (0..count).map(|_| {
        let text = any_text(&mut random);
        frame(&mut random, &text)
    });
    let stream = frames.collect::<Vec<_>>().concat();
    check(&option, &stream, count);
}

/// The texts are each piece alone, and each pair of pieces, with and without a letter between the two.
#[test]
fn each_pair_of_special_texts_comes_back_through_each_table() {
    let (_folder, option) = described(TEXTS);
    let mut random = ChaCha8Rng::seed_from_u64(64);
    let mut frames = vec![frame(&mut random, b"")];
    for one in PIECES {
        frames.push(frame(&mut random, one));
        for other in PIECES {
            for text in [[one, b"", other].concat(), [one, b"a", other].concat()] {
                frames.push(frame(&mut random, &text));
            }
        }
    }
    check(&option, &frames.concat(), frames.len());
}

/// If frames have only texts, a row of their table may look like a header, a comment or a blank line.
#[test]
fn a_table_of_texts_alone_comes_back() {
    let text_only = "
        sync = 'AA 55'
        length_field = { at = 2, type = 'u8', plus = 3 }
        longest = 120
        fields = [{ name = 'text', at = 3, type = 'text' }]
    ";
    let (_folder, option) = described(text_only);
    let mut random = ChaCha8Rng::seed_from_u64(65);
    let mut frames = Vec::new();
    for _ in 0..1_000 {
        let text = any_text(&mut random);
        frames.push([&[0xAA, 0x55, u8::try_from(text.len()).unwrap()][..], &text].concat());
    }
    check(&option, &frames.concat(), frames.len());
}

/// A number with a scale has decimals. Each number of 16 bits must come back from its decimals, also if they are not
/// exact: `encode` takes the nearest number (docs/own-frame.md).
#[test]
fn decimals_become_the_nearest_number() {
    let text = "
        sync = 'AA 55'
        length = 4
        fields = [{ name = 'position', at = 2, type = 'i16le', scale = 0.03 }]
    ";
    let (_folder, option) = described(text);
    let all = || i16::MIN..=i16::MAX;
    let frames = all().map(|number| [&[0xAA, 0x55][..], &number.to_le_bytes()].concat());
    let stream = frames.collect::<Vec<_>>().concat();
    check(&option, &stream, 1 << 16);
    // The numbers in these tables are off by less than 0.015, which is half of the scale.
    for off in [-0.0149, -0.0051, 0.0051, 0.0149] {
        for begin in ["position\n", ""] {
            let rows = all().map(|number| format!("{:.5}\n", f64::from(number) * 0.03 + off));
            let table = begin.to_owned() + &rows.collect::<String>();
            assert!(written(&["encode", &option], table) == stream, "{off}");
        }
        let rows =
            all().map(|number| format!("{{\"position\":{:.5}}}\n", f64::from(number) * 0.03 + off));
        assert!(
            written(&["encode", &option], rows.collect::<String>()) == stream,
            "{off}"
        );
    }
}
