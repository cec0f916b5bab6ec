#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use super::super::session::MonitorSession;
use super::super::session::tests::session;
use super::super::watch::tests::{FRAME, ms};
use super::*;
use crate::view_parts;

/// Receives three seconds of a motion at 50 frames per second, then three bytes of noise and the first
/// four bytes of a frame.
fn watched(with_marks: bool) -> MonitorSession {
    let mut session = session("bin", with_marks);
    for frame in 0..150_u8 {
        let bytes = [b'A', b'B', 0, frame, 0x40, 0xC0, b'\r'];
        session.receive(ms(10 + 20 * u64::from(frame)), &bytes);
    }
    session.receive(ms(3_000), b"A\x7F?AB\0\x01");
    session.advance_to(ms(3_010));
    session
}

/// Returns the rows of the screen as text.
fn screen(session: &mut MonitorSession, width: u16, height: u16) -> Vec<String> {
    view_parts::tests::screen(width, height, |frame| draw(frame, session))
}

/// Checks the rows of the screen. Each line of `expected` has the number of a row and a text that the row must contain.
fn shows(session: &mut MonitorSession, width: u16, expected: &str) {
    let rows = screen(session, width, 24);
    for line in expected.lines().filter(|line| !line.trim().is_empty()) {
        let (row, text) = line.trim().split_once(": ").unwrap();
        let row = &rows[row.parse::<usize>().unwrap()];
        assert!(row.contains(text), "{text}: {row}");
    }
}

#[test]
fn the_screen_shows_the_watched_line() {
    let expected = [
        " framelock monitor  /dev/ttyACM0, 115200 baud, bin, framelock                   ",
        " SEARCHING   50.0 frames/s      350 bytes/s   last frame 0.0 s ago              ",
        "┌ setpoint ────────────────────────────┐┌ counters ────────────────────────────┐",
        "│pitch ███████████┃         149 out 149││bytes 1057  frames 150                │",
        "│roll  ████┃                 64 out  64││discarded 3                           │",
        "│yaw   ██████████████┃      192 out 192││  no sync 2  broken sync 1            │",
        "│state    A  B  1  2 [3] 4  CR         ││  terminator 0  checksum 0  line 0    │",
        "│failsafe LIVE                         ││resynchronised 0  idle gaps 0         │",
        "│                                      ││line errors: framing 0     break 0    │",
        "│                                      ││                                      │",
        "└──────────────────────────────────────┘└──────────────────────────────────────┘",
        "┌ last discarded bytes; | marks a frame in between ────────────────────────────┐",
        "│|41 7F 3F                                                                     │",
        "│                                                                              │",
        "│                                                                              │",
        "│                                                                              │",
        "│                                                                              │",
        "│                                                                              │",
        "│                                                                              │",
        "│                                                                              │",
        "│                                                                              │",
        "│                                                                              │",
        "└──────────────────────────────────────────────────────────────────────────────┘",
        " q quits, space pauses, z counts from zero, ? help                              ",
    ];
    assert_eq!(screen(&mut watched(true), 80, 24), expected);
}

/// Makes a frame with sixteen channels of 992.
const SBUS: [u8; 25] = [
    0x0F, 0xE0, 0x03, 0x1F, 0xF8, 0xC0, 0x07, 0x3E, 0xF0, 0x81, 0x0F, 0x7C, 0xE0, 0x03, 0x1F, 0xF8,
    0xC0, 0x07, 0x3E, 0xF0, 0x81, 0x0F, 0x7C, 0x08, 0x00,
];

#[test]
fn described_frames_are_shown_with_their_fields() {
    let mut session = session("sbus", true);
    for frame in 0..200 {
        session.receive(ms(10 + 14 * frame), &SBUS);
    }
    session.receive(
        ms(3_000),
        &[&b"?"[..], &SBUS[..7], b"\xFF\0?", &SBUS[..3]].concat(),
    );
    session.advance_to(ms(3_010));
    let expected = "
        0: 115200 baud, sbus, framelock
        1: SEARCHING
        2: ┌ last frame ──
        3: │length 25                             ││bytes 5011  frames 200
        4: │pending 3                             ││discarded 8
        5: │channel 992 992 992 992 992 992 992   ││  no sync 7  broken sync 0
        6: │992 992 992 992 992 992 992 992 992   ││  bad header 0
        10: │failsafe   1                          ││
        20: │|3F 0F E0 03 1F F8 C0 07 ";
    shows(&mut session, 80, expected);
}

