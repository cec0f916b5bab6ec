//! Suggests what to check if a stream yields few frames. Tests each guess on the stream's first bytes before suggesting
//! it.

use framelock::LineEvent;
use framelock_description::{SHIPPED, hex};
use framelock_receiving::{AnyLine, Policy, Protocol};

/// The number of bytes on which guesses are tested.
pub(super) const TRIED: usize = 64 * 1024;

/// Returns the likely reason why a stream yields few frames of `protocol`. `stream` contains the stream's first bytes.
pub(super) fn likely_cause(protocol: &Protocol, policy: Policy, stream: &[u8]) -> Option<String> {
    let own = in_frames(protocol, policy, stream);
    // A guess fits if, with this guess, more than half of all bytes are in frames, and more than twice as many bytes as
    // with the user's options.
    let fits = |protocol: &Protocol, stream: &[u8]| {
        let count = in_frames(protocol, Policy::Framelock, stream);
        2 * count > stream.len() && count > 2 * own
    };
    if let Some(bytes) = bytes_of_hex(stream)
        && in_frames(protocol, policy, &bytes) > 0
    {
        let count = bytes.len();
        return Some(format!(
            "the input is hex text for {count} bytes, which contain frames: give --input hex"
        ));
    }
    if policy == Policy::Lecture && fits(protocol, stream) {
        return Some("--policy framelock finds frames".to_owned());
    }
    let best_of_shipped = |stream: &[u8]| {
        // If several shipped frames fit equally well, suggest the first one.
        let fitting: Vec<Protocol> = shipped().filter(|other| fits(other, stream)).collect();
        let count = |other: &&Protocol| in_frames(other, Policy::Framelock, stream);
        fitting.iter().rev().max_by_key(count).cloned()
    };
    // A user's description with the same sync as a shipped description is probably a variant of the shipped one. The
    // user has then chosen the right `--frame`, but a key in the user's description is wrong.
    let is_shipped = SHIPPED.iter().any(|(name, _)| *name == protocol.name);
    if let Some(other) = best_of_shipped(stream)
        && (is_shipped || sync(&other) != sync(protocol))
    {
        return Some(format!("they are frames of {other}: give --frame {other}"));
    }
    let inverted: Vec<u8> = stream.iter().map(|byte| !byte).collect();
    if fits(protocol, &inverted) || best_of_shipped(&inverted).is_some() {
        return Some("every bit is inverted: invert the line, or the bytes".to_owned());
    }
    let is_text = stream
        .iter()
        .all(|byte| matches!(byte, b' '..=b'~' | b'\t' | b'\r' | b'\n'));
    let digits = stream.iter().filter(|byte| byte.is_ascii_digit()).count();
    (is_text && 10 * digits > 3 * stream.len()).then(|| {
        "the input looks like decimal text, such as AB128127128: have the sender write each value as a byte".to_owned()
    })
}

/// Returns the number of bytes that are in frames.
fn in_frames(protocol: &Protocol, policy: Policy, stream: &[u8]) -> usize {
    let Ok(mut line) = AnyLine::new(protocol, policy) else {
        return 0;
    };
    line.feed(stream, |_| ());
    line.line_event(LineEvent::Idle, |_| ());
    line.counters().frame_bytes as usize
}

fn shipped() -> impl Iterator<Item = Protocol> {
    let named =
        |(name, _): &(&str, &str)| Protocol::named(name).expect("shipped descriptions are valid");
    SHIPPED.iter().map(named)
}

/// Parses a text as hex. Returns its bytes.
fn bytes_of_hex(stream: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(stream).ok()?;
    // The last line may be incomplete.
    let whole = text.rsplit_once('\n').map_or(text, |(lines, _)| lines);
    hex::parse(&[whole]).ok().filter(|bytes| !bytes.is_empty())
}

