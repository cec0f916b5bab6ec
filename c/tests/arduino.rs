//! Runs the Arduino sketches on a model of the board, `sketch.cpp`.

use std::fs;
use std::path::Path;
use std::process::Command;

use framelock::{Encode, EncodeInto, motion::Bin};
use framelock_formats::crsf::{self, Crsf};
use tempfile::TempDir;

use crate::compilers::{AVR, GXX, succeeds};

/// The time of a byte at 115 200 baud, in microseconds.
const BYTE: u32 = 87;

/// The bytes on the serial line, as the model reads them.
#[derive(Default)]
struct SerialLine {
    gaps_and_bytes: Vec<u8>,
    now: u32,
    gap: u32,
}

impl SerialLine {
    fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.pause(BYTE);
            self.gaps_and_bytes.extend(self.gap.to_le_bytes());
            self.gaps_and_bytes.push(*byte);
            self.gap = 0;
        }
    }

    fn send_without(&mut self, lost: usize, frame: &[u8]) {
        self.send(&frame[..lost]);
        self.send(&frame[lost + 1..]);
    }

    fn pause(&mut self, microseconds: u32) {
        self.now += microseconds;
        self.gap += microseconds;
    }

    /// Sends frames one after another, without pauses, for this time.
    fn repeat_for(&mut self, microseconds: u32, frame: &[u8]) {
        let end = self.now + microseconds;
        while self.now < end {
            self.send(frame);
        }
    }

    /// Runs the sketch, and returns the changes of its pins.
    fn run(mut self, sketch: &str) -> Vec<Change> {
        self.gaps_and_bytes.extend(self.gap.to_le_bytes());
        let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("arduino");
        let sketch = library.join(format!("examples/{sketch}/{sketch}.ino"));
        let sketch = format!("-DSKETCH=\"{}\"", sketch.display());
        let program = GXX.program("sketch.cpp", &[], &[&sketch]);
        let said = program.run(&self.gaps_and_bytes);
        let changes = said.lines().map(|line| {
            let numbers: Vec<u32> = line.split(' ').map(|it| it.parse().unwrap()).collect();
            let [time, pin, value] = numbers[..] else {
                panic!("{line}")
            };
            Change { time, pin, value }
        });
        changes.collect()
    }
}

/// A change of a pin. The time is in microseconds.
#[derive(Clone, Copy, Debug)]
struct Change {
    time: u32,
    pin: u32,
    value: u32,
}

/// Returns the servos' positions, as units of demand, at the end of each round of three pulses.
fn positions(changes: &[Change]) -> Vec<(u32, [u32; 3])> {
    let edges: Vec<Change> = changes.iter().filter(|it| it.pin < 13).copied().collect();
    let pulses = edges.chunks_exact(2).map(|pulse| {
        let [up, down] = [pulse[0], pulse[1]];
        let is_pulse = (up.pin, up.value, down.value) == (down.pin, 1, 0);
        assert!(is_pulse, "{pulse:?}");
        let width = down.time - up.time;
        assert!((1000..=2000).contains(&width), "{pulse:?}");
        // A unit is 3.9 microseconds, cut off to a whole number.
        (down.time, up.pin, ((width - 1000) * 32).div_ceil(125))
    });
    let pulses: Vec<_> = pulses.collect();
    let rounds = pulses.chunks_exact(3).map(|round| {
        assert_eq!([round[0].1, round[1].1, round[2].1], [9, 10, 11]);
        (round[2].0, [round[0].2, round[1].2, round[2].2])
    });
    rounds.collect()
}

/// Returns the servos' positions at this time.
fn position_at(positions: &[(u32, [u32; 3])], time: u32) -> [u32; 3] {
    positions.iter().rfind(|it| it.0 <= time).unwrap().1
}

/// Asserts that no servo moves by more than 46 units from pulse to pulse: 36 ms at 0.2 s for the whole travel.
fn assert_bounded(positions: &[(u32, [u32; 3])]) {
    for pair in positions.windows(2) {
        for (before, after) in pair[0].1.into_iter().zip(pair[1].1) {
            assert!(before.abs_diff(after) <= 46, "{pair:?}");
        }
    }
}

