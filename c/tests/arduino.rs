//! Runs the Arduino sketches on simavr's `ATmega328P`, the chip of an Uno.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use framelock::{Encode, EncodeInto, motion::Bin};
use framelock_formats::crsf::{self, Crsf};
use tempfile::TempDir;

use crate::compilers::{AVR, beside, cached, include_headers, succeeds};

/// Debian's core for Arduino boards, from the package arduino-core-avr.
const ARDUINO: &str = "/usr/share/arduino/hardware/arduino/avr";

/// The options for an Uno.
const UNO: &str = "-mmcu=atmega328p -DF_CPU=16000000L -DARDUINO=10819 -DARDUINO_AVR_UNO \
    -DARDUINO_ARCH_AVR -Os -ffunction-sections -fdata-sections";

fn compile(mut compiler: Command, options: &str, files: &[&Path]) {
    compiler.args(UNO.split_whitespace());
    for folder in ["cores/arduino", "variants/standard"] {
        compiler.arg("-I").arg(Path::new(ARDUINO).join(folder));
    }
    compiler.args(options.split_whitespace()).args(files);
    succeeds(&mut compiler, &[], AVR.package);
}

/// A folder with the compiled core, and with `board`, the program that runs a sketch.
static CORE: LazyLock<TempDir> = LazyLock::new(|| {
    let core = Path::new(ARDUINO).join("cores/arduino");
    let package = "on Debian: apt-get install arduino-core-avr";
    assert!(core.exists(), "no {ARDUINO}; {package}");
    let here = TempDir::new().unwrap();
    for source in fs::read_dir(&core).unwrap() {
        let source = source.unwrap().path();
        // This compiler's float.h has no DECIMAL_DIG for C++.
        let (compiler, options) = match source.extension().and_then(OsStr::to_str) {
            Some("c") => ("avr-gcc", ""),
            Some("cpp") => ("avr-g++", "-std=gnu++11 -DDECIMAL_DIG=__DECIMAL_DIG__"),
            _ => continue,
        };
        let name = source.file_name().unwrap().to_str().unwrap();
        let object = here.path().join(format!("{name}.o"));
        let options = format!("{options} -w -c -o");
        compile(cached(compiler), &options, &[&object, &source]);
    }
    let mut board = Command::new("gcc");
    board.args(["-O1", "-Wall", "-Wextra", "-Werror", "-o"]);
    board.arg(here.path().join("board"));
    board.arg(beside("board.c")).arg("-lsimavr");
    succeeds(&mut board, &[], "libsimavr-dev");
    here
});

