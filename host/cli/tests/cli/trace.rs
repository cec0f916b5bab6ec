//! Tests of `framelock trace` as a process.

use std::io::{BufRead, BufReader, Write};

#[cfg(target_os = "linux")]
use framelock_limited::RunToEnd as _;

#[cfg(target_os = "linux")]
use crate::at_terminal::{AtTerminal, CONTROLLING, PROGRAM};
use crate::process::{self, framelock, text};

/// A terminal receives rows that are cut to its width and end in `>`. A file or a pipe receives whole rows.
#[test]
#[cfg(target_os = "linux")]
fn rows_of_any_frames_fit_the_terminal_and_a_pipe_gets_all_of_them() {
    let directory = tempfile::tempdir().unwrap();
    let payload = "0102030405".repeat(8);
    let row = format!("class,id,payload\n5,1,{payload}\n");
    let stream = process::written(&["encode", "--frame=ubx"], row);
    std::fs::write(directory.path().join("capture.bin"), &stream).unwrap();
    for arguments in [
        &["decode", "capture.bin", "--frame=ubx", "--format=text"][..],
        &["trace", "capture.bin", "--frame=ubx"],
    ] {
        let piped = framelock(arguments).current_dir(&directory).run_to_end(b"");
        let piped = text(piped.unwrap().stdout);
        assert!(piped.contains(&format!("payload x{payload}\n")), "{piped}");
        let command = [&[PROGRAM], arguments].concat();
        let terminal = AtTerminal::start(&CONTROLLING, &command, "", directory.path());
        let (shown, code) = terminal.finish();
        assert_eq!(code, Some(0), "{shown}");
        let expected = piped.lines().map(|row| match row.get(..79) {
            Some(beginning) if row.len() > 80 => format!("{beginning}>\n"),
            _ => format!("{row}\n"),
        });
        let expected: String = expected.collect();
        assert!(expected.contains(">\n"));
        assert_eq!(shown, expected + "END");
    }
}

#[test]
fn rows_are_written_as_the_bytes_arrive() {
    let mut child = process::start(&["trace", "-", "--policy", "framelock"]);
    let mut input = child.stdin.take().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    rows.next().unwrap().unwrap();
    for _ in 0..3 {
        input.write_all(b"A").unwrap();
        // If the program held the row back, this read would never return.
        assert!(rows.next().unwrap().unwrap().contains("41 'A'"));
    }
    drop(input);
    assert!(rows.any(|row| row.unwrap().starts_with("framelock:")));
    assert!(child.wait().unwrap().success());
}
