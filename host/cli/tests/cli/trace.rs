//! `framelock trace` as its user meets it.

use std::io::{BufRead, BufReader, Write};

#[cfg(target_os = "linux")]
use crate::at_terminal::{AtTerminal, CONTROLLING, PROGRAM};
use crate::process::{self, CLEAN, complaint, framelock, run, text};

fn shown(arguments: &[&str]) -> String {
    process::shown(&[&["trace"], arguments].concat(), "")
}

const FIRST: &str = "\
offset  byte   policy    state     temp      setpoint  what happened
     0  41 'A' both       A -> B   -- -- --  -- -- --  sync
     1  42 'B' both       B -> 1   -- -- --  -- -- --  sync
     2  00     both       1 -> 2   -- -- --  -- -- --  reserved, not kept
     3  7F     both       2 -> 3   7F -- --  -- -- --  temp pitch=7F
     4  C8     both       3 -> 4   7F C8 --  -- -- --  temp roll=C8
     5  4A 'J' both       4 -> CR  7F C8 4A  -- -- --  temp yaw=4A
     6  0D CR  both      CR -> A   7F C8 4A  7F C8 4A  SP=(7F,C8,4A)

both:      7 bytes = 7 x 1 committed + 0 discarded + 0 pending
           SP=(7F,C8,4A)
";

const SECOND: &str = "\
offset  byte   policy    state     temp      setpoint  what happened
     0  41 'A' both       A -> B   -- -- --  -- -- --  sync
     1  42 'B' both       B -> 1   -- -- --  -- -- --  sync
     2  00     both       1 -> 2   -- -- --  -- -- --  reserved, not kept
     3  4A 'J' both       2 -> 3   4A -- --  -- -- --  temp pitch=4A
     4  0D CR  both       3 -> 4   4A 0D --  -- -- --  temp roll=0D
     5  41 'A' both       4 -> CR  4A 0D 41  -- -- --  temp yaw=41
     6  42 'B' lecture   CR -> A   4A 0D 41  -- -- --  not CR: 7 bytes discarded
     6  42 'B' framelock CR -> 1   4A 0D 41  -- -- --  not CR: 5 bytes discarded
                         resynchronised to the AB at offset 5
     7  00     lecture    A -> A   4A 0D 41  -- -- --  no sync: discarded
     7  00     framelock  1 -> 2   4A 0D 41  -- -- --  reserved, not kept
     8  82     lecture    A -> A   4A 0D 41  -- -- --  no sync: discarded
     8  82     framelock  2 -> 3   82 0D 41  -- -- --  temp pitch=82
     9  C4     lecture    A -> A   4A 0D 41  -- -- --  no sync: discarded
     9  C4     framelock  3 -> 4   82 C4 41  -- -- --  temp roll=C4
    10  4A 'J' lecture    A -> A   4A 0D 41  -- -- --  no sync: discarded
    10  4A 'J' framelock  4 -> CR  82 C4 4A  -- -- --  temp yaw=4A
    11  0D CR  lecture    A -> A   4A 0D 41  -- -- --  no sync: discarded
    11  0D CR  framelock CR -> A   82 C4 4A  82 C4 4A  SP=(82,C4,4A)

lecture:   12 bytes = 7 x 0 committed + 12 discarded + 0 pending
           SP=(--,--,--); no sync: 5; no CR: 7
framelock: 12 bytes = 7 x 1 committed + 5 discarded + 0 pending
           SP=(82,C4,4A); no sync: 4; no CR: 1
";

#[test]
fn without_arguments_the_lectures_two_examples_are_shown() {
    let expected = format!(
        "\
The lecture's first example: one frame, and the line loses nothing.

  sent      41 42 00 7F C8 4A 0D
  received  41 42 00 7F C8 4A 0D

{FIRST}

The lecture's second example: two frames; the line loses 7F and C8 of the first.

  sent      41 42 00 7F C8 4A 0D 41 42 00 82 C4 4A 0D
  received  41 42 00 -- -- 4A 0D 41 42 00 82 C4 4A 0D

{SECOND}"
    );
    assert_eq!(shown(&[]), expected);
}

#[test]
fn each_machine_may_be_shown_alone() {
    let received = "4142004A0D4142 0082C44A0D";
    assert_eq!(shown(&[received]), SECOND);
    for (policy, end, below) in [
        ("lecture", "SP=(--,--,--); no sync: 5; no CR: 7\n", 0),
        ("framelock", "SP=(82,C4,4A); no sync: 4; no CR: 1\n", 1),
    ] {
        let alone = shown(&[received, "--policy", policy]);
        let goes_on = " ".repeat(25) + "resynchronised to the AB at offset 5\n";
        assert_eq!(alone.matches(&goes_on).count(), below);
        let rows = SECOND.lines().skip(1).take(19);
        for row in rows.filter(|row| !goes_on.starts_with(row)) {
            // The rows that both have in common are the machine's too.
            let row = row.replace(" both      ", &format!(" {policy:<9} "));
            let is_of_it = row.contains(&format!(" {policy:<9} "));
            assert_eq!(alone.contains(&row), is_of_it, "{row}: {alone}");
        }
        assert!(alone.ends_with(end), "{alone}");
        assert_eq!(alone.lines().count(), 1 + 12 + below + 3);
    }
}

