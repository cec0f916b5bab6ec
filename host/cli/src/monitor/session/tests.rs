#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use super::super::watch::tests::{FRAME, ms, watch_frames};
use framelock_receiving::Protocol;

use super::*;

pub(in super::super) fn session(directory: &Path, with_marks: bool) -> MonitorSession {
    session_of("bin", directory, with_marks)
}

pub(in super::super) fn session_of(
    frame: &str,
    directory: &Path,
    with_marks: bool,
) -> MonitorSession {
    let title = format!("/dev/ttyACM0, 115200 baud, {frame}, framelock");
    let mut session = MonitorSession::new(title, watch_frames(frame, None), None);
    session.marks = with_marks.then(|| Marks::new(false));
    session.directory = directory.to_owned();
    session
}

impl MonitorSession {
    /// Presses a key without Ctrl. Returns false if the key quits.
    pub(in super::super) fn press(&mut self, key: char) -> bool {
        self.key(KeyCode::Char(key).into())
    }
}

#[test]
fn keys_mean_what_the_view_says() {
    let mut session = session(Path::new(""), false);
    let control = |c| KeyEvent::new(KeyCode::Char(c), KeyModifiers::CONTROL);
    for quit in [KeyCode::Char('q').into(), KeyCode::Esc.into(), control('c')] {
        // Quitting first closes the help.
        assert!(session.press('?') && session.has_help);
        assert!(session.key(quit) && !session.has_help);
        assert!(!session.key(quit));
    }
    session.receive(ms(1), FRAME);
    for nothing in [KeyCode::Char('x').into(), control('z')] {
        assert!(session.key(nothing));
        assert_eq!(session.shown().line.counters().frames, 1);
    }
    assert!(session.press('z'));
    assert_eq!(session.shown().line.counters().frames, 0);
}

#[test]
fn a_paused_view_stands_still_while_the_line_is_counted_and_recorded() {
    let directory = tempfile::tempdir().unwrap();
    let mut session = session(directory.path(), false);
    session.receive(ms(10), FRAME);
    session.advance_to(ms(20));
    assert_eq!(session.shown().line.counters().frames, 1);
    session.press(' ');
    session.press('r');
    session.receive(ms(30), FRAME);
    session.advance_to(ms(40));
    assert!(session.is_paused());
    let shown = session.shown();
    assert_eq!((shown.line.counters().frames, shown.now.at), (1, ms(20)));
    session.press(' ');
    let shown = session.shown();
    assert_eq!((shown.line.counters().frames, shown.now.at), (2, ms(40)));
    let file = directory.path().join("framelock-1.bin");
    assert_eq!(std::fs::read(file).unwrap(), FRAME);
}

#[test]
fn a_recording_contains_the_bytes_between_two_keys_and_replaces_no_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    std::fs::write(path("framelock-1.bin"), "precious").unwrap();
    assert!(
        Recording::begin(
            path("framelock-1.bin"),
            &FrameWriter::new(Protocol::named("bin").unwrap())
        )
        .is_err()
    );
    let mut session = session(directory.path(), false);
    session.receive(ms(1), b"before");
    session.press('r');
    session.receive(ms(2), b"\xFF\xFFduring\0");
    assert_eq!(session.recording.as_ref().unwrap().bytes, 9);
    session.press('r');
    session.receive(ms(3), b"behind");
    assert!(session.recording.is_none());
    session.press('r');
    assert_eq!(std::fs::read(path("framelock-1.bin")).unwrap(), b"precious");
    assert_eq!(
        std::fs::read(path("framelock-2.bin")).unwrap(),
        b"\xFF\xFFduring\0"
    );
    let told = session.finish();
    let names = ["framelock-2.bin", "framelock-3.bin"].map(|name| path(name).display().to_string());
    let [second, third] = names;
    assert_eq!(told[1], format!("9 bytes recorded in {second}"));
    assert_eq!(told[2], format!("0 bytes recorded in {third}"));
}

#[test]
fn a_recording_of_frames_has_their_times() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("moves.csv");
    let mut session = session(directory.path(), false);
    session.recording = Recording::begin(path.clone(), &session.watch.frame).ok();
    session.receive(ms(20), b"??");
    session.receive(ms(40), FRAME);
    session.receive(ms(60), &FRAME[..4]);
    session.receive(ms(1_500), &[&FRAME[4..], FRAME].concat());
    session.finish();
    assert_eq!(
        std::fs::read_to_string(path).unwrap(),
        "time,offset,pitch,roll,yaw\n0.040000,8,16,32,48\n1.500000,15,16,32,48\n\
         1.500000,22,16,32,48\n"
    );
}

#[test]
fn marks_are_line_errors_and_not_data() {
    let directory = tempfile::tempdir().unwrap();
    let mut session = session(directory.path(), true);
    session.press('r');
    // The bytes are a frame in which FF is doubled, then a byte with an error, then a break. The bytes arrive in two
    // pieces, which are cut within the doubled FF.
    session.receive(ms(1), b"AB\0\xFF\xFF\xFF");
    session.receive(ms(2), b"\xFF\0\rAB\0\xFF\0?\x10\xFF\0\0");
    session.receive(ms(3), FRAME);
    let counters = *session.shown().line.counters();
    assert_eq!((counters.frames, counters.bytes), (2, 18));
    assert_eq!(
        (counters.events.framing, counters.events.line_break),
        (1, 1)
    );
    session.finish();
    let recorded = std::fs::read(directory.path().join("framelock-1.bin")).unwrap();
    assert_eq!(recorded, b"AB\0\xFF\xFF\0\rAB\0\x10AB\0\x10\x20\x30\r");
}

#[test]
#[cfg(target_os = "linux")]
fn a_failed_recording_is_reported_and_watching_goes_on() {
    for (is_full, told) in [
        (false, "cannot record in no/such/directory"),
        (true, "recording in /dev/full ended after byte 7"),
    ] {
        let mut session = session(Path::new("no/such/directory"), false);
        if is_full {
            let file = File::options().write(true).open("/dev/full").unwrap();
            session.recording = Some(Recording {
                path: "/dev/full".into(),
                bytes: 0,
                has_frames: false,
                file: BufWriter::new(file),
            });
        } else {
            session.press('r');
        }
        session.receive(ms(1), FRAME);
        session.advance_to(ms(2));
        session.receive(ms(3), FRAME);
        assert_eq!(session.shown().line.counters().frames, 2);
        assert!(session.recording.is_none());
        assert!(session.finish()[1].starts_with(told));
    }
}

#[test]
fn the_end_prints_the_counters() {
    let mut session = session(Path::new(""), false);
    session.receive(ms(1), b"??");
    session.receive(ms(1), FRAME);
    assert_eq!(
        session.finish(),
        [
            "/dev/ttyACM0, 115200 baud, bin, framelock: bytes 9, frames 1, bytes discarded 2, \
             resynchronisations 1, line errors 0"
        ]
    );
}
