//! Tests of the behaviour that all subcommands share.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;

use crate::process::{CLEAN, complaint, feed, framelock, run, start, text};
use framelock_limited::Process;

const SUBCOMMANDS: [&str; 8] = [
    "decode", "trace", "encode", "generate", "demo", "send", "monitor", "simulate",
];

#[test]
fn help_begins_with_the_demo_and_is_a_page_on_a_terminal_of_eighty_columns() {
    let help = |arguments: &[&str]| {
        let mut command = framelock(arguments);
        let child = Process::start(command.env("COLUMNS", "80")).unwrap();
        let help = text(feed(child, b"").stdout);
        let usage = help.lines().filter(|line| !line.starts_with("Usage: "));
        assert!(usage.clone().all(|line| line.len() <= 80), "{help}");
        help
    };
    let all = help(&["--help"]);
    let (_, commands) = all.split_once("Commands:\n").unwrap();
    let commands = commands.lines().take_while(|line| !line.is_empty());
    let commands: Vec<&str> = commands
        .map(|line| line.split_whitespace().next().unwrap())
        .collect();
    let expected = "demo trace decode monitor send encode generate simulate ports help";
    assert_eq!(commands.join(" "), expected, "each in a line of its own");
    assert!(all.contains("Examples:\n  framelock demo "), "{all}");
    for subcommand in SUBCOMMANDS {
        let long = help(&[subcommand, "--help"]);
        assert!(long.lines().count() <= 80, "{long}");
        let examples = format!("Examples:\n  framelock {subcommand} ");
        assert!(long.contains(&examples), "{long}");
        let short = help(&[subcommand, "-h"]);
        assert!(!short.contains("Examples:"), "{short}");
        assert!(long.starts_with(&short), "{short}");
    }
}

#[test]
fn ports_are_listed_or_there_are_none() {
    let output = run(&["ports"], "");
    assert_eq!(output.status.code(), Some(0));
    let has_note =
        text(output.stderr).starts_with("framelock: there is no serial port: check that");
    assert_eq!(has_note, output.stdout.is_empty());
}

#[test]
fn it_is_no_error_if_the_reader_of_standard_output_goes() {
    let frames = CLEAN.repeat(100_000);
    let rows = b"1,2,3\n".repeat(100_000);
    for (arguments, input) in [
        (&["decode"][..], &frames),
        (&["decode", "--summary=-"], &frames),
        (&["trace", "-"], &frames),
        (&["encode"], &rows),
        (&["demo"], &vec![]),
        (&["send", "-", "--motion=step", "--rate=1000"], &vec![]),
        (&["simulate"], &vec![]),
    ] {
        let mut child = start(arguments);
        drop(child.stdout.take());
        let output = feed(child, input);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {output:?}");
        let message = text(output.stderr);
        assert!(message.is_empty() || arguments[0] == "send", "{message}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_reported() {
    let full = || File::options().write(true).open("/dev/full").unwrap();
    for (arguments, input, named) in [
        (&["decode"][..], &CLEAN[..], "standard output"),
        (
            &["decode", "--summary=-", "--format=none"],
            &CLEAN,
            "standard output",
        ),
        (&["trace", "-"], &CLEAN, "standard output"),
        (&["encode"], b"1,2,3\n", "standard output"),
        (&["encode", "--output=/dev/full"], b"1,2,3\n", "/dev/full"),
    ] {
        let child = Process::start(framelock(arguments).stdout(Stdio::from(full())));
        let message = complaint(feed(child.unwrap(), input));
        let start = format!("framelock: cannot write to {named}: ");
        assert!(
            message.starts_with(&start) && message.contains("free some space"),
            "{message}"
        );
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

#[test]
fn an_error_message_names_the_problem_and_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let table = include_str!("../complaints.txt").replace('\r', "");
    let (impossible, senseless) = table.split_once("\n\n").unwrap();
    for (cases, is_one_line) in [(impossible, true), (senseless, false)] {
        for case in cases.lines().filter(|case| !case.starts_with('#')) {
            let (command, expected) = case.split_once(" => ").unwrap();
            let (input, arguments) = match command.split_once(" | ") {
                Some((echo, arguments)) => {
                    let text = echo.strip_prefix("echo ").unwrap();
                    let text = text.replace("\\n", "\n").replace("\\r", "\r");
                    (text + "\n", arguments)
                }
                None => (String::new(), command),
            };
            let arguments = arguments.replace("FOLDER", folder.path().to_str().unwrap());
            let arguments: Vec<&str> = arguments.split_whitespace().collect();
            let output = run(&arguments, input);
            // `encode` writes the frames of the rows before the wrong row.
            assert!(output.stdout.is_empty() || arguments == ["encode"]);
            let complaint = complaint(output);
            assert!(complaint.contains(expected), "{case}: {complaint}");
            if is_one_line {
                assert!(complaint.starts_with("framelock: "), "{complaint}");
                assert_eq!(complaint.lines().count(), 1, "{complaint}");
            }
        }
    }
}

#[test]
fn rows_of_trace_are_written_as_the_bytes_arrive() {
    let mut child = start(&["trace", "-", "--policy", "framelock"]);
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