/// Returns the source of an example.
fn sketch(name: &str) -> String {
    let path = format!("arduino/examples/{name}/{name}.ino");
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// Compiles a sketch in this folder, without a warning. Returns the program's path.
fn build(sketch: &str, here: &Path) -> PathBuf {
    let source = here.join("sketch.cpp");
    let object = here.join("sketch.o");
    let program = here.join("sketch.elf");
    fs::write(&source, sketch).unwrap();
    let include = include_headers();
    let options = format!("-std=gnu++11 -Wall -Wextra -Werror -include Arduino.h {include} -c -o");
    compile(Command::new("avr-g++"), &options, &[&object, &source]);
    let core = fs::read_dir(CORE.path()).unwrap();
    let core = core.map(|file| file.unwrap().path());
    let core: Vec<PathBuf> = core.filter(|file| file.extension().is_some()).collect();
    let mut files = vec![&*program, &object];
    files.extend(core.iter().map(PathBuf::as_path));
    files.push("-lm".as_ref());
    compile(Command::new("avr-g++"), "-Wl,--gc-sections -o", &files);
    program
}

/// The time of a byte at 115 200 baud, in microseconds. simavr counts eleven bits for a byte.
const BYTE: u32 = 95;

/// The events that `board.c` reads: bytes on the serial line, resets, and the end of the run.
struct SerialLine {
    events: String,
    now: u32,
    gap: u32,
}

impl SerialLine {
    /// Returns a line that is silent until the sketch has started.
    fn new() -> Self {
        Self {
            events: String::new(),
            now: 10_000,
            gap: 10_000,
        }
    }

    fn event(&mut self, event: u32) {
        writeln!(self.events, "{} {event}", self.gap).unwrap();
        self.gap = 0;
    }

    fn send(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.pause(BYTE);
            self.event((*byte).into());
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

    /// Sends frames with these demands, fifty a second.
    fn send_demands(&mut self, demands: [u8; 3], frames: u32) {
        for _ in 0..frames {
            self.send(&Bin::encode(demands.into()));
            self.pause(20_000 - 7 * BYTE);
        }
    }

    /// Resets the chip.
    fn reset(&mut self) {
        self.event(256);
    }

    /// Runs a sketch, and returns the changes of its pins.
    fn run(mut self, sketch: &str) -> Vec<Change> {
        self.event(257);
        let here = TempDir::new().unwrap();
        let program = build(sketch, here.path());
        let mut board = Command::new(CORE.path().join("board"));
        let said = succeeds(board.arg(program), self.events.as_bytes(), "");
        // simavr writes further lines.
        let changes = said.lines().filter_map(|line| {
            let numbers = line.split(' ').map(|number| number.parse().ok());
            match numbers.collect::<Option<Vec<u32>>>()?[..] {
                [time, pin, value] => Some(Change { time, pin, value }),
                _ => None,
            }
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

/// The time at which a pulse ends, and the servo's position in units of demand.
#[derive(Clone, Copy, Debug)]
struct Pulse {
    time: u32,
    position: u32,
}

/// The pulses of each servo.
struct Servos([Vec<Pulse>; 3]);

/// The greatest difference between a measured position and the output, in units of 3.9 microseconds. Arduino's clock
/// has steps of 4 microseconds, and an interrupt may delay an edge.
const JITTER: u32 = 3;

/// The greatest step between two pulses: the distance in two polls (36 ms), if the whole travel takes 0.2 s.
const MOST: u32 = 46;

/// The greatest step in an approach, and on the way to park: the distance in 36 ms, if the whole travel takes 1 s.
const SLOW: u32 = 10;

impl Servos {
    /// Runs the motion platform, and leaves out the pulses that a reset may have cut off.
    fn run(line: SerialLine, sketch: &str, resets: &[u32]) -> Self {
        let mut servos = [const { Vec::new() }; 3];
        let changes = line.run(sketch);
        let edges: Vec<Change> = changes.into_iter().filter(|it| it.pin < 13).collect();
        for pulse in edges.chunks_exact(2) {
            let [up, down] = [pulse[0], pulse[1]];
            let is_pulse = (up.pin, up.value, down.value) == (down.pin, 1, 0);
            assert!(is_pulse, "{pulse:?}");
            if resets.iter().any(|reset| reset.abs_diff(down.time) < 5) {
                continue;
            }
            let width = down.time - up.time;
            assert!((985..=2015).contains(&width), "{pulse:?}");
            let position = (width.saturating_sub(1000) * 32 + 62) / 125;
            servos[up.pin as usize - 9].push(Pulse {
                time: down.time,
                position,
            });
        }
        Self(servos)
    }

    /// Asserts that the servos have these positions at this time, and still get pulses.
    fn assert_at(&self, time: u32, expected: [u32; 3]) {
        let last = self.0.each_ref().map(|pulses| {
            let last = pulses.iter().rfind(|pulse| pulse.time <= time).unwrap();
            assert!(time - last.time < 30_000, "no pulse at {time}");
            last.position
        });
        let mut both = last.into_iter().zip(expected);
        let are_near = both.all(|(found, expected)| found.abs_diff(expected) <= JITTER);
        assert!(are_near, "{last:?} at {time}, not {expected:?}");
    }

    /// Asserts that no servo moves by more than `limit` between two pulses, from this time on.
    fn assert_steps(&self, from: u32, limit: u32) {
        for pulses in &self.0 {
            let from = pulses.iter().position(|pulse| pulse.time >= from).unwrap();
            for pair in pulses[from..].windows(2) {
                let step = pair[0].position.abs_diff(pair[1].position);
                assert!(step <= limit + JITTER, "{pair:?}");
            }
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
    let mut line = SerialLine::new();
    let mut at = vec![];
    // Until the first pause, no receiver can know which frames were sent.
    line.send(&AMBIGUOUS[1..]);
    line.repeat_for(2_000_000, AMBIGUOUS);
    at.push((line.now, WRONG));
    line.pause(10_000);
    line.repeat_for(2_000_000, AMBIGUOUS);
    at.push((line.now, RIGHT));
    for lost in 0..AMBIGUOUS.len() {
        line.pause(10_000);
        line.send_without(lost, AMBIGUOUS);
        // Until the next pause, the receiver may find frames at a wrong offset.
        line.repeat_for(20_000, AMBIGUOUS);
        line.pause(10_000);
        line.repeat_for(500_000, AMBIGUOUS);
        at.push((line.now, RIGHT));
    }
    line.pause(2_000_000);
    at.push((line.now, PARK));
    let servos = Servos::run(line, &sketch("MotionPlatform"), &[]);
    servos.assert_steps(0, MOST);
    for (time, expected) in at {
        servos.assert_at(time, expected);
    }
}

/// A simulator sends fifty frames a second. The pauses between the frames let the receiver resynchronise, whichever
/// byte is lost.
#[test]
fn the_motion_platform_never_moves_to_a_wrong_position() {
    let mut line = SerialLine::new();
    for number in 0..300 {
        match number % 40 {
            lost @ 0..7 => line.send_without(lost, AMBIGUOUS),
            _ => line.send(AMBIGUOUS),
        }
        line.pause(20_000 - 7 * BYTE);
    }
    let end = line.now;
    let servos = Servos::run(line, &sketch("MotionPlatform"), &[]);
    servos.assert_at(end, RIGHT);
    // Each servo starts in the middle. The expected position is a smaller number, so a servo's position never
    // increases, and never falls below the expected one.
    for (pulses, right) in servos.0.iter().zip(RIGHT) {
        for pair in pulses.windows(2) {
            let [before, after] = [pair[0].position, pair[1].position];
            let is_right = after + JITTER >= right && after <= before + JITTER;
            assert!(is_right, "{pair:?}");
        }
    }
}

#[test]
fn a_single_frame_does_not_move_the_motion_platform() {
    let mut line = SerialLine::new();
    line.pause(500_000);
    line.send_demands([255, 0, 255], 1);
    line.pause(500_000);
    let end = line.now;
    let servos = Servos::run(line, &sketch("MotionPlatform"), &[]);
    servos.assert_steps(0, 0);
    servos.assert_at(end, PARK);
}

/// The chip's `int` has 16 bits.
#[test]
fn the_motion_platforms_pulses_are_right_for_each_position() {
    let mut line = SerialLine::new();
    line.send_demands([0, 0, 255], 120);
    let mut at = vec![];
    for position in (0..=255).step_by(5) {
        let demands = [position, position / 2, 255 - position];
        line.send_demands(demands, 4);
        at.push((line.now, demands.map(u32::from)));
    }
    let servos = Servos::run(line, &sketch("MotionPlatform"), &[]);
    for (time, expected) in at {
        servos.assert_at(time, expected);
    }
}

/// Returns the motion platform's sketch, changed for text as docs/arduino.md describes.
fn sketch_for_text() -> String {
    let page = include_str!("../../docs/arduino.md").replace("\n   ", "\n");
    let (_, functions) = page.split_once("```cpp\n").unwrap();
    let (functions, _) = functions.split_once("```").unwrap();
    let sketch = sketch("MotionPlatform");
    let (before, part) = sketch.split_once("    // Report a pause").unwrap();
    let (_, after) = part
        .split_once("\n    }\n    if (millis() - servo_time")
        .unwrap();
    let names = ["bin.h", "bin_receiver", "bin_init"];
    let before = names.iter().fold(before.to_owned(), |text, name| {
        text.replace(name, &name.replace("bin", "axes_text"))
    });
    before.replace("void setup()", &format!("{functions}\nvoid setup()"))
        + "    receive();\n    if (millis() - servo_time"
        + after
}

#[test]
fn the_motion_platform_follows_text() {
    let (mut line, mut at) = (SerialLine::new(), vec![]);
    for (text, expected) in [
        ("A127B000C255X", [127, 0, 255]),
        // Values beyond the range, decimals, and blanks.
        ("A-5B300.4C 63.5X\r\n", [0, 255, 64]),
    ] {
        for _ in 0..120 {
            line.send(text.as_bytes());
            line.pause(10_000);
        }
        at.push((line.now, expected));
    }
    // None of these texts is a setpoint: the first is of another kind, and the others have invalid numbers.
    for _ in 0..200 {
        line.send(b"<200,200,200>A1x7B0C0XA1.2.3B0C0XAB0C0X");
        line.pause(10_000);
    }
    at.push((line.now, PARK));
    let servos = Servos::run(line, &sketch_for_text(), &[]);
    servos.assert_steps(0, MOST);
    for (time, expected) in at {
        servos.assert_at(time, expected);
    }
}

/// Resets happen at rest and in motion, and some of them cut a pulse off.
#[test]
fn a_reset_does_not_move_the_motion_platform() {
    let far = [30, 230, 10];
    let mut line = SerialLine::new();
    let mut resets = vec![];
    line.send_demands(far, 100);
    let start = line.now;
    for number in 0..20 {
        line.pause(777 * number);
        resets.push(line.now);
        line.reset();
        line.pause(10_000 * (number % 4));
        line.send_demands(if number % 3 == 0 { [128; 3] } else { far }, 10);
    }
    line.pause(2_000_000);
    let end = line.now;
    let servos = Servos::run(line, &sketch("MotionPlatform"), &resets);
    servos.assert_at(start, far.map(u32::from));
    servos.assert_steps(start - 50_000, SLOW);
    servos.assert_at(end, PARK);
}

/// After 1.5 seconds, one iteration of the loop takes too long, or never ends. Then bytes are lost, or the watchdog
/// resets the chip.
#[test]
fn a_late_loop_does_not_move_the_motion_platform() {
    for late in ["delay(200);", "for (;;) {}"] {
        let mut line = SerialLine::new();
        line.repeat_for(1_900_000, AMBIGUOUS);
        line.pause(10_000);
        line.repeat_for(1_000_000, AMBIGUOUS);
        let end = line.now;
        let start = "void loop()\n{\n";
        let late = format!("{start}    if (millis() - 1500U < 18U) {{ {late} }}\n");
        let sketch = sketch("MotionPlatform").replace(start, &late);
        let servos = Servos::run(line, &sketch, &[]);
        servos.assert_steps(0, MOST);
        servos.assert_at(end, RIGHT);
        let is_late = servos.0[0]
            .windows(2)
            .any(|pair| pair[1].time - pair[0].time > 150_000);
        assert!(is_late, "{late}");
    }
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
    let (mut line, mut at) = (SerialLine::new(), vec![]);
    let mut send = |payload: &[u8], brightness| {
        line.send(&channels(payload));
        line.pause(4_000);
        at.push((line.now, brightness));
    };
    send(&payload[..22], 992 / 8);
    // Channel 1 is 1811 in the next frame.
    payload[..2].copy_from_slice(&[0x13, 0x07]);
    send(&payload, 1811 / 8);
    payload[..2].copy_from_slice(&[0xAC, 0x00]);
    send(&payload[..22], 172 / 8);
    // The sketch ignores a frame that has too few bytes for sixteen channels.
    send(&payload[..21], 172 / 8);
    line.pause(600_000);
    let end = line.now;
    let changes = line.run(&sketch("CrsfReceiver"));
    for (time, brightness) in at {
        assert_eq!(leds_at(&changes, time), (brightness, true), "{time}");
    }
    assert_eq!(leds_at(&changes, end), (0, false));
}

/// Frames whose payload contains the end of a wrong frame, and then the beginning of the next wrong frame.
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

    let (mut line, mut at) = (SerialLine::new(), vec![]);
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
    let changes = line.run(&sketch("CrsfReceiver"));
    for (time, brightness) in at {
        assert_eq!(leds_at(&changes, time), (brightness, true), "{time}");
    }
}
