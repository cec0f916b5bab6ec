//! Tests each hint, and streams that get no hint.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use framelock::{Classification, Format as _};
use framelock_description::hex::glued;
use rand::seq::{IndexedMutRandom, IndexedRandom};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::decode::{Decoder, OutputFormat, decode, lock};
use crate::input::Input;

/// Returns the hint for a whole stream, and the number of the stream's bytes that are in frames.
fn hint(frame: &str, stream: &[u8]) -> (Option<String>, u64) {
    let protocol = Protocol::named(frame).unwrap();
    let decoder = Decoder::new(&protocol, Policy::Framelock, OutputFormat::Csv, Vec::new());
    let decoder = Mutex::new(decoder.unwrap());
    decode(&decoder, Input::new("", stream)).unwrap();
    let decoder = lock(&decoder);
    assert_eq!(decoder.totals.bytes, stream.len() as u64);
    (decoder.hint(), decoder.totals.frame_bytes)
}

fn cause(frame: &str, stream: &[u8]) -> String {
    hint(frame, stream).0.unwrap_or_default()
}

/// Returns two hundred frames of a motion's setpoints.
fn motion(frame: impl Fn([u8; 3]) -> Vec<u8>) -> Vec<u8> {
    let setpoints = (0..200_u32).map(|step| {
        let demand = |speed: u32| u8::try_from(128 + step * speed % 90).unwrap();
        frame([demand(1), demand(2), demand(3)])
    });
    setpoints.flatten().collect()
}

fn bin([pitch, roll, yaw]: [u8; 3]) -> Vec<u8> {
    vec![b'A', b'B', 0, pitch, roll, yaw, b'\r']
}

/// Returns the bytes of the frames of one format in `tests/recordings.txt`.
fn recorded(wanted: &str) -> Vec<u8> {
    let lines = include_str!("../../../tests/recordings.txt").lines();
    let frames = lines.filter_map(|line| line.strip_prefix(wanted)?.strip_prefix(": "));
    frames
        .flat_map(|line| hex::parse(&[line]).unwrap())
        .collect()
}

#[test]
fn a_bad_stream_gets_a_hint_that_names_the_cause() {
    let good = motion(bin);
    let text = |[pitch, roll, yaw]: [u8; 3]| format!("AB{pitch}{roll}{yaw}\r").into_bytes();
    let wide = |[pitch, roll, yaw]: [u8; 3]| vec![b'A', b'B', 0, pitch, 1, roll, 2, yaw, 3, b'\r'];
    let checked = |[pitch, roll, yaw]: [u8; 3]| vec![b'A', b'B', 0, pitch, roll, yaw, 9, b'\r'];
    let line_feed = |setpoint| [&bin(setpoint)[..6], b"\n"].concat();
    let inverted = |bytes: &[u8]| bytes.iter().map(|byte| !byte).collect::<Vec<_>>();
    let mut sbus = recorded("sbus").repeat(20);
    let lowest = |byte: u8| byte & 0xFE;
    let slow: Vec<u8> = good
        .iter()
        .flat_map(|&byte| [lowest(byte << 1), lowest(byte >> 3)])
        .collect();
    for (frame, stream, told) in [
        ("bin", motion(text), "decimal text"),
        ("bin", b"AB128127128\r".repeat(100), "decimal text"),
        (
            "ubx",
            b"Booting v1.2, please wait\r\n".repeat(9),
            "looks like text",
        ),
        ("bin", glued(&good).into_bytes(), "--input hex"),
        (
            "ubx",
            b"b5 62 05 01 02 00 06 01 0f 38\r\n".repeat(3),
            "--input hex",
        ),
        ("sbus", b"DE AD BE EF\n".repeat(30), "--input hex"),
        (
            "bin",
            motion(wide),
            "4142 repeats every 10 bytes, and a frame of bin has 7: are its values 16 bits wide?",
        ),
        (
            "bin",
            motion(checked),
            "4142 repeats every 8 bytes, and a frame of bin has 7",
        ),
        (
            "bin",
            motion(line_feed),
            "end in CR, but other line ends arrive",
        ),
        ("bin", inverted(&good), "every bit is inverted"),
        ("bin", inverted(&sbus), "every bit is inverted"),
        ("bin", sbus.clone(), "--frame sbus"),
        ("sbus", good.clone(), "--frame bin"),
        ("crsf", recorded("ubx"), "--frame ubx"),
        ("ubx", recorded("mavlink2"), "--frame mavlink"),
        ("nmea", recorded("rtcm"), "--frame rtcm"),
        ("ubx", recorded("gnss"), "--frame gnss"),
        ("bin", slow, "half the baud rate"),
        (
            "ubx",
            [
                &recorded("ubx")[..],
                &[0xB5, 0x62, 2, 0x15, 0, 0x20],
                &[1; 300],
            ]
            .concat(),
            "raise longest",
        ),
        (
            "mavlink2",
            [
                &recorded("mavlink2")[..],
                &[0xFD, 4, 0, 0, 0, 1, 1, 0xFF, 0xFF, 0xFF],
                &[1; 300],
            ]
            .concat(),
            "add them to messages",
        ),
        (
            "crsf",
            [&recorded("crsf")[..], &[0xC8, 1], &[1; 300]].concat(),
            "check shortest",
        ),
    ] {
        let cause = cause(frame, &stream);
        assert!(cause.contains(told), "{frame}, {told}: {cause}");
    }
    // Noise fits no cause, so the hint lists the settings to check.
    sbus.iter_mut().enumerate().for_each(|(at, byte)| {
        *byte = byte
            .wrapping_mul(77)
            .wrapping_add((at * at).to_le_bytes()[0]);
    });
    let told = cause("sbus", &sbus);
    assert!(
        told.ends_with("check --frame, the baud rate and parity, and whether the line is inverted"),
        "{told}"
    );
}

