#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

use super::super::watch::tests::{FRAME, ms, watch_frames};
use super::*;

pub(in super::super) fn session(frame: &str, with_marks: bool) -> MonitorSession {
    let title = format!("/dev/ttyACM0, 115200 baud, {frame}, framelock");
    let mut session = MonitorSession::new(title, watch_frames(frame, None));
    session.marks = with_marks.then(|| Marks::new(false));
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
    let mut session = session("bin", false);
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
        assert_eq!(session.displayed().line.counters().frames, 1);
    }
    assert!(session.press('z'));
    assert_eq!(session.displayed().line.counters().frames, 0);
}

#[test]
fn a_paused_view_stands_still_while_the_line_is_counted() {
    let mut session = session("bin", false);
    session.receive(ms(10), FRAME);
    session.advance_to(ms(20));
    let frames_and_time = |session: &MonitorSession| {
        let watch = session.displayed();
        (watch.line.counters().frames, watch.now.at)
    };
    assert_eq!(frames_and_time(&session), (1, ms(20)));
    session.press(' ');
    session.receive(ms(30), FRAME);
    session.advance_to(ms(40));
    assert!(session.is_paused());
    assert_eq!(frames_and_time(&session), (1, ms(20)));
    session.press(' ');
    assert_eq!(frames_and_time(&session), (2, ms(40)));
}

#[test]
fn marks_are_line_errors_and_not_data() {
    let mut session = session("bin", true);
    // The bytes are a frame in which FF is doubled, then a byte with an error, then a break. The bytes arrive in two
    // pieces, which are cut within the doubled FF.
    session.receive(ms(1), b"AB\0\xFF\xFF\xFF");
    session.receive(ms(2), b"\xFF\0\rAB\0\xFF\0?\x10\xFF\0\0");
    session.receive(ms(3), FRAME);
    let counters = *session.displayed().line.counters();
    assert_eq!((counters.frames, counters.bytes), (2, 18));
    assert_eq!(
        (counters.events.framing, counters.events.line_break),
        (1, 1)
    );
}

#[test]
fn the_end_prints_the_counters() {
    let mut session = session("bin", false);
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
