//! `framelock encode` as its user meets it.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::fs::{self, File};
use std::io::{BufReader, Read, Write};
use std::process::{Command, Output, Stdio};

use assert_cmd::cargo::{cargo_bin, cargo_bin_cmd};
use framelock::{Bin, BinCrc8, Format, Setpoint};
use framelock_host::encode::{InputFormat, encode as encode_text};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn run(subcommand: &str, arguments: &[&str], input: &[u8]) -> Output {
    cargo_bin_cmd!("framelock")
        .arg(subcommand)
        .args(arguments)
        .write_stdin(input)
        .output()
        .unwrap()
}

fn encode(arguments: &[&str], input: impl AsRef<[u8]>) -> Output {
    run("encode", arguments, input.as_ref())
}

/// The frames; it must succeed, and have nothing to complain of.
fn encoded(arguments: &[&str], input: impl AsRef<[u8]>) -> Vec<u8> {
    let output = encode(arguments, input);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(output.stderr, b"");
    output.stdout
}

/// What it complains of, in one line; it must fail with 2.
fn complaint(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let complaint = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(complaint.lines().count(), 1, "{complaint}");
    complaint
}

fn frames(setpoints: &[[u8; 3]]) -> Vec<u8> {
    let frame = |&setpoint| Bin::encode(Setpoint::from(setpoint));
    setpoints.iter().flat_map(frame).collect()
}

#[test]
fn the_lectures_frame() {
    let frame = [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D];
    assert_eq!(encoded(&[], "127,200,74\n"), frame);
    assert_eq!(
        encoded(&["--frame=bin-crc8"], "127,200,74\n"),
        BinCrc8::encode([127, 200, 74].into())
    );
}

#[test]
fn every_spelling_of_two_setpoints() {
    for text in [
        "1,2,3\n4,5,6\n",
        "1,2,3\r\n4,5,6\r\n",
        "1,2,3\n4,5,6",
        " 1 , 2 , 3 \n\n\"4\",5,6\n",
        "pitch,roll,yaw\n1,2,3\n4,5,6\n",
        "\u{FEFF}pitch,roll,yaw\n1,2,3\n4,5,6\n",
        "\u{FEFF}1,2,3\n4,5,6\n",
        "offset,Yaw,ROLL,pitch,note\n6,3,2,1,\"a, b\"\n13,6,5,4,\"over\ntwo lines\"\n",
        "{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6}\n",
        "\n \n{ \"yaw\": 3, \"roll\": 2, \"pitch\": 1, \"offset\": 6 }\r\n\n{\"pitch\":4,\"roll\":5,\"yaw\":6}",
        "\u{FEFF}{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6,\"more\":[{}]}\n",
    ] {
        let expected = frames(&[[1, 2, 3], [4, 5, 6]]);
        assert_eq!(encoded(&[], text), expected, "{text}");
        // However it arrives.
        for length in 1..9 {
            let mut pieces = BufReader::with_capacity(length, text.as_bytes());
            let mut output = Vec::new();
            encode_text::<Bin, _, _>(&mut pieces, &mut output, InputFormat::Auto).unwrap();
            assert_eq!(output, expected, "{length}: {text}");
        }
    }
}

#[test]
fn no_setpoints_are_no_frames() {
    for text in ["", "\n\n", "pitch,roll,yaw\n", "pitch,roll,yaw"] {
        assert_eq!(encoded(&[], text), b"", "{text}");
    }
    assert_eq!(encoded(&["--input-format=jsonl"], "\n"), b"");
}

#[test]
fn what_is_decoded_can_be_encoded_again() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    // Longer than any buffer, in every format.
    let setpoints: Vec<[u8; 3]> = (0..100_000).map(|_| random.random()).collect();
    let stream = frames(&setpoints);
    for format in ["--format=jsonl", "--format=csv"] {
        let text = run("decode", &[format], &stream).stdout;
        assert!(encoded(&[], &text) == stream, "{format}");
        let checked = encoded(&["--frame=bin-crc8"], &text);
        let rows = run("decode", &["--frame=bin-crc8", "--format=csv"], &checked).stdout;
        assert!(encoded(&["--input-format=csv"], rows) == stream, "{format}");
    }
}