#[test]
fn events_of_the_line_are_shown() {
    let mut with_errors = watched(true);
    with_errors.receive(ms(3_020), b"\xFF\0\x55\xFF\0\0\xFF\0\0");
    // The bytes that were pending are now discarded too.
    let errors = "
        8: line errors: framing 1     break 2
        6: line 4
        12: │|41 7F 3F 41 42 00 01  ";
    shows(&mut with_errors, 80, errors);
    let mut nothing = session("bin", false);
    let nothing_yet = "
        1: no frame yet
        3: -- out 128│
        6: state   [A] B
        7: failsafe PARKED: no frames
        8: this input reports none";
    shows(&mut nothing, 80, nothing_yet);
    let mut silent = watched(false);
    silent.advance_to(ms(10_000));
    let silence = "
        1: SILENT
        1: 0.0 frames/s
        1: last frame 7.0 s ago
        3: 149 out 128│
        7: │failsafe PARKED: no frames";
    shows(&mut silent, 80, silence);
    // If there is little room, the newest discarded bytes are shown.
    nothing.receive(ms(1), &[b'?'; 130]);
    nothing.receive(ms(2), b"1234");
    shows(&mut nothing, 40, "12: │ 3F 3F\n21: 3F 31 32 33 34");
}

#[test]
fn the_view_says_why_the_platform_does_not_follow() {
    // A sender of five frames per second.
    let mut slow = session("bin", false);
    for frame in 0..20 {
        slow.receive(ms(10 + 200 * frame), FRAME);
    }
    slow.advance_to(ms(4_000));
    let apart = "
        1: LOCKED       5.0 frames/s
        7: │failsafe PARKED: frames arrive too far│
        8: │apart (fewer than 10 a second)        │";
    shows(&mut slow, 80, apart);
    // The sender becomes fast.
    for frame in 0..30 {
        slow.receive(ms(4_010 + 20 * frame), FRAME);
    }
    let approach = "
        7: │failsafe APPROACH: moves slowly to the│
        8: │setpoint                              │";
    shows(&mut slow, 80, approach);
    for frame in 30..100 {
        slow.receive(ms(4_010 + 20 * frame), FRAME);
    }
    shows(&mut slow, 80, "7: │failsafe LIVE   ");
}

#[test]
fn keys_change_what_is_shown() {
    let mut session = watched(false);
    session.press(' ');
    shows(&mut session, 30, "0: PAUSED");
    shows(&mut session, 80, "0: PAUSED\n23: space resumes");
    session.press(' ');
    session.press('z');
    shows(&mut session, 80, "3: bytes 4  frames 0  ");
    let discarded = format!("12: │{:78}│", "");
    shows(&mut session, 80, &discarded);
    session.press('?');
    shows(
        &mut session,
        80,
        "6: z             set the counters to zero",
    );
    session.has_ended = true;
    shows(&mut session, 80, "0: THE INPUT HAS ENDED");
}

#[test]
fn a_low_terminal_omits_the_discarded_bytes() {
    let has = |height, text| {
        let rows = screen(&mut watched(false), 80, height);
        rows.iter().any(|row| row.contains(text))
    };
    for (height, discarded) in [(24, true), (16, true), (15, false)] {
        assert_eq!(has(height, "last discarded bytes"), discarded, "{height}");
        assert!(has(height, "resynchronised 0"), "{height}");
    }
}

#[test]
fn the_view_can_be_drawn_at_any_size_and_time() {
    for (width, height) in [(1, 1), (10, 3), (40, 12), (79, 23), (300, 100)] {
        screen(&mut session("bin", false), width, height);
        let mut watched = watched(true);
        watched.press('?');
        screen(&mut watched, width, height);
    }
}
