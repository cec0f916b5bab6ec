//! `framelock trace` as its user meets it.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Output, Stdio};

use assert_cmd::cargo::cargo_bin_cmd;

fn trace(arguments: &[&str]) -> Output {
    let mut command = cargo_bin_cmd!("framelock");
    command.arg("trace").args(arguments).output().unwrap()
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap()
}

/// What it writes to standard output; it must succeed, and have nothing to complain of.
fn shown(arguments: &[&str]) -> String {
    let output = trace(arguments);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(text(output.stderr), "");
    text(output.stdout)
}

/// What it complains of; it must fail with 2, and show nothing.
fn complaint(arguments: &[&str]) -> String {
    let output = trace(arguments);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert_eq!(text(output.stdout), "");
    text(output.stderr)
}

const FIRST: &str = "\
offset  byte    policy   state     temp (P R Y)  SP (P R Y)  what happened
     0  41 'A'  both      A -> B   -- -- --      -- -- --    sync
     1  42 'B'  both      B -> 1   -- -- --      -- -- --    sync
     2  00      both      1 -> 2   -- -- --      -- -- --    reserved, not kept
     3  7F      both      2 -> 3   7F -- --      -- -- --    temp pitch=7F
     4  C8      both      3 -> 4   7F C8 --      -- -- --    temp roll=C8
     5  4A 'J'  both      4 -> CR  7F C8 4A      -- -- --    temp yaw=4A
     6  0D CR   both     CR -> A   7F C8 4A      7F C8 4A    SP=(7F,C8,4A)

both:    7 bytes = 7 x 1 committed + 0 discarded + 0 under way; SP=(7F,C8,4A)
";

const SECOND: &str = "\
offset  byte    policy   state     temp (P R Y)  SP (P R Y)  what happened
     0  41 'A'  both      A -> B   -- -- --      -- -- --    sync
     1  42 'B'  both      B -> 1   -- -- --      -- -- --    sync
     2  00      both      1 -> 2   -- -- --      -- -- --    reserved, not kept
     3  4A 'J'  both      2 -> 3   4A -- --      -- -- --    temp pitch=4A
     4  0D CR   both      3 -> 4   4A 0D --      -- -- --    temp roll=0D
     5  41 'A'  both      4 -> CR  4A 0D 41      -- -- --    temp yaw=41
     6  42 'B'  discard  CR -> A   4A 0D 41      -- -- --    not CR: nothing is implemented, 7 bytes discarded
     6  42 'B'  rescan   CR -> 1   4A 0D 41      -- -- --    not CR: nothing is implemented, 5 bytes discarded; resynchronised to the AB at offset 5
     7  00      discard   A -> A   4A 0D 41      -- -- --    no sync: discarded
     7  00      rescan    1 -> 2   4A 0D 41      -- -- --    reserved, not kept
     8  82      discard   A -> A   4A 0D 41      -- -- --    no sync: discarded
     8  82      rescan    2 -> 3   82 0D 41      -- -- --    temp pitch=82
     9  C4      discard   A -> A   4A 0D 41      -- -- --    no sync: discarded
     9  C4      rescan    3 -> 4   82 C4 41      -- -- --    temp roll=C4
    10  4A 'J'  discard   A -> A   4A 0D 41      -- -- --    no sync: discarded
    10  4A 'J'  rescan    4 -> CR  82 C4 4A      -- -- --    temp yaw=4A
    11  0D CR   discard   A -> A   4A 0D 41      -- -- --    no sync: discarded
    11  0D CR   rescan   CR -> A   82 C4 4A      82 C4 4A    SP=(82,C4,4A)

discard: 12 bytes = 7 x 0 committed + 12 discarded (no sync 5, no CR 7) + 0 under way; SP=(--,--,--)
rescan:  12 bytes = 7 x 1 committed + 5 discarded (no sync 4, no CR 1) + 0 under way; SP=(82,C4,4A)
";

#[test]
fn without_arguments_the_lectures_two_examples_are_shown() {
    let expected = format!(
        "\
The lecture's first example: one frame, and the line loses nothing.

  sent      41 42 00 7F C8 4A 0D
  received  41 42 00 7F C8 4A 0D

{FIRST}

The lecture's second example: two frames, and the line loses 7F and C8 of the first.

  sent      41 42 00 7F C8 4A 0D 41 42 00 82 C4 4A 0D
  received  41 42 00 -- -- 4A 0D 41 42 00 82 C4 4A 0D

{SECOND}"
    );
    assert_eq!(shown(&[]), expected);
}

#[test]
fn the_second_example_loses_two_frames_under_discard_and_one_under_rescan() {
    let received = "4142004A0D4142 0082C44A0D";
    assert_eq!(shown(&[received]), SECOND);

    let discard = shown(&[received, "--policy", "discard"]);
    assert!(!discard.contains("SP=(82"));
    assert!(discard.ends_with("SP=(--,--,--)\n"));

    let rescan = shown(&[received, "--policy", "rescan"]);
    assert!(rescan.contains("82 C4 4A      82 C4 4A    SP=(82,C4,4A)\n"));
    assert!(rescan.ends_with("SP=(82,C4,4A)\n"));
}

#[test]
fn bytes_are_read_however_they_are_written() {
    for spelling in [
        &["41", "42", "00", "7F", "C8", "4A", "0D"][..],
        &["4142007fc84a0d"],
        &["0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D"],
    ] {
        assert_eq!(shown(spelling), FIRST);
    }
}

