//! Tests that the code in `docs/protocol.md` behaves as the page says, and that the page shows the header's code.

use std::fmt::Write;
use std::fs;

use framelock::lecture::Lecture;
use framelock::motion::{Bin, Setpoint};
use framelock::{Encode, Parser, Receiver};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::compilers::{GCC, assert_same};
use crate::delivery::blocks;
use crate::headers;

pub(crate) const PAGE: &str = include_str!("../../docs/protocol.md");

/// Returns a stream of frames whose payloads look like parts of frames. One byte in fifty is lost.
fn faulty_stream(frames: usize) -> Vec<u8> {
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
        let Setpoint { pitch, roll, yaw } = setpoint;
        writeln!(text, "{pitch} {roll} {yaw}").unwrap();
    }
    text
}

#[test]
fn the_lectures_code_does_what_lecture_does_and_the_other_what_receiver_does() {
    let stream = faulty_stream(20_000);
    let lecture = setpoints(Lecture::new(), &stream);
    let receiver = setpoints(Receiver::<Bin>::new(), &stream);
    assert_ne!(lecture, receiver);

    let [lectures, _, ours] = blocks(PAGE, "c")[..] else {
        panic!("the page has three blocks of C");
    };
    for (code, option, expected) in [
        (lectures, "-UFRAMELOCK", lecture),
        (ours, "-DFRAMELOCK", receiver),
    ] {
        let program = GCC.program("lecture.c", &[("page.c", code)], &[option]);
        assert_same(&program.run(&stream), &expected);
    }
}

#[test]
fn the_page_shows_the_headers_function() {
    let header = fs::read_to_string(headers::folder().join("bin.h")).unwrap();
    let [_, push, _] = blocks(PAGE, "c")[..] else {
        panic!("the page has three blocks of C");
    };
    assert!(push.contains("bin_push(") && header.contains(push));
}
