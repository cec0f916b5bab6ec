//! Each hint, and streams without one.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use framelock_description::hex::glued;

use super::*;

fn cause(frame: &str, stream: &[u8]) -> String {
    let protocol = Protocol::named(frame).unwrap();
    likely_cause(&protocol, Policy::Framelock, stream).unwrap_or_default()
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
            "end in CR, and other line ends arrive",
        ),
        ("bin", inverted(&good), "every bit is inverted"),
        ("bin", inverted(&sbus), "every bit is inverted"),
        ("bin", sbus.clone(), "--frame sbus"),
        ("sbus", good.clone(), "--frame bin"),
        ("crsf", recorded("ubx"), "--frame ubx"),
        ("ubx", recorded("mavlink2"), "--frame mavlink"),
        ("nmea", recorded("rtcm"), "--frame rtcm"),
        ("ubx", recorded("gnss"), "--frame gnss"),
        ("bin", slow, "half of the baud rate"),
    ] {
        let cause = cause(frame, &stream);
        assert!(cause.contains(told), "{frame}, {told}: {cause}");
    }
    // For noise, no cause is certain.
    sbus.iter_mut().enumerate().for_each(|(at, byte)| {
        *byte = byte
            .wrapping_mul(77)
            .wrapping_add((at * at).to_le_bytes()[0]);
    });
    assert_eq!(cause("sbus", &sbus), "");
}

#[test]
fn the_lectures_machine_is_named_if_the_other_finds_frames() {
    let late = b"AB\0AB\0\r".repeat(9);
    let protocol = Protocol::named("bin").unwrap();
    let cause = likely_cause(&protocol, Policy::Lecture, &late[1..]);
    assert_eq!(cause.as_deref(), Some("--policy framelock finds frames"));
}
