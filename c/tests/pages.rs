//! Tests that the code in `docs/from-the-lecture.md` compiles and behaves as the page says, and that the Makefile of
//! the page about C works.

use std::fmt::Write;
use std::fs;
use std::os::unix::fs::symlink;
use std::process::Command;

use framelock::lecture::Lecture;
use framelock::motion::{Bin, Setpoint};
use framelock::{Encode, Parser, Receiver};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::compiler::{C, library, program, run, succeeds};
use crate::receiving::assert_same;

pub(crate) const IN_C: &str = include_str!("../../docs/c-library.md");
pub(crate) const FROM_THE_LECTURE: &str = include_str!("../../docs/from-the-lecture.md");

/// Returns the code blocks of the page in this language.
pub(crate) fn blocks(page: &'static str, language: &str) -> Vec<&'static str> {
    let fence = format!("\n```{language}\n");
    let behind = page.split(&fence).skip(1);
    behind
        .map(|block| block.split_once("```\n").unwrap().0)
        .collect()
}

/// Returns a stream of frames whose payloads look like parts of frames. One byte in fifty is lost.
pub(crate) fn faulty_stream(frames: usize) -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut stream = Vec::new();
    for _ in 0..frames {
        let payload = [(); 3].map(|()| b"AAB\r\x80"[random.random_range(0..5)]);
        stream.extend(Bin::encode(payload.into()));
    }
    stream.retain(|_| random.random_range(0..50) != 0);
    stream
}

/// Returns the setpoint after each byte, as text.
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
    let stream = faulty_stream(20_000);
    let lecture = setpoints(Lecture::new(), &stream);
    let receiver = setpoints(Receiver::<Bin>::new(), &stream);
    assert_ne!(lecture, receiver);

    let folder = TempDir::new().unwrap();
    let page = folder.path().join("page.c");
    let [lectures, _, _, ours] = blocks(FROM_THE_LECTURE, "c")[..] else {
        panic!("the page has four blocks of C");
    };
    fs::write(&page, lectures).unwrap();
    let found = run(&C, &[&page, &program("lecture.c")], &stream);
    assert_same(&found, &lecture);
    fs::write(&page, ours).unwrap();
    let headers = concat!("-I", env!("CARGO_MANIFEST_DIR"), "/headers");
    let with_framelock = [&C[..], &["-DFRAMELOCK", headers]].concat();
    let found = run(&with_framelock, &[&page, &program("lecture.c")], &stream);
    assert_same(&found, &receiver);
}

/// Tests the Makefile of the page about C, with the page's first program.
#[test]
#[cfg(target_os = "linux")]
fn the_page_about_c_links() {
    let folder = TempDir::new().unwrap();
    let file = |name: &str| folder.path().join(name);
    let [makefile] = blocks(IN_C, "make")[..] else {
        panic!("the page has one Makefile");
    };
    let parts = ["guide_platform", "say", "steps_here"];
    let objects = parts.map(|part| format!("{part}.o")).join(" ");
    let makefile = format!("{makefile}\nfirmware: firmware.o {objects}\n");
    fs::write(file("firmware.c"), blocks(IN_C, "c")[0]).unwrap();
    fs::write(file("Makefile"), makefile).unwrap();
    for part in &parts.map(|part| format!("{part}.c")) {
        fs::copy(program(part), file(part)).unwrap();
    }
    fs::copy(program("steps.h"), file("steps.h")).unwrap();
    // The folder is where the page expects the library, but the library is built for this computer.
    let built = file("framelock/target/thumbv7em-none-eabihf/firmware");
    fs::create_dir_all(&built).unwrap();
    symlink(library(), built.join("libframelock_c.a")).unwrap();
    symlink(env!("CARGO_MANIFEST_DIR"), file("framelock/c")).unwrap();
    let mut make = Command::new("make");
    make.args(["firmware", "FRAMELOCK=framelock"])
        .env("CFLAGS", "-std=c99 -Wall -Wextra -Werror -Wconversion")
        .current_dir(&folder);
    succeeds(&mut make, &[], "apt-get install make");
    let said = succeeds(
        &mut Command::new(file("firmware")),
        b"AB\0\x01\x02\x03\r",
        "",
    );
    assert_eq!(said.lines().count(), 7, "a line for each byte");
}