#[test]
fn a_sender_that_leaves_out_a_byte_is_suspected() {
    let short = |[pitch, roll, yaw]: [u8; 3]| vec![b'A', b'B', pitch, roll, yaw, b'\r'];
    let wide = |[pitch, roll, yaw]: [u8; 3]| vec![b'A', b'B', 1, pitch, 2, roll, 3, yaw, b'\r'];
    let told = cause("bin", &motion(short));
    assert!(told.ends_with("has 7: is a byte missing?"), "{told}");
    let told = cause("bin", &motion(wide));
    let wanted = "has 7: are its values 16 bits wide, and is a byte missing?";
    assert!(told.ends_with(wanted), "{told}");
}

#[test]
fn dumps_and_text_of_windows_are_recognised() {
    let (mut bytes, mut pairs) = (String::new(), String::new());
    for (row, part) in motion(bin).chunks(16).enumerate() {
        let words: Vec<String> = part.iter().map(|byte| glued(&[*byte])).collect();
        let text = String::from_utf8_lossy(part).replace(char::is_control, ".");
        let text: String = text.chars().filter(char::is_ascii).collect();
        // A line as `hexdump -C` and `xxd` write it.
        writeln!(bytes, "{row:07x}0  {}  |{text}|", words.join(" ")).unwrap();
        let words: Vec<String> = words.chunks(2).map(<[String]>::concat).collect();
        writeln!(pairs, "{row:07x}0: {}  {text}", words.join(" ")).unwrap();
    }
    for dump in [bytes, pairs] {
        let told = cause("bin", dump.as_bytes());
        assert!(told.contains("looks like a hex dump"), "{told}\n{dump}");
    }
    let utf_16 = "\u{FEFF}41 42 00 7F C8 4A 0D\r\n".encode_utf16();
    let utf_16: Vec<u8> = utf_16.flat_map(u16::to_le_bytes).collect();
    let told = cause("bin", &utf_16);
    assert!(told.contains("UTF-16"), "{told}");
}

#[test]
fn the_lectures_machine_is_named_if_the_other_finds_frames() {
    let late = b"AB\0AB\0\r".repeat(9);
    let protocol = Protocol::named("bin").unwrap();
    let cause = likely_cause(&protocol, Policy::Lecture, &late[1..]);
    assert_eq!(cause.as_deref(), Some("--policy framelock finds frames"));
}

