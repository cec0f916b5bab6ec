//! `framelock monitor` at a terminal: a pseudo-terminal whose screen the test reads.
#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

mod pseudo_terminal;

use std::fmt::Write as _;
use std::fs::File;
use std::io::{Read, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;
use framelock_host::screen::Screen;
use pseudo_terminal::{line, terminal};
use rustix::termios::{InputModes, Termios, tcgetattr};

const FRAME: &[u8; 7] = b"AB\0\x7F\xC8\x4A\r";

/// How a terminal is told to show the view, and to show what was there before with its cursor.
const ENTER: &str = "\x1b[?1049h";
const LEAVE: &str = "\x1b[?1049l";
const SHOW_CURSOR: &str = "\x1b[?25h";

/// A program at a terminal of 80 columns and 24 rows.
struct AtTerminal {
    /// What the user sees and types at.
    user: File,
    near_end: File,
    settings: Termios,
    child: Child,
    seen: String,
}

/// What of a terminal's settings a view changes.
fn modes(settings: &Termios) -> String {
    format!(
        "{:?} {:?} {:?} {:?}",
        settings.input_modes, settings.output_modes, settings.local_modes, settings.control_modes
    )
}

impl AtTerminal {
    /// Runs the command with the terminal as its controlling one, and as its standard streams but
    /// for what `redirected` says.
    fn start(program: &Path, arguments: &[&str], redirected: &str, directory: &Path) -> Self {
        let (user, near_end) = terminal(80, 24);
        let settings = tcgetattr(&near_end).unwrap();
        let stream = || Stdio::from(near_end.try_clone().unwrap());
        let child = Command::new("setsid")
            .args(["--ctty", "--wait", "sh", "-c"])
            .arg(format!("exec \"$0\" \"$@\" {redirected}"))
            .arg(program)
            .args(arguments)
            .current_dir(directory)
            .env("TERM", "xterm-256color")
            .stdin(stream())
            .stdout(stream())
            .stderr(stream())
            .spawn()
            .unwrap();
        Self {
            user,
            near_end,
            settings,
            child,
            seen: String::new(),
        }
    }

    fn monitor(arguments: &[&str], directory: &Path) -> Self {
        let arguments = [&["monitor"], arguments].concat();
        Self::start(cargo_bin!("framelock"), &arguments, "", directory)
    }

    /// Reads the screen until the text is there, or for ever.
    fn wait_for(&mut self, text: &str) {
        while !self.seen.contains(text) {
            let mut bytes = [0; 4096];
            let length = self.user.read(&mut bytes).unwrap();
            assert_ne!(length, 0);
            self.seen += &String::from_utf8_lossy(&bytes[..length]);
        }
        self.seen.clear();
    }

    fn type_key(&mut self, key: &str) {
        self.user.write_all(key.as_bytes()).unwrap();
    }

    /// Waits for the end: the terminal must be as before. Gives what stands on it, and the exit
    /// code.
    fn end(mut self) -> (String, Option<i32>) {
        let status = self.child.wait().unwrap();
        assert_eq!(
            modes(&tcgetattr(&self.near_end).unwrap()),
            modes(&self.settings)
        );
        // Marks the end of what was written.
        self.near_end_writes("END");
        let mut rest = std::mem::take(&mut self.seen);
        while !rest.ends_with("END") {
            let mut bytes = [0; 4096];
            let length = self.user.read(&mut bytes).unwrap();
            rest += &String::from_utf8_lossy(&bytes[..length]);
        }
        let (view, behind) = rest.rsplit_once(LEAVE).expect("the view is left");
        assert!(!behind.contains(ENTER));
        assert!(view.contains(SHOW_CURSOR) || behind.contains(SHOW_CURSOR));
        (behind.to_owned(), status.code())
    }

    fn near_end_writes(&mut self, text: &str) {
        self.near_end.write_all(text.as_bytes()).unwrap();
    }

    /// The process id of the program itself: `setsid --wait` forks if it leads a group.
    fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let children = format!("/proc/{id}/task/{id}/children");
        let children = std::fs::read_to_string(children).unwrap_or_default();
        let program = children.split_whitespace().next().unwrap_or(&id).to_owned();
        let kill = Command::new("kill")
            .args([name, &program])
            .status()
            .unwrap();
        assert!(kill.success());
    }
}

fn nowhere() -> &'static Path {
    Path::new("/")
}

/// The lock is not lost to silence, however long a busy computer takes.
const PATIENT: [&str; 2] = ["--hold-after=1000000", "--ramp-after=1000000"];

