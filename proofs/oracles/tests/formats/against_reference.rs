//! Tests that the receivers of each shipped format find the same frames as the reference. The streams have faults, and are
//! split into slices at any positions.

use framelock::LineEvent;
use framelock_oracles::{FORMATS, Occurred, Stream, StreamStep, cut, faulty, random_frame};
use rand::seq::IndexedRandom as _;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Each outcome that is possible in a format occurs.
#[test]
fn every_format() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for format in FORMATS {
        let mut occurred = Occurred::NOTHING;
        for _ in 0..200 {
            let mut steps = Vec::new();
            for _ in 0..random.random_range(1..4) {
                let count = random.random_range(0..5);
                let frames = (0..count).map(|_| {
                    let layout = format.layouts.choose(&mut random).expect("a layout");
                    random_frame(layout, &mut random).unwrap_or_else(|almost| almost)
                });
                let frames: Vec<Vec<u8>> = frames.collect();
                steps.extend(cut(&faulty(&frames, &mut random), &mut random));
                steps.push(StreamStep::Event(LineEvent::Idle));
            }
            occurred.count_all(&(format.check)(format, &Stream(steps)));
        }
        // All line events are idle gaps.
        let mut impossible = vec!["break", "framing error", "overrun", "parity error"];
        let others = match format.name {
            "SBUS" => "bad header, broken sync, checksum mismatch, too long, unknown message",
            "iBUS" => "bad header, too long, unknown message, wrong terminator",
            "CRSF" => "broken sync, unknown message, wrong terminator",
            "UBX" => "bad header, unknown message, wrong terminator",
            "MAVLink 1" => "bad header, broken sync, wrong terminator",
            "MAVLink 2" => "broken sync, wrong terminator",
            "NMEA" => "broken sync, too long, unknown message",
            "RTCM" => "broken sync, too long, unknown message, wrong terminator",
            "GNSS" => "unknown message",
            "Modbus RTU" => "bad header, broken sync, no sync, unknown message, wrong terminator",
            "BIN-CRC8" => "bad header, too long, unknown message",
            _ => "bad header, checksum mismatch, too long, unknown message",
        };
        impossible.extend(others.split(", "));
        impossible.sort_unstable();
        assert_eq!(occurred.missing(), impossible, "{}", format.name);
    }
}
