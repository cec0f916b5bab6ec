//! Tests that a C function that refuses a call changes nothing: neither the receiver or failsafe, nor the message, nor
//! the buffer for a frame. The programs compare all of them with copies from before the call.

use std::process::Command;

use framelock_description::SHIPPED;
use framelock_generate::CrcTable;
use tempfile::TempDir;

use crate::compilers::{CLANGXX, Compiler, GCC, beside, succeeds};
use crate::difference::{Case, random_cases};
use crate::generated::TRUNCATED;
use crate::headers;

/// The number of bytes that a receiver takes.
const BYTES: usize = 8_000;

/// Returns the number of frames that line events have delivered.
fn check(case: &Case, compiler: &Compiler, has_frames: bool) -> u32 {
    let folder = TempDir::new().unwrap();
    case.write(folder.path());
    let program = folder.path().join("program");
    let signature = if case.name() == "truncated" {
        "-DHAS_SIGNATURE"
    } else {
        "-I."
    };
    compiler.compile_with_sanitizers(&beside("refusals.c"), &["-I.", signature], &program);
    let said = succeeds(&mut Command::new(program), &case.bytes(), "");
    let counts: Vec<u32> = said
        .split_whitespace()
        .map(|count| count.parse().unwrap())
        .collect();
    let [push, poll, encode, ended] = counts[..] else {
        panic!("{said}")
    };
    assert!(
        push > 1_000 && (poll > 100 || case.is_window()),
        "{}: {said}",
        case.name()
    );
    assert!(encode > 100 || !has_frames, "{}: {said}", case.name());
    ended
}

#[test]
fn a_refused_call_of_a_receiver_changes_nothing() {
    let mut ended = 0;
    for (name, text) in SHIPPED {
        ended += check(&Case::new(name, text, CrcTable::Nibbles, BYTES), &GCC, true);
    }
    assert!(ended > 0, "line events deliver frames");
    let truncated = Case::new("truncated", TRUNCATED, CrcTable::Nibbles, BYTES);
    check(&truncated, &GCC, true);
    for (number, case) in random_cases(6, BYTES).enumerate() {
        check(&case, if number % 2 == 0 { &GCC } else { &CLANGXX }, false);
    }
}

#[test]
fn a_refused_call_of_the_failsafe_changes_nothing() {
    let folder = TempDir::new().unwrap();
    let program = folder.path().join("program");
    let headers = format!("-I{}", headers::folder().display());
    for demand in ["uint8_t", "uint16_t"] {
        let demand = format!("-DFAILSAFE_DEMAND={demand}");
        GCC.compile_with_sanitizers(
            &beside("refused_failsafe.c"),
            &[&headers, &demand],
            &program,
        );
        assert_eq!(
            succeeds(&mut Command::new(&program), &[], ""),
            "9 refused\n"
        );
    }
}