/// A frame that contains the end of a frame and the beginning of another one.
const AMBIGUOUS: &[u8] = b"AB\0\rAB\r";
const RIGHT: [u32; 3] = [13, 65, 66];
const WRONG: [u32; 3] = [65, 66, 0];
const PARK: [u32; 3] = [128; 3];

#[test]
fn the_motion_platform_is_right_after_one_pause() {
    let mut line = SerialLine::default();
    let mut at = vec![];
    // Nobody can know better until the first pause.
    line.send(&AMBIGUOUS[1..]);
    line.repeat_for(2_000_000, AMBIGUOUS);
    at.push((line.now, WRONG));
    line.pause(10_000);
    line.repeat_for(2_000_000, AMBIGUOUS);
    at.push((line.now, RIGHT));
    for lost in 0..AMBIGUOUS.len() {
        line.pause(10_000);
        line.send_without(lost, AMBIGUOUS);
        // The next bytes are a part of the faulty group, until the pause.
        line.repeat_for(20_000, AMBIGUOUS);
        line.pause(10_000);
        line.repeat_for(500_000, AMBIGUOUS);
        at.push((line.now, RIGHT));
    }
    line.pause(2_000_000);
    at.push((line.now, PARK));
    let positions = positions(&line.run("MotionPlatform"));
    assert_bounded(&positions);
    for (time, expected) in at {
        assert_eq!(position_at(&positions, time), expected, "{time}");
    }
}

/// A simulator sends fifty frames a second. The pauses between them are enough, whichever byte is lost.
#[test]
fn the_motion_platform_never_moves_to_a_wrong_position() {
    let mut line = SerialLine::default();
    for number in 0..300 {
        match number % 40 {
            lost @ 0..7 => line.send_without(lost, AMBIGUOUS),
            _ => line.send(AMBIGUOUS),
        }
        line.pause(20_000 - 7 * BYTE);
    }
    let positions = positions(&line.run("MotionPlatform"));
    assert_bounded(&positions);
    assert_eq!(positions.last().unwrap().1, RIGHT);
    for pair in positions.windows(2) {
        // All right positions are below the middle, so the servos only descend, and never below the right position.
        for (axis, right) in RIGHT.into_iter().enumerate() {
            let [before, after] = [pair[0].1[axis], pair[1].1[axis]];
            assert!((right..=before).contains(&after), "{pair:?}");
        }
    }
}

#[test]
fn a_single_frame_does_not_move_the_motion_platform() {
    let mut line = SerialLine::default();
    line.pause(500_000);
    line.send(&Bin::encode([255, 0, 255].into()));
    line.pause(500_000);
    let positions = positions(&line.run("MotionPlatform"));
    assert!(positions.len() > 40);
    assert!(positions.iter().all(|it| it.1 == PARK), "{positions:?}");
}

/// The model of the board has an `int` of 32 bits. Here the compiler for AVR, whose `int` has 16 bits, computes the
/// width of each pulse.
#[test]
fn the_motion_platforms_pulses_are_right_with_an_int_of_16_bits() {
    let sketch = include_str!("../arduino/examples/MotionPlatform/MotionPlatform.ino");
    let (_, rest) = sketch.split_once("delayMicroseconds(").unwrap();
    let (width, _) = rest.split_once(");\n").unwrap();
    let function = format!("constexpr uint32_t width(uint8_t position) {{ return {width}; }}\n");
    let checks = (0..=255).map(|position| {
        let expected = 1000 + position * 125 / 32;
        format!("static_assert(width({position}) == {expected}, \"\");\n")
    });
    let source = "#include <stdint.h>\n".to_owned() + &function + &checks.collect::<String>();
    let here = TempDir::new().unwrap();
    let file = here.path().join("width.cpp");
    fs::write(&file, source).unwrap();
    let mut command = Command::new("avr-g++");
    command.args(["-std=gnu++11", "-fsyntax-only"]).arg(file);
    succeeds(&mut command, &[], AVR.package);
}

