//! Tests that the receivers of each shipped format find the same frames as the reference. The streams have faults, and
//! are split into slices at any positions.

use std::ops::Range;

use framelock::{BufferedReceiver, Format as _, LineEvent};
use framelock_formats::AnyOf;
use framelock_formats::layout::{CheckedLayout, Length};
use framelock_oracles::{FORMATS, Occurred, Stream, StreamStep, broken, cut, faulty, random_frame};
use rand::seq::IndexedRandom as _;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Each outcome that is possible in a format occurs, and the receivers reach each state that the oracle counts.
#[test]
fn every_format() {
    let (mut random, mut of_all) = (ChaCha8Rng::seed_from_u64(1), Occurred::NOTHING);
    // All line events are idle gaps, and none of the formats has packets.
    let by_events = [
        "break",
        "broken stuffing",
        "framing error",
        "overrun",
        "parity error",
    ];
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
            occurred.count_all(&(format.check)(format, &Stream(steps), &mut of_all));
        }
        let mut impossible = by_events.to_vec();
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
    assert_eq!(of_all.missing(), by_events);
}

/// Sends frames, and broken copies of some of them, and then reports a line event. If silence ends frames, reports a
/// pause after each frame, too. Asserts that each frame is delivered, unless it shares bytes with a delivered frame
/// that begins earlier or at the same byte. Returns the number of frames that are delivered, and the number of the
/// others.
pub(crate) fn whole_frames_are_delivered(
    layouts: &[CheckedLayout],
    frames: &[Vec<u8>],
    event: LineEvent,
    random: &mut ChaCha8Rng,
) -> [usize; 2] {
    let buffer = vec![0; AnyOf(layouts).longest()];
    let mut receiver = BufferedReceiver::with_buffer(AnyOf(layouts), buffer).expect("it fits");
    let is_silent = layouts
        .iter()
        .any(|layout| layout.length == Length::Silence);
    let (mut at, mut delivered) = (0, Vec::new());
    let mut note = |length: usize, is_frame: bool| {
        delivered.extend(is_frame.then_some(at..at + length));
        at += length;
    };
    let (mut bytes, mut whole) = (Vec::new(), Vec::new());
    for frame in frames {
        let start = bytes.len();
        if random.random() {
            bytes.extend(broken(frame, |count| random.random_range(0..count)));
        }
        whole.push(bytes.len()..bytes.len() + frame.len());
        bytes.extend(frame);
        receiver.feed(&bytes[start..], |one| {
            note(one.bytes(), one.message().is_some());
        });
        if is_silent {
            receiver.line_event(LineEvent::Idle, |one| {
                note(one.bytes(), one.message().is_some());
            });
        }
    }
    receiver.line_event(event, |one| note(one.bytes(), one.message().is_some()));
    let mut counts = [0; 2];
    for frame in whole {
        let shares = |it: &Range<usize>| it.start <= frame.start && frame.start < it.end;
        let is_lost = !delivered.contains(&frame);
        let is_taken = delivered.iter().any(shares);
        assert!(is_taken, "{frame:?} of {bytes:02X?}, {layouts:?}");
        counts[usize::from(is_lost)] += 1;
    }
    counts
}

/// In BIN, the end of a faulty frame and the beginning of a whole frame may form a frame. Then the whole frame is lost.
#[test]
fn frames_that_arrive_whole_are_delivered() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for format in FORMATS {
        let mut all = [0; 2];
        for _ in 0..100 {
            let tries = (0..10).filter_map(|_| {
                let layout = format.layouts.choose(&mut random).expect("a layout");
                random_frame(layout, &mut random).ok()
            });
            let frames: Vec<Vec<u8>> = tries.collect();
            let event = LineEvent::Idle;
            let counts = whole_frames_are_delivered(format.layouts, &frames, event, &mut random);
            all = [all[0] + counts[0], all[1] + counts[1]];
        }
        assert!(all[0] > 100, "{}: {all:?}", format.name);
        assert!(all[1] > 0 || format.name != "BIN", "{all:?}");
    }
}