#[test]
fn what_a_state_does_with_a_wrong_byte_is_said() {
    // An A in state B, noise in state A, and a failed frame that ends in an A.
    let framelock = shown(&["41 41 2E 41 42 01 02 03 04 41", "--policy", "framelock"]);
    let rows = framelock.lines().skip(1).take(11);
    // What stands below the last row begins further to the left.
    let happened: Vec<&str> = rows
        .map(|row| &row[if row.starts_with("       ") { 25 } else { 55 }..])
        .collect();
    assert_eq!(
        happened,
        [
            "sync",
            "sync; the 'A' discarded",
            "no sync: both discarded",
            "sync",
            "sync",
            "reserved, not kept",
            "temp pitch=02",
            "temp roll=03",
            "temp yaw=04",
            "not CR: 6 bytes discarded",
            "resynchronised to the A at offset 9",
        ]
    );
    assert!(framelock.ends_with(
        "10 bytes = 7 x 0 committed + 9 discarded + 1 pending\n           SP=(--,--,--); no sync: 6; \
         broken sync: 2; no CR: 1\n"
    ));
}

#[test]
fn a_trace_fits_a_terminal_of_eighty_columns() {
    for policy in ["both", "lecture", "framelock"] {
        let shown = shown(&[
            "41 41 2E 41 42 01 02 03 04 41 42 2E 41 2E",
            "--policy",
            policy,
        ]);
        let too_long = shown.lines().find(|line| line.len() > 80);
        assert_eq!(too_long, None);
    }
    let too_long = shown(&[]);
    assert_eq!(too_long.lines().find(|line| line.len() > 80), None);
}

/// What of a row a terminal has no room for is left out, and `>` says so; a file and a pipe have all of it.
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
        let piped = framelock(arguments).current_dir(&directory).output();
        let piped = text(piped.unwrap().stdout);
        assert!(piped.contains(&format!("payload {payload}\n")), "{piped}");
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
fn bytes_that_are_piped_in_are_traced_and_for_nothing_there_are_the_examples() {
    assert_eq!(process::shown(&["trace"], CLEAN), FIRST);
    let hex = "41 42 00 7F\nC8 4A 0D\n";
    assert_eq!(process::shown(&["trace", "--input=hex"], hex), FIRST);
    for arguments in [&["--format=jsonl"][..], &["--frame=crsf"]] {
        let told = complaint(run(&[&["trace"], arguments].concat(), ""));
        assert!(told.contains("give HEX|FILE|PORT|-"), "{told}");
    }
}

#[test]
fn json_has_an_object_per_byte_and_machine() {
    let rows = shown(&["4142007FC84A0D", "--format", "jsonl"]);
    let rows: Vec<&str> = rows.lines().collect();
    assert_eq!(rows.len(), 14);
    assert_eq!(
        rows[13],
        "{\"offset\":6,\"byte\":13,\"policy\":\"framelock\",\"pending\":0,\"state_before\":\"CR\",\
         \"state_after\":\"A\",\"temp\":[127,200,74],\"setpoint\":[127,200,74],\
         \"what\":[{\"offset\":6,\"pitch\":127,\"roll\":200,\"yaw\":74}]}"
    );
    assert!(rows[0].contains("\"temp\":[null,null,null],\"setpoint\":null,"));
}

#[test]
fn files_and_standard_input_are_read_and_hex_is_hex_even_if_a_file_has_that_name() {
    assert_eq!(process::shown(&["trace", "-"], CLEAN), FIRST);
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("4142"), CLEAN).unwrap();
    let run = |argument| {
        let mut command = framelock(&["trace", argument]);
        let output = command.current_dir(&directory).output().unwrap();
        assert!(output.status.success());
        (text(output.stdout), text(output.stderr))
    };
    let (rows, told) = run("4142");
    assert!(rows.contains("2 bytes = "));
    assert_eq!(
        told,
        "framelock: 4142 is taken as hex; for the file write ./4142\n"
    );
    assert_eq!(run("./4142"), (FIRST.to_owned(), String::new()));
}

#[test]
fn rows_come_as_the_bytes_do() {
    let mut child = process::start(&["trace", "-", "--policy", "framelock"]);
    let mut input = child.stdin.take().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    rows.next().unwrap().unwrap();
    for _ in 0..3 {
        input.write_all(b"A").unwrap();
        // Would wait for ever if the row were kept back.
        assert!(rows.next().unwrap().unwrap().contains("41 'A'"));
    }
    drop(input);
    assert!(rows.any(|row| row.unwrap().starts_with("framelock:")));
    assert!(child.wait().unwrap().success());
}
