//! Tests of `framelock monitor` on a pseudo-terminal, whose screen the test reads.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{Read, Write as _};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::time::Duration;

use framelock_host::screen::Screen;
use rustix::termios::{InputModes, tcgetattr};

use framelock_limited::RunToEnd as _;

use crate::at_terminal::{AtTerminal, CONTROLLING, ENTER, PROGRAM};
use crate::process::{CLEAN, framelock};
use crate::pseudo_terminal::{is_ready, line};

/// Returns a monitor, after it has received a frame. Also returns the line's far end and near end, and the port's name.
fn watching(directory: &Path, arguments: &[&str]) -> (AtTerminal, File, File, String) {
    let (mut far_end, near_end, port) = line();
    let monitor = watching_port(&port, &mut far_end, directory, arguments);
    (monitor, far_end, near_end, port)
}

/// Returns a monitor of this port that has received a frame.
fn watching_port(
    port: &str,
    far_end: &mut File,
    directory: &Path,
    arguments: &[&str],
) -> AtTerminal {
    // With a long hold time, the view does not become SILENT, however slow the computer is.
    let patient = [port, "--hold-after=1000000", "--ramp-after=1000000"];
    let mut monitor = AtTerminal::monitor(&[&patient, arguments].concat(), "", directory);
    monitor.wait_for("pauses");
    far_end.write_all(&CLEAN).unwrap();
    monitor.wait_for("LOCKED");
    monitor
}

#[test]
fn a_port_that_comes_back_is_watched_again_and_no_frame_reaches_across_the_gap() {
    let directory = tempfile::tempdir().unwrap();
    let name = directory.path().join("port");
    let [
        (mut far_end, near_end, port),
        (mut second, second_near_end, second_port),
    ] = [line(), line()];
    symlink(port, &name).unwrap();
    let path = name.to_str().unwrap();
    let mut monitor = watching_port(path, &mut far_end, directory.path(), &[]);
    far_end.write_all(&CLEAN[..4]).unwrap();
    // The program sends only the changed cells to the terminal.
    monitor.wait_for(" frames 1");
    fs::remove_file(&name).unwrap();
    drop((far_end, near_end));
    monitor.wait_for("GONE");
    symlink(second_port, &name).unwrap();
    let is_marked = || {
        let settings = tcgetattr(&second_near_end).unwrap();
        settings.input_modes.contains(InputModes::PARMRK)
    };
    // The port that came back must mark line errors too.
    for _ in 0..600 {
        if is_marked() {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(is_marked());
    monitor.wait_for("SEARCHING");
    second.write_all(&CLEAN[4..]).unwrap();
    second.write_all(&CLEAN).unwrap();
    monitor.wait_for("LOCKED");
    monitor.type_key("q");
    let (behind, code) = monitor.end();
    assert_eq!(code, Some(0), "{behind}");
    for message in [
        "bytes 21, frames 2, bytes discarded 7,",
        "UTC: cannot read ",
        "after byte 11: the serial port is gone",
        "UTC: the port is back",
    ] {
        assert!(behind.contains(message), "{behind}");
    }
}

#[test]
fn the_option_wait_waits_for_a_port_that_does_not_exist_yet() {
    let directory = tempfile::tempdir().unwrap();
    let (mut far_end, _near_end, port) = line();
    let arguments = [
        "port",
        "--wait",
        "--hold-after=1000000",
        "--ramp-after=1000000",
    ];
    let mut monitor = AtTerminal::monitor(&arguments, "", directory.path());
    let before = monitor.wait_for("waiting for port; ");
    assert!(!before.contains(ENTER), "the view comes with the port");
    symlink(port, directory.path().join("port")).unwrap();
    monitor.wait_for("pauses");
    far_end.write_all(&CLEAN).unwrap();
    monitor.wait_for("LOCKED");
    monitor.type_key("q");
    let (behind, code) = monitor.end();
    assert_eq!(code, Some(0), "{behind}");
    assert!(behind.contains("bytes 7, frames 1,"), "{behind}");
}

#[test]
fn every_way_out_leaves_the_terminal_and_the_port_as_they_were() {
    for way in ["q", "\x1b", "\x03", "-TERM", "-INT", "-HUP", "unplugged"] {
        let (mut monitor, far_end, near_end, port) = watching(Path::new("/"), &["--no-reconnect"]);
        let marks_errors = || {
            let settings = tcgetattr(&near_end);
            settings.is_ok_and(|settings| settings.input_modes.contains(InputModes::PARMRK))
        };
        assert!(marks_errors());
        let mut far_end = Some(far_end);
        match way {
            "unplugged" => drop(far_end.take()),
            signal if signal.starts_with('-') => monitor.signal(signal),
            key => monitor.type_key(key),
        }
        let (behind, code) = monitor.end();
        // The program prints the counters when it ends.
        assert!(
            behind.contains("bytes 7, frames 1, bytes discarded 0"),
            "{behind}"
        );
        assert!(!marks_errors());
        let gone = format!("cannot read {port} after byte 7: the serial port is gone");
        assert_eq!(behind.contains(&gone), far_end.is_none(), "{behind}");
        assert_eq!(code, Some(if far_end.is_some() { 0 } else { 2 }), "{way:?}");
    }
}

#[test]
fn a_panic_leaves_the_terminal_as_it_was() {
    let this_program = std::env::current_exe().unwrap();
    let test = [
        "--ignored",
        "--exact",
        "monitor::a_view_that_panics",
        "--nocapture",
    ];
    let command = [&[this_program.to_str().unwrap()], &test[..]].concat();
    let panicking = AtTerminal::start(&CONTROLLING, &command, "", Path::new("/"));
    let (behind, code) = panicking.end();
    assert_eq!(code, Some(101));
    assert!(behind.contains("a panic on purpose"), "{behind}");
}

#[test]
#[ignore = "run at a terminal of its own by the test above"]
fn a_view_that_panics() {
    let mut screen = Screen::take().unwrap();
    screen.draw(|_| ()).unwrap();
    screen
        .draw(|frame| assert!(frame.area().height == 0, "a panic on purpose"))
        .unwrap();
}

#[test]
fn standard_input_may_be_the_stream_and_keys_come_all_the_same() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("capture.bin"), CLEAN.repeat(3)).unwrap();
    let mut monitor = AtTerminal::monitor(&["-"], "< capture.bin", directory.path());
    monitor.wait_for("ENDED");
    monitor.type_key("q");
    let (behind, code) = monitor.end();
    assert_eq!(code, Some(0), "{behind}");
    assert!(
        behind.contains("standard input, bin, framelock: bytes 21, frames 3,"),
        "{behind}"
    );
}

