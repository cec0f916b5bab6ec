//! `framelock encode` as its user meets it.

use std::fs;
use std::io::{Read, Write};

use framelock::Encode;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::frames::described;
use crate::process::{CLEAN, complaint, run, shown, start, text, written};

/// The frames; it must succeed, and have nothing to complain of.
fn encoded(arguments: &[&str], input: impl AsRef<[u8]>) -> Vec<u8> {
    written(&[&["encode"], arguments].concat(), input)
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
fn what_is_decoded_can_be_encoded_again() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    // Longer than any buffer, in every format.
    let setpoints: Vec<[u8; 3]> = (0..20_000).map(|_| random.random()).collect();
    let stream = frames(&setpoints);
    for format in ["--format=jsonl", "--format=csv"] {
        let text = shown(&["decode", format], &stream);
        assert!(encoded(&[], &text) == stream, "{format}");
        let checked = encoded(&["--frame=bin-crc8"], &text);
        let rows = shown(&["decode", "--frame=bin-crc8", "--format=csv"], checked);
        assert!(encoded(&["--input-format=csv"], rows) == stream, "{format}");
    }
}

/// Clause F1: it means nothing, so no row has it. A description of one's own may.
#[test]
fn the_reserved_byte_is_taken_whatever_it_is_and_sent_as_zero() {
    let reserved = |byte: u8| [b'A', b'B', byte, 0x7F, 0xC8, 0x4A, b'\r'];
    let stream = (0..=255).flat_map(reserved).collect::<Vec<u8>>();
    let rows = shown(&["decode"], &stream);
    assert_eq!(rows.lines().count(), 256);
    assert!(encoded(&[], &rows) == reserved(0).repeat(256));
    let checked = encoded(&["--frame=bin-crc8"], &rows);
    assert!(checked == BinCrc8::encode([127, 200, 74].into()).repeat(256));

    let bin = shown(&["decode", "--describe"], "");
    let fields = "fields = [{ name = 'reserved', at = 2, type = 'u8' },";
    let (_folder, frame) = described(&bin.replace("fields = [", fields));
    let rows = shown(&["decode", &frame], &stream);
    assert!(rows.ends_with("\"reserved\":255,\"pitch\":127,\"roll\":200,\"yaw\":74}\n"));
    assert!(encoded(&[&frame], rows) == stream);
}

#[test]
fn what_is_wrong_with_a_row_is_told_and_rows_before_it_are_encoded() {
    let open_quote = [b"1,2,3\n1,2,\"".to_vec(), b"x\n".repeat(1 << 19)].concat();
    for (arguments, input, told, encoded) in [
        (
            &["encode"][..],
            &b"1,2,3\n4,5,6\n7,8,900\n1,1,1\n"[..],
            "line 3: yaw 900 is not a whole number from 0 to 255",
            &[[1, 2, 3], [4, 5, 6]][..],
        ),
        (&["encode"], &open_quote, "yaw \"x", &[[1, 2, 3]]),
        (
            &["encode"],
            &vec![0; 1 << 20],
            "line 1: columns: 1, expected: 3",
            &[],
        ),
        (&["encode"], &CLEAN, "line 1: columns: 1, expected: 3", &[]),
        (
            &["encode", "--input-format=jsonl"],
            b"1,2,3\n",
            "line 1: not a JSON object",
            &[],
        ),
        (
            &["encode", "--input-format=csv"],
            b"{}\n",
            "line 1: columns: 1",
            &[],
        ),
    ] {
        let output = run(arguments, input);
        assert_eq!(output.stdout, frames(encoded));
        let complaint = complaint(output);
        assert!(
            complaint.starts_with("framelock: standard input: line "),
            "{complaint}"
        );
        assert!(
            complaint.contains(told) && complaint.len() < 200,
            "{complaint}"
        );
    }
}