#[test]
fn what_a_state_does_with_a_wrong_byte_is_said() {
    // An A in state B, noise in state A, and a failed frame that ends in an A.
    let rescan = shown(&["41 41 2E 41 42 01 02 03 04 41", "--policy", "rescan"]);
    let happened: Vec<&str> = rescan
        .lines()
        .skip(1)
        .take(10)
        .map(|row| &row[61..])
        .collect();
    assert_eq!(
        happened,
        [
            "sync",
            "sync again: the 'A' before it discarded",
            "no sync: discarded, and the 'A' before it",
            "sync",
            "sync",
            "reserved, not kept",
            "temp pitch=02",
            "temp roll=03",
            "temp yaw=04",
            "not CR: nothing is implemented, 6 bytes discarded; resynchronised to the A at offset 9",
        ]
    );
    assert!(rescan.ends_with(
        "10 bytes = 7 x 0 committed + 9 discarded (no sync 6, broken sync 2, no CR 1) + 1 under \
         way; SP=(--,--,--)\n"
    ));
}

#[test]
fn json_has_an_object_per_byte_and_machine() {
    let rows = shown(&["4142007FC84A0D", "--format", "jsonl"]);
    let rows: Vec<serde_json::Value> = rows
        .lines()
        .map(|row| serde_json::from_str(row).unwrap())
        .collect();
    assert_eq!(rows.len(), 14);
    let last = serde_json::json!({
        "offset": 6,
        "byte": 13,
        "policy": "rescan",
        "state_before": "CR",
        "state_after": "A",
        "temp": [0x7F, 0xC8, 0x4A],
        "setpoint": [0x7F, 0xC8, 0x4A],
        "discarded": 0,
        "what": "SP=(7F,C8,4A)",
    });
    assert_eq!(rows[13], last);
    assert_eq!(rows[0]["temp"], serde_json::json!([null, null, null]));
    assert_eq!(rows[0]["setpoint"], serde_json::Value::Null);
    // Which example a row belongs to would not be seen.
    assert!(complaint(&["--format", "jsonl"]).contains("HEX|FILE"));
}

/// A directory with the first example in files of these names.
fn directory(names: &[&str]) -> (tempfile::TempDir, Vec<PathBuf>) {
    let directory = tempfile::tempdir().unwrap();
    let paths = names.iter().map(|name| directory.path().join(name));
    let paths: Vec<PathBuf> = paths.collect();
    for path in &paths {
        std::fs::write(path, [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D]).unwrap();
    }
    (directory, paths)
}

#[test]
fn files_and_standard_input_are_read() {
    let (_directory, paths) = directory(&["capture.bin"]);
    assert_eq!(shown(&[paths[0].to_str().unwrap()]), FIRST);

    let mut command = cargo_bin_cmd!("framelock");
    command
        .args(["trace", "-"])
        .write_stdin(*b"AB\0\x7F\xC8\x4A\r");
    command.assert().success().stdout(FIRST);
}

#[test]
fn hex_is_hex_even_if_a_file_has_that_name() {
    let (directory, _) = directory(&["4142"]);
    let run = |argument| {
        let mut command = cargo_bin_cmd!("framelock");
        command.current_dir(&directory).args(["trace", argument]);
        command.output().unwrap()
    };
    let hex = run("4142");
    assert!(hex.status.success());
    assert!(text(hex.stdout).contains("2 bytes = "));
    assert_eq!(
        text(hex.stderr),
        "framelock: 4142 is taken as hex; for the file write ./4142\n"
    );
    let file = run("./4142");
    assert_eq!(text(file.stdout), FIRST);
    assert_eq!(text(file.stderr), "");
}

#[test]
fn what_cannot_be_read_is_named_in_one_line() {
    let message = complaint(&["41", "42", "4G"]);
    assert_eq!(
        message,
        "framelock: word 3, '4G', has 'G', which is no hex digit\n"
    );
    let message = complaint(&["41 420"]);
    assert!(message.contains("word 2, '420', is not a whole number of bytes"));
    assert_eq!(message.lines().count(), 1);

    let message = complaint(&["no-such-file"]);
    assert!(
        message.contains("word 1, 'no-such-file', has 'n'"),
        "{message}"
    );
    assert!(message.contains("cannot open no-such-file"), "{message}");
    assert_eq!(message.lines().count(), 1);

    assert_eq!(complaint(&[""]), "framelock: no bytes in the arguments\n");
    assert!(complaint(&["41", "--policy", "guess"]).contains("guess"));
}

#[test]
fn rows_come_as_the_bytes_do() {
    let mut command = std::process::Command::new(cargo_bin_cmd!("framelock").get_program());
    command.args(["trace", "-", "--policy", "rescan"]);
    command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    rows.next().unwrap().unwrap();
    for _ in 0..3 {
        input.write_all(b"A").unwrap();
        // Would wait for ever if the row were kept back.
        assert!(rows.next().unwrap().unwrap().contains("41 'A'"));
    }
    drop(input);
    assert!(rows.last().unwrap().unwrap().starts_with("rescan:"));
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("capture.bin");
    std::fs::write(&path, vec![0x55; 1_000_000]).unwrap();
    let mut command = std::process::Command::new(cargo_bin_cmd!("framelock").get_program());
    command.arg("trace").arg(path);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(rows.next().unwrap().unwrap().starts_with("offset"));
    drop(rows);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(text(output.stderr), "");
}

#[test]
fn help_has_examples() {
    let help = shown(&["--help"]);
    assert!(help.contains("Examples:\n  framelock trace "));
    assert!(help.contains("--policy"));
}
