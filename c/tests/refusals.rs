//! Tests which data a call in C leaves unchanged. A `push` that finds no frame does not change the message. A `poll`
//! that can decide nothing changes neither the message nor the receiver. A refused `encode` also writes nothing into
//! the buffer for a frame, unless the frame is a packet. The program compares all of these with copies from before the
//! call.

use framelock_description::SHIPPED;
use framelock_generate::CrcTable;

use crate::compilers::{CLANGXX, Compiler, GCC};
use crate::descriptions::other;
use crate::difference::{Case, random_cases};

/// The minimum number of bytes in a stream.
const BYTES: usize = 8_000;

/// Checks a receiver. Returns the number of frames that line events have delivered.
fn check(case: &Case, compiler: &Compiler, has_frames: bool) -> u32 {
    let name = &case.name;
    let has_signature = name == "truncated";
    let options = if has_signature {
        &["-DHAS_SIGNATURE"][..]
    } else {
        &[]
    };
    let said = case
        .program(compiler, "refusals.c", options)
        .run(&case.bytes());
    let counts = said.split_whitespace().map(|count| count.parse().unwrap());
    let [push, poll, encode, ended] = counts.collect::<Vec<u32>>()[..] else {
        panic!("{said}")
    };
    let has_polls = poll > 100 || case.is_window() || case.are_packets();
    assert!(push > 1_000 && has_polls, "{name}: {said}");
    assert!(encode > 50 || !has_frames, "{name}: {said}");
    ended
}

#[test]
fn a_refused_call_of_a_receiver_changes_nothing() {
    let mut ended = 0;
    for (name, text) in SHIPPED {
        let case = Case::new(name, text, CrcTable::Nibbles, BYTES);
        // `push` delivers no frame that only an event ends.
        let has_frames = !case.needs_events();
        ended += check(&case, &GCC, has_frames);
    }
    assert!(ended > 0, "line events deliver frames");
    let truncated = Case::new("truncated", other("truncated").1, CrcTable::Nibbles, BYTES);
    check(&truncated, &GCC, true);
    for (number, case) in random_cases(6, BYTES).enumerate() {
        check(&case, if number % 2 == 0 { &GCC } else { &CLANGXX }, false);
    }
}
