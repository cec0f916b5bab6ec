//! Tests of `framelock encode` as a process.

use std::fs;
use std::io::{Read, Write};

use framelock::Encode;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock_limited::RunToEnd as _;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::process::{described, framelock, shown, start, written};

/// Runs `framelock encode`, which must succeed without messages, and returns the frames.
fn encoded(arguments: &[&str], input: impl AsRef<[u8]>) -> Vec<u8> {
    written(&[&["encode"], arguments].concat(), input)
}

fn frames(setpoints: &[[u8; 3]]) -> Vec<u8> {
    let frame = |&setpoint| Bin::encode(Setpoint::from(setpoint));
    setpoints.iter().flat_map(frame).collect()
}

#[test]
fn decoded_rows_can_be_encoded_again() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    // The input is longer than any buffer, in every format.
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

/// The reserved byte has no meaning (clause F1 of docs/protocol.md), so the rows of `bin` do not contain it. A user's
/// description may have a field for it.
#[test]
fn any_reserved_byte_is_accepted_and_zero_is_sent() {
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
fn frames_are_written_before_the_rows_end() {
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
            // The end of a row arrives together with the beginning of the next row.
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
    use framelock_limited::Process;

    use crate::process::{complaint, feed, framelock};
    use crate::pseudo_terminal::terminal;

    for (arguments, code) in [(&["encode"][..], 2), (&["encode", "--output=-"], 0)] {
        let (_user, near_end) = terminal(80, 24);
        let child = Process::start(framelock(arguments).stdout(near_end)).unwrap();
        let output = feed(child, b"1,2,3\n");
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        if code == 2 {
            assert!(complaint(output).contains("--output"));
        }
    }
    // The error must come before any row is read.
    let (_user, near_end) = terminal(80, 24);
    let mut command = framelock(&["encode"]);
    let stream = near_end.try_clone().unwrap();
    let child = Process::start(command.stdin(stream).stdout(near_end)).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(complaint(output).lines().count(), 1);
}

/// Decodes frames that other programs have made or that were published.
#[test]
fn frames_of_other_programs_are_decoded_and_encoded_again() {
    let recordings = include_str!("../recordings.txt").lines();
    let mut recordings = recordings.filter(|line| !line.is_empty() && !line.starts_with('#'));
    let mut count = 0;
    while let (Some(recording), Some(expected)) = (recordings.next(), recordings.next()) {
        let (frame, bytes) = recording.split_once(": ").unwrap();
        let stream = framelock_description::hex::parse(&[bytes]).unwrap();
        let arguments = |command| vec![command, "--frame", frame];
        let decoded = shown(&arguments("decode"), &stream);
        assert_eq!(decoded, format!("{expected}\n"));
        // The stream is noise, a frame, a second frame with one wrong byte, and a third frame.
        let mut wrong = stream.clone();
        *wrong.last_mut().unwrap() ^= 0x55;
        let noisy = [&b"noise"[..], &stream, &wrong, &stream].concat();
        let csv = shown(
            &[arguments("decode"), vec!["--format=csv"]].concat(),
            &noisy,
        );
        assert_eq!(csv.lines().count(), 3, "{frame}: {csv}");
        let encoded = written(&arguments("encode"), &csv);
        assert!(encoded == stream.repeat(2), "{frame}: {encoded:02X?}");
        let json = shown(&arguments("decode"), &noisy);
        assert!(written(&arguments("encode"), json) == stream.repeat(2));
        count += 1;
    }
    assert_eq!(count, 22);
}

#[test]
fn a_file_is_replaced_only_if_all_rows_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.bin");
    let files = || fs::read_dir(folder.path()).unwrap().count();
    for before in [None, Some(""), Some("old")] {
        if let Some(content) = before {
            fs::write(&path, content).unwrap();
        }
        let run = |rows: &str| {
            let mut encode = framelock(&["encode", "--output"]);
            encode.arg(&path).run_to_end(rows.as_bytes()).unwrap()
        };
        let output = run("1,2,3\n1,2,256\n");
        assert!(!output.status.success(), "{before:?}");
        let content = fs::read_to_string(&path).ok();
        assert_eq!(content.as_deref(), before);
        assert_eq!(
            files(),
            usize::from(before.is_some()),
            "no other file remains"
        );
        assert!(run("1,2,3\n").status.success(), "{before:?}");
        assert_eq!(fs::read(&path).unwrap(), frames(&[[1, 2, 3]]));
        fs::remove_file(&path).unwrap();
    }
}
