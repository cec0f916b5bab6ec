#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::path::Path;

use framelock::{Bin, Receiver};

use super::super::watch::tests::PARAMETERS;
use super::*;

const FRAME: &[u8; 7] = b"AB\0\x10\x20\x30\r";

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

pub(in super::super) fn session(directory: &Path, with_marks: bool) -> Session<Receiver<Bin>> {
    let watch = Watch::new(PARAMETERS, None).unwrap();
    let title = "/dev/ttyACM0, 115200 baud, bin, rescan".to_owned();
    Session::new(title, watch, with_marks, None, directory.to_owned())
}

#[test]
fn keys_mean_what_the_view_says() {
    let plain = |code| meaning(KeyEvent::new(code, KeyModifiers::NONE));
    for (code, key) in [
        (KeyCode::Char('q'), Key::Quit),
        (KeyCode::Esc, Key::Quit),
        (KeyCode::Char('?'), Key::Help),
        (KeyCode::Char(' '), Key::Pause),
        (KeyCode::Char('r'), Key::Record),
        (KeyCode::Char('z'), Key::Reset),
    ] {
        assert_eq!(plain(code), Some(key));
    }
    let control = |c| meaning(KeyEvent::new(KeyCode::Char(c), KeyModifiers::CONTROL));
    assert_eq!(control('c'), Some(Key::Quit));
    assert_eq!(control('z'), None);
    assert_eq!(plain(KeyCode::Char('x')), None);
}

#[test]
fn quitting_first_closes_the_help() {
    let mut session = session(Path::new(""), false);
    assert!(session.key(Key::Help));
    assert!(session.shown().has_help);
    assert!(session.key(Key::Quit));
    assert!(!session.shown().has_help);
    assert!(!session.key(Key::Quit));
}

#[test]
fn a_paused_view_stands_still_while_the_line_is_counted_and_recorded() {
    let directory = tempfile::tempdir().unwrap();
    let mut session = session(directory.path(), false);
    session.receive(ms(10), FRAME);
    session.advance_to(ms(20));
    let before = session.shown().clone();
    session.key(Key::Pause);
    session.key(Key::Record);
    session.receive(ms(30), FRAME);
    session.advance_to(ms(40));
    let paused = session.shown();
    assert!(paused.is_paused);
    assert_eq!(paused.report, before.report);
    session.key(Key::Pause);
    let shown = session.shown();
    assert_eq!(shown.report.counters.frames, 2);
    assert_eq!(shown.report.now, ms(40));
    let file = directory.path().join("framelock-1.bin");
    assert_eq!(std::fs::read(file).unwrap(), FRAME);
}

#[test]
fn a_recording_holds_what_came_between_the_two_keys() {
    let directory = tempfile::tempdir().unwrap();
    let mut session = session(directory.path(), false);
    session.receive(ms(1), b"before");
    session.key(Key::Record);
    session.receive(ms(2), b"\xFF\xFFduring\0");
    let name = directory.path().join("framelock-1.bin");
    let on = RecordingState::On {
        name: name.display().to_string(),
        bytes: 9,
    };
    assert_eq!(session.shown().recording, on);
    session.key(Key::Record);
    session.receive(ms(3), b"behind");
    assert_eq!(session.shown().recording, RecordingState::Off);
    assert_eq!(std::fs::read(&name).unwrap(), b"\xFF\xFFduring\0");
    let told = session.finish();
    assert_eq!(told[1], format!("9 bytes recorded in {}", name.display()));
}

#[test]
fn marks_are_line_errors_and_not_data() {
    let directory = tempfile::tempdir().unwrap();
    let mut session = session(directory.path(), true);
    session.key(Key::Record);
    // A frame with FF doubled, cut within a mark; then a byte that came with an error, and a break.
    session.receive(ms(1), b"AB\0\xFF\xFF\xFF");
    session.receive(ms(2), b"\xFF\0\rAB\0\xFF\0?\x10\xFF\0\0");
    session.receive(ms(3), FRAME);
    let counters = session.shown().report.counters;
    assert_eq!((counters.frames, counters.bytes), (2, 18));
    let events = counters.events;
    assert_eq!((events.framing, events.line_break), (1, 1));
    session.finish();
    let recorded = std::fs::read(directory.path().join("framelock-1.bin")).unwrap();
    assert_eq!(recorded, b"AB\0\xFF\xFF\0\rAB\0\x10AB\0\x10\x20\x30\r");
}

#[test]
fn a_recording_that_cannot_be_is_told_and_the_line_is_watched_all_the_same() {
    let mut session = session(Path::new("no/such/directory"), false);
    session.key(Key::Record);
    session.receive(ms(1), FRAME);
    let shown = session.shown();
    assert_eq!(shown.report.counters.frames, 1);
    let RecordingState::Failed(problem) = &shown.recording else {
        panic!("{:?}", shown.recording);
    };
    assert!(problem.contains("no/such/directory"), "{problem}");
    assert!(session.finish()[1].contains("no/such/directory"));
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_ends_the_recording_only() {
    let mut session = session(Path::new(""), false);
    session.recording = Some(Recording::full());
    session.receive(ms(1), FRAME);
    session.advance_to(ms(2));
    session.receive(ms(3), FRAME);
    let shown = session.shown();
    assert_eq!(shown.report.counters.frames, 2);
    let RecordingState::Failed(problem) = &shown.recording else {
        panic!("{:?}", shown.recording);
    };
    assert!(
        problem.contains("/dev/full ended behind byte 7"),
        "{problem}"
    );
}

#[test]
fn the_end_tells_what_was_counted() {
    let mut session = session(Path::new(""), false);
    session.receive(ms(1), b"??");
    session.receive(ms(1), FRAME);
    assert_eq!(
        session.finish(),
        [
            "/dev/ttyACM0, 115200 baud, bin, rescan: bytes 9, frames 1, bytes discarded 2, \
             resynchronisations 1, line errors 0"
        ]
    );
}