#[test]
fn sent_frames_are_watched_over_a_serial_line() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let mut profile = String::from("pitch,roll,yaw\n");
    for demand in 0..=255 {
        // The bytes include FF followed by 0, which could be mistaken for the mark of a line error.
        writeln!(profile, "{demand},{},65", 255 - demand).unwrap();
    }
    fs::write(directory.join("profile.csv"), &profile).unwrap();

    // A thread connects two lines, as a cable would.
    let (mut from, _near_end, sender_port) = line();
    let (mut to, _other_near_end, monitor_port) = line();
    let cable = std::thread::spawn(move || {
        let mut bytes = [0; 512];
        let mut carried = 0;
        while carried < 7 * 256 {
            assert!(is_ready(&from), "{carried} bytes carried");
            let length = from.read(&mut bytes).unwrap();
            to.write_all(&bytes[..length]).unwrap();
            carried += length;
        }
        (from, to)
    });
    let mut monitor = AtTerminal::monitor(&[&monitor_port], "", directory);
    monitor.wait_for("pauses");
    let mut sender = framelock(&[
        "send",
        &sender_port,
        "--profile=profile.csv",
        "--no-park",
        "--rate=1000",
    ]);
    let sent = sender.current_dir(directory).run_to_end(b"").unwrap();
    assert!(sent.status.success(), "{sent:?}");
    let _ends = cable.join().unwrap();
    // A second after the last byte, the line counts as silent.
    monitor.wait_for("LOCKED");
    monitor.wait_for("SILENT");
    monitor.type_key("q");
    let (behind, code) = monitor.end();
    assert_eq!(code, Some(0), "{behind}");
    let counts = "bytes 1792, frames 256, bytes discarded 0, resynchronisations 0, line errors 0";
    assert!(behind.contains(counts), "{behind}");
}

#[test]
fn an_error_is_reported_before_the_terminal_is_taken_over() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    for case in "\
        - => standard input is the terminal, from which keys are read
        no/such/port => cannot open no/such/port
        - --hold-after=600 => ramp_after is less than hold_after
        /dev/tty => /dev/tty is the terminal that you type at
        - < /dev/null => no terminal to read keys from"
        .lines()
    {
        let (command, message) = case.trim().split_once(" => ").unwrap();
        let (arguments, redirected) = command.split_once(" < ").unwrap_or((command, ""));
        // Keys are read from the controlling terminal, even if standard input is something else.
        let (setsid, redirected) = match redirected {
            "" => (&CONTROLLING[..], String::new()),
            file => (&CONTROLLING[1..], format!("< {file}")),
        };
        let arguments = [PROGRAM, "monitor"].into_iter().chain(arguments.split(' '));
        let arguments: Vec<&str> = arguments.collect();
        let monitor = AtTerminal::start(setsid, &arguments, &redirected, directory);
        let (all, code) = monitor.finish();
        assert_eq!(code, Some(2));
        assert!(all.contains(message) && !all.contains(ENTER), "{all}");
    }
}