#[test]
fn frames_go_to_the_file_named() {
    let folder = tempfile::tempdir().unwrap();
    let [rows, out] = ["rows.csv", "out.bin"].map(|name| folder.path().join(name));
    let [rows_name, out_name] = [&rows, &out].map(|path| path.to_str().unwrap());
    fs::write(&rows, "1,2,3\n").unwrap();
    fs::write(&out, "an older and longer content").unwrap();
    assert_eq!(encoded(&[rows_name, "--output", out_name], ""), b"");
    assert_eq!(fs::read(&out).unwrap(), frames(&[[1, 2, 3]]));
    assert_eq!(encoded(&[rows_name, "-o", "-"], ""), frames(&[[1, 2, 3]]));
    // Emptied before it is read, it would be lost.
    let told = complaint(run(&["encode", rows_name, "-o", rows_name], ""));
    assert!(told.contains("is the input"), "{told}");
    assert_eq!(fs::read(&rows).unwrap(), b"1,2,3\n");
}

#[test]
fn a_row_that_is_wrong_leaves_a_file_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.bin");
    let arguments = ["encode", "-o", out.to_str().unwrap()];
    let told = complaint(run(&arguments, "1,2,3\n4,5,600\n"));
    assert!(told.contains("line 2: yaw 600"), "{told}");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    fs::write(&out, "older").unwrap();
    complaint(run(&arguments, "1,2,3\n4,5,600\n"));
    assert_eq!(fs::read(&out).unwrap(), b"older");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[test]
fn rows_that_are_not_there_and_text_that_is_utf_16_are_told() {
    let output = run(&["encode"], "pitch,roll,yaw\n");
    assert_eq!((output.status.code(), output.stdout), (Some(0), vec![]));
    let told = text(output.stderr);
    assert_eq!(
        told,
        "framelock: standard input has no rows, so there are no frames\n"
    );
    for bytes in [&b"\xFF\xFE1\0,\0"[..], b"\xFE\xFF\x001\x00,"] {
        for arguments in [&["encode"][..], &["send", "-", "--profile=-"]] {
            let told = complaint(run(arguments, bytes));
            assert!(
                told.contains("standard input is UTF-16 text: save it as UTF-8"),
                "{told}"
            );
        }
    }
}

#[test]
fn frames_come_out_while_rows_go_on() {
    let row = |demand| format!("{{\"pitch\":{demand},\"roll\":2,\"yaw\":3}}\n");
    for rows in [
        [1, 2, 3].map(|demand| format!("{demand},2,3\n")),
        [1, 2, 3].map(row),
    ] {
        let mut child = start(&["encode"]);
        let (mut input, mut output) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let text = rows.concat();
        let mut rest = text.as_str();
        for demand in 1..=3 {
            // The end of a row comes with the beginning of the next.
            let length = rest.find('\n').unwrap() + 2;
            let (piece, behind) = rest.split_at(length.min(rest.len()));
            rest = behind;
            input.write_all(piece.as_bytes()).unwrap();
            let mut frame = [0; 7];
            output.read_exact(&mut frame).unwrap();
            assert_eq!(frame.to_vec(), frames(&[[demand, 2, 3]]));
        }
        drop(input);
        assert!(child.wait().unwrap().success());
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_terminal_gets_frames_only_if_it_is_named() {
    use crate::process::{feed, framelock};
    use crate::pseudo_terminal::terminal;

    for (arguments, code) in [(&["encode"][..], 2), (&["encode", "--output=-"], 0)] {
        let (_user, near_end) = terminal(80, 24);
        let child = framelock(arguments).stdout(near_end).spawn().unwrap();
        let output = feed(child, b"1,2,3\n");
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        if code == 2 {
            assert!(complaint(output).contains("--output"));
        }
    }
    // Before anything is asked for.
    let (_user, near_end) = terminal(80, 24);
    let mut command = framelock(&["encode"]);
    let stream = near_end.try_clone().unwrap();
    let output = command.stdin(stream).stdout(near_end).output().unwrap();
    assert_eq!(complaint(output).lines().count(), 1);
}