fn channels(payload: &[u8]) -> Vec<u8> {
    let message = crsf::Message {
        address: 0xC8,
        kind: 0x16,
        payload,
    };
    Crsf.encode_into(message, &mut [0; 64]).unwrap().to_vec()
}

/// Returns the brightness of the LED at pin 9, and whether the board's LED is on.
fn leds_at(changes: &[Change], time: u32) -> (u32, bool) {
    let at = |pin| {
        let mut changes = changes.iter();
        let last = changes.rfind(|change| change.pin == pin && change.time <= time);
        last.map_or(0, |change| change.value)
    };
    (at(9), at(13) == 1)
}

/// `EdgeTX` 2.11 appends a byte to the sixteen channels.
#[test]
fn the_crsf_receiver_ignores_further_bytes_of_the_payload() {
    // All channels in the middle: eleven bytes for eight channels.
    let middle = [
        0xE0, 0x03, 0x1F, 0xF8, 0xC0, 0x07, 0x3E, 0xF0, 0x81, 0x0F, 0x7C,
    ];
    let mut payload = [middle.repeat(2), vec![0]].concat();
    let (mut line, mut at) = (SerialLine::default(), vec![]);
    let mut send = |payload: &[u8], brightness| {
        line.send(&channels(payload));
        line.pause(4_000);
        at.push((line.now, brightness));
    };
    send(&payload[..22], 992 / 8);
    // Channel 1 is 1811 in these frames.
    payload[..2].copy_from_slice(&[0x13, 0x07]);
    send(&payload, 1811 / 8);
    payload[..2].copy_from_slice(&[0xAC, 0x00]);
    send(&payload[..22], 172 / 8);
    // A frame without all channels has no known meaning.
    send(&payload[..21], 172 / 8);
    line.pause(600_000);
    let end = line.now;
    let changes = line.run("CrsfReceiver");
    for (time, brightness) in at {
        assert_eq!(leds_at(&changes, time), (brightness, true), "{time}");
    }
    assert_eq!(leds_at(&changes, end), (0, false));
}

/// Frames whose payload contains the checksum of a frame, and the beginning of this frame.
#[test]
fn the_crsf_receiver_is_right_after_one_pause() {
    let payload = |check: [u8; 2]| {
        let mut payload = [0x11; 22];
        payload[9] = check[0];
        payload[10..13].copy_from_slice(&[0xC8, 0x18, 0x16]);
        payload[13] = 0x33;
        payload[20] = check[1];
        channels(&payload)
    };
    // The wrong frame begins at this byte.
    let start = 13;
    let wrong = |frame: &[u8]| [&frame[start + 3..], &frame[..start - 1]].concat();
    let all = (0..=u16::MAX).map(|check| payload(check.to_le_bytes()));
    let is_ambiguous = |frame: &Vec<u8>| channels(&wrong(frame)).last() == Some(&frame[start - 1]);
    let frame = all.into_iter().find(is_ambiguous).unwrap();

    let brightness = |payload: &[u8]| {
        let channel = u16::from_le_bytes([payload[0], payload[1]]) & 0x7FF;
        u32::from(channel >> 3)
    };
    let [right, wrong] = [brightness(&frame[3..]), brightness(&wrong(&frame))];
    assert_ne!(right, wrong);

    let (mut line, mut at) = (SerialLine::default(), vec![]);
    line.send(&frame[1..]);
    line.repeat_for(100_000, &frame);
    at.push((line.now, wrong));
    for lost in 0..frame.len() {
        line.pause(6_000);
        line.repeat_for(50_000, &frame);
        at.push((line.now, right));
        line.send_without(lost, &frame);
        line.repeat_for(20_000, &frame);
    }
    line.pause(6_000);
    let changes = line.run("CrsfReceiver");
    for (time, brightness) in at {
        assert_eq!(leds_at(&changes, time), (brightness, true), "{time}");
    }
}
