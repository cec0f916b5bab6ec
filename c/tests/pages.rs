//! The code in `docs/c.md` and `docs/from-the-lecture.md` compiles, and does what those pages say.

use std::fmt::Write;
use std::fs;
use std::num::NonZeroU32;
use std::os::unix::fs::symlink;
use std::process::Command;

use framelock::can_go_deaf::Lecture;
use framelock::motion::{Bin, Failsafe, FailsafeParameters, Setpoint};
use framelock::{Encode, Line, LineEvent, Parser, Receiver};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::compiler::{C, library, program, run, succeeds};
use crate::receiving::assert_same;

pub(crate) const IN_C: &str = include_str!("../../docs/c.md");
pub(crate) const FROM_THE_LECTURE: &str = include_str!("../../docs/from-the-lecture.md");

/// The page's blocks in that language.
pub(crate) fn blocks(page: &'static str, language: &str) -> Vec<&'static str> {
    let fence = format!("\n```{language}\n");
    let behind = page.split(&fence).skip(1);
    behind
        .map(|block| block.split_once("```\n").unwrap().0)
        .collect()
}

/// Frames of bytes that a receiver may take for others, of which it loses one byte in fifty.
fn faulty_stream() -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut stream = Vec::new();
    for _ in 0..20_000 {
        let payload = [(); 3].map(|()| b"AAB\r\x80"[random.random_range(0..5)]);
        stream.extend(Bin::encode(payload.into()));
    }
    stream.retain(|_| random.random_range(0..50) != 0);
    stream
}

/// The setpoint after each byte.
fn setpoints(mut parser: impl for<'a> Parser<Message<'a> = Setpoint>, stream: &[u8]) -> String {
    let mut setpoint = Setpoint::default();
    let mut text = String::new();
    for &byte in stream {
        setpoint = parser.push(byte).unwrap_or(setpoint);
        writeln!(
            text,
            "{} {} {}",
            setpoint.pitch, setpoint.roll, setpoint.yaw
        )
        .unwrap();
    }
    text
}

#[test]
fn the_lectures_code_does_what_lecture_does_and_the_other_what_receiver_does() {
    let stream = faulty_stream();
    let lecture = setpoints(Lecture::new(), &stream);
    let receiver = setpoints(Receiver::<Bin>::new(), &stream);
    assert_ne!(lecture, receiver);

    let folder = TempDir::new().unwrap();
    let page = folder.path().join("page.c");
    let [lectures, ours] = blocks(FROM_THE_LECTURE, "c")[..] else {
        panic!("the page has two blocks of C");
    };
    fs::write(&page, lectures).unwrap();
    let found = run(&C, &[&page, &program("lecture.c")], &stream);
    assert_same(&found, &lecture);
    fs::write(&page, ours).unwrap();
    let with_framelock = [&C[..], &["-DFRAMELOCK"]].concat();
    let found = run(&with_framelock, &[&page, &program("lecture.c")], &stream);
    assert_same(&found, &receiver);
}

/// With the page's Makefile.
#[test]
#[cfg(target_os = "linux")]
fn the_page_about_c_links_and_drives_the_actuators() {
    let folder = TempDir::new().unwrap();
    let [code] = blocks(IN_C, "c")[..] else {
        panic!("the page has one block of C");
    };
    let [makefile] = blocks(IN_C, "make")[..] else {
        panic!("the page has one Makefile");
    };
    let makefile = format!("{makefile}\nfirmware: firmware.o uart.o\n");
    fs::write(folder.path().join("firmware.c"), code).unwrap();
    fs::write(folder.path().join("Makefile"), makefile).unwrap();
    fs::copy(program("uart.c"), folder.path().join("uart.c")).unwrap();
    // framelock's folder, but the library is for this computer.
    let built = folder
        .path()
        .join("framelock/target/thumbv7em-none-eabihf/firmware");
    fs::create_dir_all(&built).unwrap();
    symlink(library(), built.join("libframelock_c.a")).unwrap();
    symlink(
        env!("CARGO_MANIFEST_DIR"),
        folder.path().join("framelock/c"),
    )
    .unwrap();
    let mut make = Command::new("make");
    make.args(["firmware", "FRAMELOCK=framelock"])
        .env("CFLAGS", "-std=c99 -Wall -Wextra -Werror -Wconversion")
        .current_dir(&folder);
    succeeds(&mut make, &[], "apt-get install make");

    // Noise, an error within a frame, silence.
    let mut stream = faulty_stream();
    stream.extend(b"AB\0\xFFxyz\rAB\0xyz\r");
    stream.extend([0; 3000]);
    let mut firmware = Command::new(folder.path().join("firmware"));
    let found = succeeds(&mut firmware, &stream, "");
    assert_same(&found, &driven(&stream));
}

/// Where the actuators are driven after each millisecond.
fn driven(stream: &[u8]) -> String {
    let mut line = Line::new(Receiver::<Bin>::new());
    let parameters = FailsafeParameters {
        hold_after: 100,
        ramp_after: 500,
        park: [128; 3],
        ticks_per_unit: [NonZeroU32::new(10).unwrap(); 3],
    };
    let mut failsafe = Failsafe::new(parameters, 0).unwrap();
    let mut text = String::new();
    for (now, &byte) in (0..).zip(stream) {
        if byte == 0xFF {
            line.line_event(LineEvent::Framing, |_| ());
        } else if let Some(setpoint) = line.push(byte) {
            failsafe.frame(now, setpoint);
        }
        let [pitch, roll, yaw] = failsafe.poll(now).axes;
        writeln!(text, "{pitch} {roll} {yaw}").unwrap();
    }
    assert!(text.ends_with("128 128 128\n"), "it parks");
    text
}