/// Returns frames of all kinds with random content.
fn random_frames(protocol: &Protocol, random: &mut ChaCha8Rng) -> Vec<Vec<u8>> {
    let (format, mut frames) = (protocol.description.format(), Vec::new());
    for _ in 0..20_000 {
        let layout = protocol.description.kinds.choose(random).unwrap().layout;
        let longest = layout.longest.min(layout.shortest + 60);
        let length = random.random_range(layout.shortest.max(1)..=longest);
        let is_content = |byte: u8| {
            let ranges = layout.content;
            ranges.is_empty() || ranges.iter().any(|(a, b)| (a..=b).contains(&&byte))
        };
        let content: Vec<u8> = (0..=u8::MAX).filter(|byte| is_content(*byte)).collect();
        let mut frame: Vec<u8> = (0..length)
            .map(|_| *content.choose(random).unwrap())
            .collect();
        if let Some(messages) = layout.messages {
            let number = messages.known.choose(random).unwrap().number.to_le_bytes();
            let place = frame.iter_mut().skip(messages.number.at);
            let bytes = number.iter().take(messages.number.bytes);
            place.zip(bytes).for_each(|(place, byte)| *place = *byte);
        }
        let is_frame = layout.seal(&mut frame);
        if is_frame && format.classify(&frame) == Classification::Frame(frame.len()) {
            frames.push(frame);
        }
        if frames.len() == 300 {
            break;
        }
    }
    frames
}

/// Joins frames. If `is_noisy`, inserts, alters and loses some bytes.
fn joined(frames: &[Vec<u8>], is_noisy: bool, random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut stream = Vec::new();
    for frame in frames {
        let mut frame = frame.clone();
        if is_noisy {
            match random.random_range(0..60) {
                0 => frame.extend((0..random.random_range(1..4)).map(|_| random.random::<u8>())),
                1 => *frame.choose_mut(random).unwrap() ^= 1 << random.random_range(0..8),
                2 => drop(frame.remove(random.random_range(0..frame.len()))),
                _ => {}
            }
        }
        stream.extend(frame);
    }
    stream
}

#[test]
fn streams_of_shipped_frames_get_no_hint_even_with_some_noise() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for (name, _) in SHIPPED {
        let protocol = Protocol::named(name).unwrap();
        let frames = random_frames(&protocol, &mut random);
        assert!(frames.len() >= 100, "{name}: {}", frames.len());
        for number in 0..protocol.description.kinds.len() {
            let is_it = |frame: &Vec<u8>| protocol.description.number(frame) == number;
            assert!(frames.iter().any(is_it), "{name}: {number}");
        }
        for is_noisy in [false, true, true, true] {
            let stream = joined(&frames, is_noisy, &mut random);
            let (hint, in_frames) = hint(name, &stream);
            assert_eq!(hint, None, "{name}");
            let bytes = stream.len() as u64;
            assert!(5 * in_frames > 4 * bytes, "{name}: {in_frames} of {bytes}");
            assert_eq!(in_frames == bytes, !is_noisy, "{name}");
        }
        let recorded = recorded(name);
        for times in [1, 20] {
            let (hint, in_frames) = hint(name, &recorded.repeat(times));
            assert_eq!((hint, in_frames), (None, (recorded.len() * times) as u64));
        }
    }
}

/// Decodes each of the fuzzer's inputs with every shipped description.
#[test]
fn streams_of_the_corpora_that_decode_well_get_no_hint() {
    let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let protocols: Vec<Protocol> = shipped().collect();
    let mut good = 0;
    for corpus in fs::read_dir(corpora).unwrap() {
        for file in fs::read_dir(corpus.unwrap().path()).unwrap() {
            let path = file.unwrap().path();
            let stream = fs::read(&path).unwrap();
            for protocol in &protocols {
                if 2 * in_frames(protocol, Policy::Framelock, &stream) > stream.len() {
                    let (hint, _) = hint(&protocol.name, &stream);
                    assert_eq!(hint, None, "{protocol}: {}", path.display());
                    good += 1;
                }
            }
        }
    }
    assert!(good > 10, "{good}");
}
