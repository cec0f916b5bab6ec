//! Tests of `framelock encode` as a process.

use std::fs;
use std::io::{Read, Write};

use framelock::Encode;
use framelock::motion::{Bin, Setpoint};
use framelock_limited::{Process, RunToEnd as _};

use crate::process::{complaint, feed, framelock, shown, start, written};

fn frames(setpoints: &[[u8; 3]]) -> Vec<u8> {
    let frame = |&setpoint| Bin::encode(Setpoint::from(setpoint));
    setpoints.iter().flat_map(frame).collect()
}

#[test]
fn setpoints_may_have_many_notations() {
    let two = frames(&[[1, 2, 3], [4, 5, 6]]);
    for text in [
        "1,2,3\n4,5,6\n",
        "1,2,3\r\n4,5,6\r\n",
        "1,2,3\n4,5,6",
        " 1 , 2 , 3 \n\n\"4\",5,6\n",
        "\n \n1,2,3\n  \t\n4,5,6\n \n,,\n",
        "pitch,roll,yaw\n1,2,3\n4,5,6\n",
        "\u{FEFF}pitch,roll,yaw\n1,2,3\n4,5,6\n",
        "\u{FEFF}1,2,3\n4,5,6\n",
        "\u{FEFF}# a motion, by hand\n\npitch,roll,yaw\n# begin\n1,2,3\n# \"go on\n4,5,6\n",
        "time,yaw,roll,pitch,note\n6,3,2,1,\"a, b\"\n5,6,5,4,\"over\ntwo lines\"\n",
        "{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6}\n",
        "# two\n{\"pitch\":1,\"roll\":2,\"yaw\":3}\n# and\n{\"pitch\":4,\"roll\":5,\"yaw\":6}",
        "\n \n{ \"yaw\": 3, \"roll\": 2, \"pitch\": 1, \"time\": \"x\" }\r\n\n{\"pitch\":4,\"roll\":5,\"yaw\":6}",
        "\u{FEFF}{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":4,\"roll\":5,\"yaw\":6,\"more\":[{}]}\n",
    ] {
        assert_eq!(written(&["encode"], text), two, "{text}");
    }
    // An ignored column may contain bytes that are not UTF-8.
    let latin_1 = b"pitch,roll,yaw,note\n1,2,3,H\xF6he\n4,5,6,\n";
    assert_eq!(written(&["encode"], latin_1), two);
}

#[test]
fn frames_are_written_before_the_rows_end() {
    for row in [
        |demand: u8| format!("{demand},2,3\n"),
        |demand| format!("{{\"pitch\":{demand},\"roll\":2,\"yaw\":3}}\n"),
    ] {
        let mut child = start(&["encode"]);
        let (mut input, mut output) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        for demand in 1..=3 {
            // The end of a row arrives together with the beginning of the next row.
            let rows = row(demand) + &row(demand + 1);
            let from = usize::from(demand > 1);
            let piece = &rows[from..=row(demand).len()];
            input.write_all(piece.as_bytes()).unwrap();
            let mut frame = [0; 7];
            output.read_exact(&mut frame).unwrap();
            assert_eq!(frame.to_vec(), frames(&[[demand, 2, 3]]));
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_terminal_gets_frames_only_if_it_is_named() {
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
        let arguments = |command| [command, "--frame", frame];
        let decoded = shown(&arguments("decode"), &stream);
        assert_eq!(decoded, format!("{expected}\n"));
        // The stream is noise, a frame, a second frame with one wrong byte, and a third frame.
        let mut wrong = stream.clone();
        *wrong.last_mut().unwrap() ^= 0x55;
        let noisy = [&b"noise"[..], &stream, &wrong, &stream].concat();
        for format in ["--format=csv", "--format=jsonl"] {
            let rows = shown(&[&arguments("decode")[..], &[format]].concat(), &noisy);
            let encoded = written(&arguments("encode"), &rows);
            assert!(encoded == stream.repeat(2), "{frame}: {rows}");
        }
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
