//! Tests of the hint that `decode` prints about a bad stream. Each kind of hint has a stream for which it appears, and
//! streams with other causes get no hint except the general one.

use framelock_receiving::Protocol;
use framelock_simulation::examples;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::process::{described, run, text};

/// The hint for a stream whose bytes do not show the cause.
const GENERAL: &str =
    "check --frame, --input, the baud rate and parity, and whether the line is inverted";

/// Returns the hint without its numbers, or an empty text if there is no hint.
fn hint(arguments: &[&str], bytes: &[u8]) -> String {
    let output = run(&[&["decode", "--format=none"], arguments].concat(), bytes);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let message = text(output.stderr);
    let advice = message.split_once("; ").map_or("", |(_, advice)| advice);
    advice.trim_end().to_owned()
}

/// Returns the bytes of `count` example frames of a shipped description.
fn frames(name: &str, seed: u64, count: usize) -> Vec<u8> {
    let protocol = Protocol::named(name).unwrap();
    let description = &protocol.description;
    let frames = examples(description, seed).take(count);
    frames
        .flat_map(|frame| description.sent(&frame).unwrap())
        .collect()
}

/// Sets the top bit of each byte to the parity of the other bits: `odd` is 0 for even parity.
fn with_parity(bytes: &[u8], odd: u32) -> Vec<u8> {
    let parity = |byte: &u8| {
        if (byte.count_ones() + odd) % 2 == 1 {
            0x80
        } else {
            0
        }
    };
    bytes.iter().map(|byte| byte | parity(byte)).collect()
}

fn in_hex(bytes: &[u8]) -> Vec<u8> {
    let words = bytes.iter().map(|byte| format!("{byte:02X} "));
    words.collect::<String>().into_bytes()
}

/// Replaces each CR LF by `line_end`.
fn with_line_ends(text: &[u8], line_end: &[u8]) -> Vec<u8> {
    let lines = String::from_utf8(text.to_vec()).unwrap();
    let line_end = str::from_utf8(line_end).unwrap();
    lines.replace("\r\n", line_end).into_bytes()
}

fn inverted(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().map(|byte| !byte).collect()
}

const SENTENCES: &[u8] =
    b"$GPGGA,163929.85,3824.11,S,14435.82,E,1,10,0.98,1113.0,M,-21.3,M,25,10*53\r\n\
    $IIVWR,024,L,018,N,,,,*5e\r\n";
const BARE_SENTENCES: &[u8] = b"$IIMWV,30,T,1.85,M,A\r\n\
    $GPGGA,163929.85,3824.11,S,14435.82,E,1,10,0.98,1113.0,M,-21.3,M,25,10*53\r\n\
    $RPYL,15,9,314,11,0,1009,0\r\n$IIVWR,024,L,018,N,,,,*5e\r\n";
/// The checksums of the commands cover the $.
const COMMANDS: &[u8] = b"$command,VERSIONA,response: OK*45\r\n$command,CONFIG,response: OK*54\r\n\
    $CONFIG,ANTENNA,CONFIG ANTENNA POWERON*7A\r\n$CONFIG,PPP,CONFIG PPP ENABLE E6-HAS*01\r\n\
    $GPTXT,01,01,02,MA=CASIC*27\r\n$GNRMC,195233.926,V,,,,,,,150323,,,M,V*2E\r\n";