#[test]
fn every_way_out_leaves_the_terminal_and_the_port_as_they_were() {
    for way in ["q", "\x1b", "\x03", "-TERM", "-INT", "-HUP"] {
        let (mut far_end, near_end, port) = line();
        let marks_errors = || {
            let settings = tcgetattr(&near_end).unwrap();
            settings.input_modes.contains(InputModes::PARMRK)
        };
        let mut monitor =
            AtTerminal::monitor(&[&[port.as_str()], &PATIENT[..]].concat(), nowhere());
        monitor.wait_for("help");
        assert!(marks_errors());
        far_end.write_all(FRAME).unwrap();
        monitor.wait_for("LOCKED");
        if way.starts_with('-') {
            monitor.signal(way);
        } else {
            monitor.type_key(way);
        }
        let (behind, code) = monitor.end();
        assert_eq!(code, Some(0), "{way:?}: {behind}");
        assert!(
            behind.contains("bytes 7, frames 1, bytes discarded 0"),
            "{behind}"
        );
        assert!(!marks_errors());
    }
}

#[test]
fn a_port_that_is_unplugged_ends_it_with_the_reason() {
    let (mut far_end, _near_end, port) = line();
    let mut monitor = AtTerminal::monitor(&[&[port.as_str()], &PATIENT[..]].concat(), nowhere());
    monitor.wait_for("help");
    far_end.write_all(FRAME).unwrap();
    monitor.wait_for("LOCKED");
    drop(far_end);
    let (behind, code) = monitor.end();
    assert_eq!(code, Some(2));
    let told = format!("cannot read {port} behind byte 7: the serial port is gone");
    assert!(behind.contains(&told), "{behind}");
    // What was seen until then is not lost.
    assert!(behind.contains("bytes 7, frames 1,"), "{behind}");
}

#[test]
fn a_panic_leaves_the_terminal_as_it_was() {
    let this_program = std::env::current_exe().unwrap();
    let arguments = ["--ignored", "--exact", "a_view_that_panics", "--nocapture"];
    let panicking = AtTerminal::start(&this_program, &arguments, "", nowhere());
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
    std::fs::write(directory.path().join("capture.bin"), FRAME.repeat(3)).unwrap();
    let arguments = ["monitor", "-"];
    let program = cargo_bin!("framelock");
    let mut monitor = AtTerminal::start(program, &arguments, "< capture.bin", directory.path());
    monitor.wait_for("ENDED");
    monitor.type_key("q");
    let (behind, code) = monitor.end();
    assert_eq!(code, Some(0), "{behind}");
    assert!(
        behind.contains("standard input, bin, rescan: bytes 21, frames 3,"),
        "{behind}"
    );
}