#[test]
fn a_demand_out_of_range_is_told_with_its_place_and_the_range() {
    for (text, place) in [
        ("1,2,256\n", r#"line 1: column 3 (yaw): "256""#),
        ("1,2,3\n1,-2,3\n", r#"line 2: column 2 (roll): "-2""#),
        (
            "roll,pitch,yaw\n1,2.5,3\n",
            r#"line 2: column 2 (pitch): "2.5""#,
        ),
        ("1,2,3\n\n1,,3", r#"line 3: column 2 (roll): """#),
        ("up,2,3\n", r#"line 1: column 1 (pitch): "up""#),
        (r#"{"pitch":1,"roll":-1,"yaw":3}"#, "line 1: field roll: -1"),
        (
            r#"{"pitch":"1","roll":2,"yaw":3}"#,
            r#"line 1: field pitch: "1""#,
        ),
        (
            r#"{"pitch":1,"roll":2,"yaw":2.5}"#,
            "line 1: field yaw: 2.5",
        ),
        (
            r#"{"pitch":1,"roll":2,"yaw":null}"#,
            "line 1: field yaw: null",
        ),
    ] {
        assert_eq!(
            complaint(&encode(&[], text)),
            format!("framelock: standard input: {place} is not a whole number from 0 to 255\n"),
        );
    }
}

#[test]
fn a_row_of_another_form_is_told_with_its_place() {
    for (text, place) in [
        ("1,2\n", "line 1: columns: 2, expected: 3"),
        ("1,2,3\n1,2,3,4\n", "line 2: columns: 4, expected: 3"),
        ("pitch,roll\n1,2\n", "line 1: the header does not name all"),
        (
            "pitch,roll,yaw,roll\n",
            "line 1: the header names roll twice",
        ),
        ("1,2,3\r4,5,6\n", "line 1: a second row"),
        ("\n{\"pitch\":1,\"roll\":2}\n", "line 2: no field yaw"),
        (
            r#"{"pitch":1,"pitch":1,"roll":2,"yaw":3}"#,
            "line 1: column 18: duplicate field",
        ),
        ("{\"pitch\":1,\n", "line 1: column 11: EOF"),
        (
            "{\"pitch\":1,\"roll\":2,\"yaw\":3}\n1,2,3\n",
            "line 2: not a JSON object",
        ),
    ] {
        let told = complaint(&encode(&[], text));
        let start = format!("framelock: standard input: {place}");
        assert!(told.starts_with(&start), "{text}{told}");
    }
}

#[test]
fn rows_before_a_bad_one_are_encoded() {
    let output = encode(&[], "1,2,3\n4,5,6\n7,8,900\n1,1,1\n");
    complaint(&output);
    assert_eq!(output.stdout, frames(&[[1, 2, 3], [4, 5, 6]]));
}

#[test]
fn what_is_no_text_is_refused_before_it_fills_the_memory() {
    let told = complaint(&encode(&[], vec![0; 1 << 20]));
    assert!(told.contains("line 1: longer than"), "{told}");
    let open_quote = [b"1,2,\"".to_vec(), b"x\n".repeat(1 << 19)].concat();
    let told = complaint(&encode(&[], open_quote));
    assert!(told.contains("quote"), "{told}");
    let told = complaint(&encode(&[], ",".repeat(5_000) + "\n"));
    assert!(told.contains("columns"), "{told}");
    let told = complaint(&encode(&[], frames(&[[1, 2, 3]])));
    assert!(told.contains("columns: 1, expected: 3"), "{told}");
}

#[test]
fn frames_go_to_the_file_named() {
    let folder = tempfile::tempdir().unwrap();
    let rows = folder.path().join("rows.csv");
    let out = folder.path().join("out.bin");
    let [rows_name, out_name] = [&rows, &out].map(|path| path.to_str().unwrap());
    fs::write(&rows, "1,2,3\n").unwrap();
    fs::write(&out, "an older and longer content").unwrap();
    assert_eq!(encoded(&[rows_name, "--output", out_name], ""), b"");
    assert_eq!(fs::read(&out).unwrap(), frames(&[[1, 2, 3]]));
    assert_eq!(encoded(&[rows_name, "-o", "-"], ""), frames(&[[1, 2, 3]]));
    // Emptied before it is read, it would be lost.
    let told = complaint(&encode(&[rows_name, "-o", rows_name], ""));
    assert!(told.contains("is the input"), "{told}");
    assert_eq!(fs::read(&rows).unwrap(), b"1,2,3\n");
}

#[test]
fn what_cannot_be_opened_is_named() {
    let told = complaint(&encode(&["no/such/file"], ""));
    assert!(told.contains("no/such/file"), "{told}");
    let told = complaint(&encode(&["--output=no/such/folder/file"], ""));
    assert!(told.contains("no/such/folder/file"), "{told}");
}

#[test]
fn frames_come_out_while_rows_go_on() {
    let mut child = Command::new(cargo_bin!("framelock"))
        .arg("encode")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut input, mut output) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
    for demand in 0..3 {
        // The end of a row comes with the beginning of the next.
        write!(input, "{demand},2,3\n9").unwrap();
        let mut frame = [0; 7];
        output.read_exact(&mut frame).unwrap();
        let pitch = if demand == 0 { 0 } else { 90 + demand };
        assert_eq!(frame.to_vec(), frames(&[[pitch, 2, 3]]));
    }
    writeln!(input, ",2,3").unwrap();
    drop(input);
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_closed_pipe_ends_it_quietly() {
    let mut child = Command::new(cargo_bin!("framelock"))
        .arg("encode")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut input = child.stdin.take().unwrap();
    // It may have ended before all is written.
    let _ = input.write_all(&b"1,2,3\n".repeat(100_000));
    drop(input);
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr), (Some(0), vec![]));
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_told() {
    for output in [None, Some("/dev/full")] {
        let mut child = Command::new(cargo_bin!("framelock"))
            .arg("encode")
            .args(output.map(|name| format!("--output={name}")))
            .stdin(Stdio::piped())
            .stdout(File::options().write(true).open("/dev/full").unwrap())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(b"1,2,3\n").unwrap();
        let told = complaint(&child.wait_with_output().unwrap());
        let name = output.unwrap_or("standard output");
        assert!(told.contains(&format!("cannot write to {name}")), "{told}");
    }
}

#[test]
#[cfg(unix)]
fn a_terminal_gets_frames_only_if_it_is_named() {
    use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let screen = openpt(flags).unwrap();
    unlockpt(&screen).unwrap();
    let name = ptsname(&screen, Vec::new()).unwrap().into_string().unwrap();
    for (arguments, code) in [(&[][..], 2), (&["--output=-"], 0)] {
        let terminal = File::options().read(true).write(true).open(&name).unwrap();
        let mut child = Command::new(cargo_bin!("framelock"))
            .arg("encode")
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(terminal)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Refused, it may have ended before this is written.
        let _ = child.stdin.take().unwrap().write_all(b"1,2,3\n");
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        if code == 2 {
            assert!(complaint(&output).contains("--output"));
        }
    }
}