#[test]
#[expect(clippy::too_many_lines, reason = "a row for each hint")]
fn each_hint_has_a_stream_for_which_it_appears() {
    let (ubx, crsf) = (frames("ubx", 1, 9), frames("crsf", 1, 9));
    let lines = "terminator = '0A'\ncontent = '20-7E'\nsync = '23'\nlongest = 40";
    let (_folder, lines) = described(lines);
    let sum = "sync = 'AA 55'\nlength = 7\nchecksum = { name = 'sum', type = 'u8', at = -1 }";
    let (_other_folder, sum) = described(sum);
    let xor = (0..20).flat_map(|n| [0xAA, 0x55, n, 3 * n, 7, 9, n ^ (3 * n) ^ 7 ^ 9]);
    // In the last frame, the sum is right by chance.
    let xor: Vec<u8> = xor.chain([0xAA, 0x55, 0, 0, 7, 9, 0x0F]).collect();
    let nearly_all = "nearly all would be in frames";
    let mut other_end = frames("sbus", 1, 5);
    other_end.chunks_mut(25).for_each(|frame| frame[24] = 8);
    let row = |(number, byte): (usize, &u8)| format!("0.{number:06},0x{byte:02X},,\n");
    let rows: String = ubx.iter().enumerate().map(row).collect();
    let analyser = format!("Time [s],Value,Parity Error,Framing Error\n{rows}");
    let dump_row = |(number, bytes): (usize, &[u8])| {
        let words: Vec<_> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        format!("{:08x}: {}\n", 16 * number, words.join(" "))
    };
    let dump: String = ubx.chunks(16).enumerate().map(dump_row).collect();
    let time = 1_690_000_000_000_000_u64.to_be_bytes();
    let frame = frames("mavlink2", 1, 1);
    let tlog = [&time[..], &frame, &time, &frame, &time, &frame].concat();
    let cases: [(&[&str], &[u8], &str); 23] = [
        (
            &["--frame=sbus"],
            &other_end,
            " of sbus-any (--frame sbus-any)",
        ),
        (&["--frame=ubx"], analyser.as_bytes(), " with --input csv"),
        (&["--frame=ubx"], dump.as_bytes(), " with --input hex"),
        (&["--frame=mavlink"], &tlog, " with --input tlog"),
        (&[], &tlog, " of mavlink (--frame mavlink)"),
        (
            &[],
            b"A127B127C127XA0B255C127XA3B4C5X",
            " of axes-text (--frame axes-text)",
        ),
        (
            &["--frame=nmea"],
            BARE_SENTENCES,
            " without checksums (see docs/recordings.md)",
        ),
        (
            &["--frame=gnss"],
            BARE_SENTENCES,
            " without checksums (see docs/recordings.md)",
        ),
        (
            &["--frame=nmea"],
            COMMANDS,
            " whose checksums cover the bytes from 0 on",
        ),
        (&[&sum], &xor, " with any checksums"),
        (
            &["--frame=nmea"],
            &with_line_ends(SENTENCES, b"\r"),
            " if lines ended with CR LF",
        ),
        (
            &[&lines],
            b"#speed 12\r#speed 13\r#speed 14\r",
            " if lines ended with LF",
        ),
        (
            &["--frame=nmea"],
            &with_parity(SENTENCES, 0),
            " with --data-bits 7",
        ),
        (
            &["--frame=gnss"],
            &with_parity(SENTENCES, 1),
            " with --data-bits 7",
        ),
        (
            &[],
            &with_parity(SENTENCES, 0),
            " of nmea (--frame nmea) with --data-bits 7",
        ),
        (&[], b"41 42 00 7F C8 4A 0D", " with --input hex"),
        (
            &["--frame=slip"],
            &in_hex(&frames("slip", 1, 4)),
            " with --input hex",
        ),
        (
            &[],
            &in_hex(&crsf),
            " of crsf (--frame crsf) with --input hex",
        ),
        (&["--frame=sbus"], &ubx, " of ubx (--frame ubx)"),
        (
            &["--frame=ubx"],
            &inverted(&ubx),
            " if every bit were inverted",
        ),
        (
            &["--frame=modbus-rtu"],
            b"\x01\x03\x02\x00\x00\xB8\x45",
            "silence ends these frames",
        ),
        (
            &["--frame=bin"],
            b"P127 R127 Y12\r\nP1 R20 Y300\r\n",
            "the input looks like text with decimal numbers",
        ),
        (
            &["--frame=bin"],
            b"{512|512|512}{512|1023|-1}",
            "the input looks like text with decimal numbers",
        ),
    ];
    for (arguments, bytes, expected) in cases {
        let found = hint(arguments, bytes);
        let found = found.strip_prefix(nearly_all).unwrap_or(&found);
        assert!(
            found.starts_with(expected),
            "{arguments:?}: {expected}: {found}"
        );
    }
    let only = ["--frame=ubx", "--only=NAV-PVT"];
    let output = run(&[&["decode"], &only[..]].concat(), frames("ubx", 1, 9));
    let hint = text(output.stderr);
    assert!(
        hint.contains("but none of them is NAV-PVT; their kinds: "),
        "{hint}"
    );
}