/// Waits until the file is as long, or for ever.
fn wait_for_length(path: &Path, length: u64) {
    while std::fs::metadata(path).map_or(0, |data| data.len()) < length {
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// What `framelock` writes to standard output; it must succeed.
fn framelock(arguments: &[&str], directory: &Path) -> String {
    let mut command = Command::new(cargo_bin!("framelock"));
    let output = command
        .args(arguments)
        .current_dir(directory)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn what_is_sent_over_a_serial_line_is_watched_and_recorded() {
    let directory = tempfile::tempdir().unwrap();
    let mut profile = String::from("pitch,roll,yaw\n");
    for demand in 0..=255 {
        // FF and 0 next to each other among them, which are marks of line errors to some.
        writeln!(profile, "{demand},{},65", 255 - demand).unwrap();
    }
    std::fs::write(directory.path().join("profile.csv"), &profile).unwrap();

    // Two lines, and a cable between them.
    let (mut from, _near_end, sender_port) = line();
    let (mut to, _other_near_end, monitor_port) = line();
    let cable = std::thread::spawn(move || {
        let mut bytes = [0; 512];
        let mut carried = 0;
        while carried < 7 * 256 {
            let length = from.read(&mut bytes).unwrap();
            to.write_all(&bytes[..length]).unwrap();
            carried += length;
        }
        (from, to)
    });
    let arguments = [monitor_port.as_str(), "--record=capture.bin"];
    let mut monitor = AtTerminal::monitor(&arguments, directory.path());
    monitor.wait_for("help");
    let send = ["send", &sender_port, "--profile=profile.csv"];
    framelock(
        &[&send[..], &["--no-park", "--rate=1000"]].concat(),
        directory.path(),
    );
    let capture = directory.path().join("capture.bin");
    wait_for_length(&capture, 7 * 256);
    monitor.type_key("q");
    let (behind, code) = monitor.end();
    assert_eq!(code, Some(0), "{behind}");
    for told in [
        "bytes 1792, frames 256, bytes discarded 0, resynchronisations 0, line errors 0",
        "1792 bytes recorded in capture.bin",
    ] {
        assert!(behind.contains(told), "{behind}");
    }
    cable.join().unwrap();

    let decoded = framelock(&["decode", "capture.bin", "--format=csv"], directory.path());
    let setpoints = decoded.lines().map(|row| row.split_once(',').unwrap().1);
    assert!(setpoints.eq(profile.lines()), "{decoded}");
    let traced = framelock(
        &["trace", "capture.bin", "--policy=rescan"],
        directory.path(),
    );
    assert!(traced.contains("rescan:  1792 bytes = 7 x 256 committed + 0 discarded"));
}

#[test]
fn a_key_begins_a_recording_and_ends_it() {
    let directory = tempfile::tempdir().unwrap();
    let (mut far_end, _near_end, port) = line();
    let mut monitor =
        AtTerminal::monitor(&[&[port.as_str()], &PATIENT[..]].concat(), directory.path());
    monitor.wait_for("help");
    far_end.write_all(FRAME).unwrap();
    monitor.wait_for("LOCKED");
    monitor.type_key("r");
    monitor.wait_for("framelock-1.bin");
    far_end.write_all(b"AB\0\x01\x02\x03\r").unwrap();
    let file = directory.path().join("framelock-1.bin");
    wait_for_length(&file, 7);
    monitor.type_key("rq");
    let (behind, code) = monitor.end();
    assert_eq!(code, Some(0), "{behind}");
    assert!(
        behind.contains("7 bytes recorded in framelock-1.bin"),
        "{behind}"
    );
    let decoded = framelock(
        &["decode", "framelock-1.bin", "--format=csv"],
        directory.path(),
    );
    assert_eq!(decoded, "offset,pitch,roll,yaw\n6,1,2,3\n");
}

#[test]
fn without_a_terminal_it_says_what_to_use_instead() {
    let output = Command::new(cargo_bin!("framelock"))
        .args(["monitor", "/dev/ttyACM0"])
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(
        told.contains("`framelock decode /dev/ttyACM0 --format text` writes lines"),
        "{told}"
    );
}

/// What it complains of on the terminal, which it must not have taken over.
fn complaint(arguments: &[&str], options_of_setsid: &[&str], input: Option<&str>) -> String {
    let (mut user, near_end) = terminal(80, 24);
    let stream = || Stdio::from(near_end.try_clone().unwrap());
    let mut child = Command::new("setsid")
        .args(options_of_setsid)
        .arg(cargo_bin!("framelock"))
        .arg("monitor")
        .args(arguments)
        .env("TERM", "xterm-256color")
        .stdin(input.map_or_else(stream, |path| File::open(path).unwrap().into()))
        .stdout(stream())
        .stderr(stream())
        .spawn()
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(2));
    // All of it, in however many pieces: Linux ends it with an error, once nobody has the near end.
    drop(near_end);
    let mut complaint = Vec::new();
    let _ = user.read_to_end(&mut complaint);
    let complaint = String::from_utf8(complaint).unwrap();
    assert!(!complaint.contains(ENTER), "{complaint}");
    complaint
}

#[test]
fn what_cannot_be_watched_is_told_before_the_terminal_is_taken_over() {
    let ctty = ["--ctty", "--wait"];
    let typed = complaint(&["-"], &ctty, None);
    assert!(
        typed.contains("the terminal that keys are typed at"),
        "{typed}"
    );
    let no_keys = complaint(&["-"], &["--wait"], Some("/dev/null"));
    assert!(
        no_keys.contains("no terminal to read keys from"),
        "{no_keys}"
    );
    let nothing = complaint(&["no/such/port"], &ctty, None);
    assert!(nothing.contains("cannot open no/such/port"), "{nothing}");
    let times = complaint(&["-", "--hold-after=600"], &ctty, None);
    assert!(
        times.contains("ramp_after is less than hold_after"),
        "{times}"
    );
    let directory = tempfile::tempdir().unwrap();
    let taken = directory.path().join("taken.bin");
    std::fs::write(&taken, "precious").unwrap();
    let (_far_end, _near_end, port) = line();
    let record = complaint(&[&port, "--record", taken.to_str().unwrap()], &ctty, None);
    assert!(
        record.contains("taken.bin: a new file is wanted"),
        "{record}"
    );
    assert_eq!(std::fs::read_to_string(taken).unwrap(), "precious");
}

#[test]
fn help_has_examples() {
    let help = framelock(&["monitor", "--help"], nowhere());
    assert!(help.contains("Examples:\n  framelock monitor "));
    assert!(help.contains("--idle-gap"));
}
