//! What every subcommand does alike.

use std::fs::File;
use std::process::Stdio;

use crate::process::{CLEAN, complaint, feed, framelock, run, shown, start, text};

const SUBCOMMANDS: [&str; 8] = [
    "decode", "trace", "encode", "generate", "demo", "send", "monitor", "simulate",
];

#[test]
fn help_begins_with_the_demo_and_is_a_page_on_a_terminal_of_eighty_columns() {
    let help = |arguments: &[&str]| {
        let mut command = framelock(arguments);
        let child = command.env("COLUMNS", "80").spawn().unwrap();
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
    let expected =
        "demo trace decode monitor send encode generate simulate ports completions man help";
    assert_eq!(commands.join(" "), expected, "each in a line of its own");
    assert!(all.contains("Examples:\n  framelock demo "), "{all}");
    for subcommand in SUBCOMMANDS {
        let long = help(&[subcommand, "--help"]);
        assert!(long.lines().count() <= 80, "{long}");
        let short = help(&[subcommand, "-h"]);
        assert!(!short.contains("Examples:"), "{short}");
        assert!(long.starts_with(&short), "{short}");
    }
}

#[test]
fn completions_and_manual_pages_have_every_command() {
    for (arguments, commands) in [
        (&["completions", "bash"][..], &SUBCOMMANDS[..]),
        (&["completions", "zsh"], &SUBCOMMANDS),
        (&["completions", "fish"], &SUBCOMMANDS),
        (&["completions", "powershell"], &SUBCOMMANDS),
        (&["completions", "elvish"], &SUBCOMMANDS),
        (&["man"], &SUBCOMMANDS),
        (&["man", "send"], &["stop\\-bits", "framelock\\-send"]),
    ] {
        let shown = shown(arguments, "");
        for command in commands {
            assert!(shown.contains(command), "{arguments:?}: {command}");
        }
        // Of the other shells clap has no values.
        let shell = arguments[arguments.len() - 1];
        let has_values = ["bash", "zsh", "fish"].contains(&shell);
        assert_eq!(shown.contains("mavlink1"), has_values, "{arguments:?}");
        // Beside the frames' names come descriptions, with each of the commands that take them.
        let files = match shell {
            "zsh" => "six-axes-be; _files -g \"*.toml\"}'",
            "fish" => "six-axes-be\\t''\n(__fish_complete_suffix .toml)\"",
            _ => continue,
        };
        assert_eq!(shown.matches(files).count(), 6, "{arguments:?}");
    }
}

#[test]
fn a_manual_page_keeps_its_examples_line_by_line() {
    for subcommand in SUBCOMMANDS {
        let help = shown(&[subcommand, "--help"], "");
        let page = shown(&["man", subcommand], "");
        let (_, page) = page.split_once(".SH EXAMPLES\n.nf\n").unwrap();
        let page = page.replace("\\-", "-").replace("\\*(Aq", "'");
        let page = page.replace("\\\\", "\\");
        let (_, examples) = help.split_once("Examples:\n").unwrap();
        for example in examples.lines().take_while(|line| !line.is_empty()) {
            assert!(
                page.contains(&format!("\n{example}\n")),
                "{example}: {page}"
            );
        }
    }
}

#[test]
fn ports_are_listed_or_there_are_none() {
    let output = run(&["ports"], "");
    assert_eq!(output.status.code(), Some(0));
    let told = text(output.stderr).starts_with("framelock: there is no serial port: is the board");
    assert_eq!(told, output.stdout.is_empty());
}

#[test]
fn help_has_examples() {
    for subcommand in SUBCOMMANDS {
        let help = shown(&[subcommand, "--help"], "");
        assert!(help.contains("Examples:\n  "), "{help}");
        assert!(
            help.contains(&format!("  framelock {subcommand} ")),
            "{help}"
        );
    }
}

#[test]
fn the_reader_of_standard_output_may_go() {
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
        let told = text(output.stderr);
        assert!(told.is_empty() || arguments[0] == "send", "{told}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_told() {
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
        let child = framelock(arguments).stdout(Stdio::from(full())).spawn();
        let told = complaint(feed(child.unwrap(), input));
        let start = format!("framelock: cannot write to {named}: ");
        assert!(
            told.starts_with(&start) && told.contains("make room"),
            "{told}"
        );
        assert_eq!(told.lines().count(), 1, "{told}");
    }
}

/// Command lines, and what they complain of in one line; `DIRECTORY` is one.
const CANNOT_BE_OPENED: &str = "
    decode no/such/file => cannot open no/such/file
    decode no/such/port => name a file, a serial port (`framelock ports` lists them), or -
    decode DIRECTORY => is a directory; name a file, a serial port
    decode --baud=9600 /dev/ttyNONE => cannot open /dev/ttyNONE
    decode --baud=9600 => --baud is for serial ports, and standard input is none
    decode --baud=9600 Cargo.toml => --baud is for serial ports, and Cargo.toml
    decode --policy=lecture --frame=bin-crc8 => the lecture's machine, which knows --frame bin and no
    trace no-such-file => not hex: word 1, 'no-such-file', has 'n'
    trace no-such-file => cannot open no-such-file
    trace 41 42 4G => word 3, '4G', has 'G', which is no hex digit
    trace 41 420 => word 2, '420', is not a whole number of bytes
    trace , => no bytes in the arguments
    encode no/such/file => cannot open no/such/file
    generate --frame=bin --language=c --output=no/such/folder/file => cannot write to no/such/folder/file
    encode --output=no/such/folder/file => cannot write to no/such/folder/file
    decode --parity=even => --parity is for serial ports, and standard input is none
    decode --stop-bits=2 Cargo.toml => --stop-bits is for serial ports, and Cargo.toml
    man nothing => there is no command nothing
    send - --profile=no/such/file => cannot open no/such/file
    send Cargo.toml --motion=step => Cargo.toml is no serial port
    send no/such/port --motion=step => there is no no/such/port
    send - --motion=step --baud=9600 => --baud is for serial ports
    monitor /dev/ttyACM0 => `framelock decode /dev/ttyACM0 --format text` writes lines
";

/// Command lines that no run could mean, and what is named.
const IMPOSSIBLE: &str = "
    decode --baud=abc => a rate in bits per second is wanted, for example 115200
    decode --baud=0 => for example 115200
    decode --stop-bits=3 => a whole number from 1 to 2 is wanted
    decode --parity=mark => [possible values: none, even, odd]
    send - --udp=4123 => an address and a port are wanted, for example 127.0.0.1:4123
    send - --motion=step --rate=abc => a whole number from 1 to 100000 is wanted
    trace 41 --policy guess => guess
    generate --frame=bin --language=basic => [possible values: rust, c]
    generate --frame=nothing --language=c => there is neither such a frame nor such a file
    send - => --motion <MOTION>|--profile <FILE>|--udp
    send - --motion=step --udp=127.0.0.1:0 => --motion
    send - --motion=step --drop=2 => a number from 0 to 1
    send - --motion=step --park=1,2 => is not three numbers
    send - --motion=step --park=1,2,300 => yaw \"300\"
    send - --motion=step --no-park --park=1,2,3 => --no-park
";

#[test]
fn what_cannot_be_done_is_named_with_what_is_wanted() {
    let directory = tempfile::tempdir().unwrap();
    for (table, is_one_line) in [(CANNOT_BE_OPENED, true), (IMPOSSIBLE, false)] {
        for case in table.lines().filter(|case| !case.is_empty()) {
            let (arguments, told) = case.split_once(" => ").unwrap();
            let arguments = arguments.replace("DIRECTORY", directory.path().to_str().unwrap());
            let arguments: Vec<&str> = arguments.split_whitespace().collect();
            let output = feed(start(&arguments), b"");
            assert!(output.stdout.is_empty());
            let complaint = complaint(output);
            assert!(complaint.contains(told), "{case}: {complaint}");
            if is_one_line {
                assert!(complaint.starts_with("framelock: "), "{complaint}");
                assert_eq!(complaint.lines().count(), 1, "{complaint}");
            }
        }
    }
}