/// Returns streams whose bytes do not show why they are in no frames: a cause, the frames to try, and the bytes.
fn streams_with_other_causes() -> Vec<(&'static str, &'static str, Vec<u8>)> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut noise = |count| (0..count).map(|_| random.random()).collect::<Vec<u8>>();
    let (ubx, sbus) = (frames("ubx", 2, 60), frames("sbus", 1, 40));
    let mut damaged = ubx.clone();
    for (at, change) in noise(ubx.len() / 30).into_iter().enumerate() {
        damaged[30 * at + usize::from(change) % 30] ^= change;
    }
    let mut wrong_digits = frames("nmea", 2, 60);
    let lines = wrong_digits.chunks_exact_mut(25);
    lines.for_each(|line| line[3] = b'0' + line[3] % 10);
    let ends = sbus.chunks(25).flat_map(|frame| frame[12..].to_vec());
    let walk = (0..2000_u16).flat_map(|n| (4000 + n / 8 * 7 % 600).to_le_bytes());
    let numbers = "20,42,64,86,08\r\n".repeat(40);
    let numbers = numbers.encode_utf16().flat_map(u16::to_le_bytes);
    let servo = |id: u8| {
        [
            0x55,
            0x55,
            id,
            7,
            1,
            3 * id,
            1,
            200,
            0,
            !(12 + 4 * id + 200),
        ]
    };
    let compressed = [&b"\x1F\x8B\x08\0\0\0\0\0\0\x03"[..], &noise(900)].concat();
    vec![
        ("nothing", "bin sbus", vec![]),
        ("one byte", "nmea ubx", vec![b'$']),
        ("zeros", "cobs sbus ibus", vec![0; 500]),
        ("a line that is high", "six-axes bin crsf", vec![0xFF; 500]),
        ("alternating bits", "bin ubx", [0x55, 0xAA].repeat(300)),
        ("the sync of SBUS alone", "bin sbus", vec![0x0F; 500]),
        (
            "all bytes in order",
            "mavlink cobs",
            (0..=255).cycle().take(2000).collect(),
        ),
        ("noise", "crsf slip bin nmea", noise(5000)),
        ("little noise", "ibus crsf sbus", noise(30)),
        (
            "the same noise again and again",
            "slip",
            [&noise(19)[..], &[!0xC0]].concat().repeat(9),
        ),
        ("another baud rate", "ubx", at_half_the_baud_rate(&ubx)),
        ("an inverted line", "sbus", on_an_inverted_line(&sbus)),
        ("half a frame", "ubx", ubx[4..12].to_vec()),
        ("half of each frame", "sbus", ends.collect()),
        ("a good stream with many errors", "ubx", damaged),
        ("a good text with many errors", "nmea", wrong_digits),
        (
            "one damaged asterisk",
            "nmea gnss",
            b"$GPTXT,ok*67\r\n$GPTXT,ok 67\r\n".to_vec(),
        ),
        (
            "a good stream in noise",
            "ubx",
            [noise(3000), ubx, noise(3000)].concat(),
        ),
        ("samples of 16 bits", "dsmr-p1", walk.collect()),
        ("servos", "six-axes", (1..9).flat_map(servo).collect()),
        (
            "MultiWii",
            "nmea",
            b"$M>\x06\x6c\x0b\x00\xf6\xff\x5a\x00\xcd".repeat(20),
        ),
        ("compressed data", "hdlc mavlink", compressed),
        (
            "text",
            "nmea",
            b"The quick brown fox jumps over the lazy dog.\r\n".repeat(30),
        ),
        ("a program", "gnss", include_bytes!("hints.rs").to_vec()),
        ("numbers in UTF-16", "crsf", numbers.collect()),
    ]
}

/// Returns the levels of a line with 8 data bits, no parity and 1 stop bit.
fn levels(bytes: &[u8]) -> Vec<bool> {
    let bits = |byte: &u8| {
        let byte = *byte;
        let data = (0..8).map(move |bit| byte >> bit & 1 == 1);
        std::iter::once(false).chain(data).chain([true])
    };
    bytes.iter().flat_map(bits).collect()
}

/// Returns the bytes that a receiver finds in the levels of a line, whatever the stop bits are.
fn sampled(levels: &[bool]) -> Vec<u8> {
    let (mut bytes, mut rest) = (Vec::new(), levels);
    while let Some(start) = rest.windows(2).position(|pair| pair == [true, false]) {
        let Some(data) = rest.get(start + 2..start + 10) else {
            break;
        };
        bytes.push((0..8).fold(0, |byte, bit| byte | u8::from(data[bit]) << bit));
        rest = &rest[start + 10..];
    }
    bytes
}

fn at_half_the_baud_rate(bytes: &[u8]) -> Vec<u8> {
    let levels: Vec<bool> = levels(bytes).into_iter().step_by(2).collect();
    sampled(&levels)
}

fn on_an_inverted_line(bytes: &[u8]) -> Vec<u8> {
    let levels: Vec<bool> = levels(bytes).into_iter().map(|level| !level).collect();
    sampled(&levels)
}

#[test]
fn no_special_hint_appears_for_streams_with_other_causes() {
    for (cause, names, bytes) in streams_with_other_causes() {
        for name in names.split(' ') {
            let found = hint(&["--frame", name], &bytes);
            assert!([GENERAL, ""].contains(&&*found), "{cause}, {name}: {found}");
            assert!(
                bytes.len() > 1 || found.is_empty() == bytes.is_empty(),
                "{cause}: {found}"
            );
        }
    }
}

#[test]
fn random_streams_have_the_hint_of_their_change() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for number in 0..30 {
        let names = ["bin", "ibus", "crsf", "ubx", "nmea", "rtcm", "six-axes"];
        let name = *names.choose(&mut random).unwrap();
        let count = random.random_range(4..30);
        let bytes = frames(name, number, count);
        let text = frames("nmea", number, count);
        let mut names = [name, name];
        let (changed, expected) = match number % 6 {
            0 => (in_hex(&bytes), "with --input hex"),
            1 => (inverted(&bytes), "if every bit were inverted"),
            2 => {
                names = [name, "sbus"];
                (bytes, "")
            }
            3 => {
                names = [name, "kiss"];
                (in_hex(&bytes), "with --input hex")
            }
            4 => {
                names = ["nmea"; 2];
                (
                    with_parity(&text, random.random_range(0..2)),
                    "with --data-bits 7",
                )
            }
            _ => {
                names = ["nmea"; 2];
                (with_line_ends(&text, b"\r"), "if lines ended with CR LF")
            }
        };
        let found = hint(&["--frame", names[1]], &changed);
        let other = format!(" of {name} (--frame {name})");
        let other = if names[0] == names[1] { "" } else { &*other };
        let expected = format!("nearly all would be in frames{other} {expected}");
        assert_eq!(found, expected.trim_end(), "{number}: {name}, {count}");
    }
}