fn sync(protocol: &Protocol) -> Option<&[u8]> {
    let kind = protocol.description.kinds.first()?;
    kind.layout().sync.each().next()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use std::sync::Mutex;

    use framelock_description::hex::glued;
    use framelock_simulation::examples;
    use rand::seq::IndexedMutRandom;
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
        (decoder.hint(), decoder.totals.frame_bytes)
    }

    /// Returns two hundred frames of a motion's setpoints.
    fn motion(frame: impl Fn([u8; 3]) -> Vec<u8>) -> Vec<u8> {
        let setpoints = (0..200_u32).map(|step| {
            let demand = |speed: u32| u8::try_from(128 + step * speed % 90).unwrap();
            frame([demand(1), demand(2), demand(3)])
        });
        setpoints.flatten().collect()
    }

    /// Returns the bytes of the frames of one format in `tests/recordings.txt`.
    fn recorded(wanted: &str) -> Vec<u8> {
        let lines = include_str!("../../tests/recordings.txt").lines();
        let frames = lines.filter_map(|line| line.strip_prefix(wanted)?.strip_prefix(": "));
        frames
            .flat_map(|line| hex::parse(&[line]).unwrap())
            .collect()
    }

    #[test]
    fn a_bad_stream_gets_a_hint_that_names_the_cause() {
        let good = motion(|[pitch, roll, yaw]| vec![b'A', b'B', 0, pitch, roll, yaw, b'\r']);
        let text = motion(|[pitch, roll, yaw]| format!("AB{pitch}{roll}{yaw}\r").into_bytes());
        let inverted = |bytes: &[u8]| bytes.iter().map(|byte| !byte).collect::<Vec<_>>();
        let sbus = recorded("sbus").repeat(20);
        let noise = (1..=255_u8).map(|byte| byte.wrapping_mul(77) ^ byte.wrapping_mul(byte));
        let noise: Vec<u8> = noise.collect();
        for (frame, stream, expected) in [
            ("bin", &text, "decimal text"),
            ("bin", &glued(&good).into_bytes(), "--input hex"),
            (
                "ubx",
                &b"b5 62 05 01 02 00 06 01 0f 38\r\n".repeat(3),
                "--input hex",
            ),
            ("bin", &inverted(&good), "every bit is inverted"),
            ("bin", &inverted(&sbus), "every bit is inverted"),
            ("bin", &sbus, "--frame sbus"),
            ("sbus", &good, "--frame bin"),
            ("crsf", &recorded("ubx"), "--frame ubx"),
            ("ubx", &recorded("mavlink2"), "--frame mavlink"),
            ("nmea", &recorded("rtcm"), "--frame rtcm"),
            ("ubx", &recorded("gnss"), "--frame gnss"),
            (
                "sbus",
                &noise,
                "check --frame, the baud rate and parity, and whether the line is inverted",
            ),
        ] {
            let (hint, _) = hint(frame, stream);
            assert!(
                hint.as_ref().is_some_and(|hint| hint.contains(expected)),
                "{frame}, {expected}: {hint:?}"
            );
        }
    }

    #[test]
    fn the_lectures_machine_is_named_if_the_other_finds_frames() {
        let late = b"AB\0AB\0\r".repeat(9);
        let protocol = Protocol::named("bin").unwrap();
        let cause = likely_cause(&protocol, Policy::Lecture, &late[1..]);
        assert_eq!(cause.as_deref(), Some("--policy framelock finds frames"));
    }

    /// Joins frames, of which some lose, gain or alter a byte.
    fn with_noise(frames: &[Vec<u8>], random: &mut ChaCha8Rng) -> Vec<u8> {
        let noisy = frames.iter().map(|frame| {
            let mut frame = frame.clone();
            match random.random_range(0..60) {
                0 => frame.push(random.random()),
                1 => *frame.choose_mut(random).unwrap() ^= 1 << random.random_range(0..8),
                2 => drop(frame.remove(random.random_range(0..frame.len()))),
                _ => {}
            }
            frame
        });
        noisy.flatten().collect()
    }

    #[test]
    fn streams_of_shipped_frames_get_no_hint_even_with_some_noise() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for protocol in shipped() {
            let name = &*protocol.name;
            let frames: Vec<Vec<u8>> = examples(&protocol.description, 7).take(300).collect();
            let clean = frames.concat();
            assert_eq!(hint(name, &clean), (None, clean.len() as u64), "{name}");
            for _ in 0..3 {
                let stream = with_noise(&frames, &mut random);
                let (hint, in_frames) = hint(name, &stream);
                assert_eq!(hint, None, "{name}");
                assert!(
                    5 * in_frames > 4 * stream.len() as u64,
                    "{name}: {in_frames}"
                );
            }
            let recorded = recorded(name).repeat(20);
            assert_eq!(
                hint(name, &recorded),
                (None, recorded.len() as u64),
                "{name}"
            );
        }
    }
}
