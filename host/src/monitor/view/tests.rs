#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::path::Path;
use std::time::Duration;

use framelock::{Bin, Receiver};
use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::super::session::tests::session;
use super::super::session::{Key, Session};
use super::*;

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

/// Three seconds of a motion at 50 frames a second, then three bytes of noise and four of a frame.
fn watched(with_marks: bool) -> Session<Receiver<Bin>> {
    let mut session = session(Path::new("no/such/directory"), with_marks);
    for frame in 0..150_u8 {
        let bytes = [b'A', b'B', 0, frame, 0x40, 0xC0, b'\r'];
        session.receive(ms(10 + 20 * u64::from(frame)), &bytes);
    }
    session.receive(ms(3_000), b"A\x7F?AB\0\x01");
    session.advance_to(ms(3_010));
    session
}

/// The screen as text, row by row.
fn screen(session: &mut Session<Receiver<Bin>>, width: u16, height: u16) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    let shown = session.shown();
    terminal.draw(|frame| draw(frame, shown)).unwrap();
    let buffer = terminal.backend().buffer();
    let cells = buffer.content().chunks(usize::from(width).max(1));
    cells
        .map(|row| row.iter().map(ratatui::buffer::Cell::symbol).collect())
        .collect()
}

#[test]
fn the_screen_is_what_was_watched() {
    let expected = [
        " framelock monitor  /dev/ttyACM0, 115200 baud, bin, rescan                      ",
        " SEARCHING   50.0 frames/s      350 bytes/s   last frame 0.0 s ago              ",
        "┌ setpoint ────────────────────────────┐┌ counters ────────────────────────────┐",
        "│pitch ████████████┃          95 out 95││bytes 1057  frames 150                │",
        "│roll  █████┃                 40 out 40││discarded 3                           │",
        "│yaw   ███████████████┃▌      C0 out C0││  no sync 2  broken sync 1            │",
        "│failsafe LIVE                         ││  terminator 0  check 0  line 0       │",
        "│state    A  B  1  2 [3] 4  CR         ││resynchronised 0  idle gaps 0         │",
        "│                                      ││line errors: framing 0     break 0    │",
        "│                                      ││not recorded                          │",
        "└──────────────────────────────────────┘└──────────────────────────────────────┘",
        "┌ the last ten seconds: pitch roll yaw ────────────────────────────────────────┐",
        "│FF│                                                                           │",
        "│  │⠠⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤                                                    │",
        "│  │                   ⢀⣀⠤⠤                                                    │",
        "│80│            ⢀⣀⣀⠤⠔⠒⠉⠁                                                       │",
        "│  │⠐⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒⠒                                                    │",
        "│00│⢀⡠⠤⠒⠊⠉                                                                     │",
        "└──────────────────────────────────────────────────────────────────────────────┘",
        "┌ bytes discarded last, | where a frame was between ───────────────────────────┐",
        "│|41 7F 3F                                                                     │",
        "│                                                                              │",
        "└──────────────────────────────────────────────────────────────────────────────┘",
        " q quits, space pauses, r records, z counts from zero, ? help                   ",
    ];
    assert_eq!(screen(&mut watched(true), 80, 24), expected);
}

#[test]
fn line_errors_are_shown_if_the_input_reports_any() {
    let mut session = watched(true);
    session.receive(ms(3_020), b"\xFF\0\x55\xFF\0\0\xFF\0\0");
    session.advance_to(ms(3_020));
    let rows = screen(&mut session, 80, 24);
    assert!(
        rows[8].contains("line errors: framing 1     break 2 "),
        "{}",
        rows[8]
    );
    assert!(rows[6].contains("line 4 "), "{}", rows[6]);
    // Those that were held are discarded bytes too.
    assert!(
        rows[20].starts_with("│|41 7F 3F 41 42 00 01 "),
        "{}",
        rows[20]
    );
    let rows = screen(&mut watched(false), 80, 24);
    assert!(rows[8].contains("this input reports none"), "{}", rows[8]);
}

#[test]
fn silence_is_shown_and_what_the_failsafe_makes_of_it() {
    let mut session = watched(false);
    session.advance_to(ms(10_000));
    let rows = screen(&mut session, 80, 24);
    assert!(rows[1].starts_with(" SILENT"), "{}", rows[1]);
    assert!(rows[1].contains(" 0.0 frames/s "), "{}", rows[1]);
    assert!(rows[1].contains("last frame 7.0 s ago"), "{}", rows[1]);
    assert!(rows[3].contains(" 95 out 80│"), "{}", rows[3]);
    assert!(rows[6].starts_with("│failsafe PARKED "), "{}", rows[6]);
    let nothing = &mut session_without_bytes();
    let rows = screen(nothing, 80, 24);
    assert!(rows[1].contains("no frame yet"), "{}", rows[1]);
    assert!(rows[3].contains(" -- out 80│"), "{}", rows[3]);
    assert!(rows[7].contains("state   [A] B "), "{}", rows[7]);
}

fn session_without_bytes() -> Session<Receiver<Bin>> {
    session(Path::new(""), false)
}

#[test]
fn keys_change_what_is_shown() {
    let mut session = watched(false);
    session.key(Key::Pause);
    let rows = screen(&mut session, 80, 24);
    assert!(rows[0].contains(" PAUSED "), "{}", rows[0]);
    assert!(rows[23].contains("space goes on"), "{}", rows[23]);
    session.key(Key::Pause);
    session.key(Key::Reset);
    let rows = screen(&mut session, 80, 24);
    assert!(rows[3].contains("bytes 4  frames 0 "), "{}", rows[3]);
    assert!(rows[20].starts_with("│   "), "{}", rows[20]);
    session.key(Key::Record);
    let rows = screen(&mut session, 80, 24);
    assert!(
        rows[9].contains("cannot record in no/such/directory"),
        "{}",
        rows[9]
    );
    session.key(Key::Help);
    let rows = screen(&mut session, 80, 24);
    assert!(
        rows.iter()
            .any(|row| row.contains("z             set the counters to zero"))
    );
    session.end_of_input();
    assert!(screen(&mut session, 80, 24)[0].contains(" THE INPUT HAS ENDED "));
}

#[test]
fn a_recording_is_shown_with_its_size() {
    let directory = tempfile::tempdir().unwrap();
    let mut session = session(directory.path(), false);
    session.key(Key::Record);
    session.receive(ms(1), b"12345");
    let rows = screen(&mut session, 200, 24);
    assert!(rows[9].contains("framelock-1.bin: 5"), "{}", rows[9]);
    assert!(rows[23].contains("r ends the recording"), "{}", rows[23]);
}

#[test]
fn only_the_newest_discarded_bytes_are_shown_where_there_is_little_room() {
    let mut session = session(Path::new(""), false);
    session.receive(ms(1), &[b'?'; 60]);
    session.receive(ms(2), b"1234");
    let rows = screen(&mut session, 80, 24);
    assert!(rows[20].starts_with("│ 3F 3F"), "{}", rows[20]);
    assert!(rows[21].contains(" 3F 31 32 33 34│"), "{}", rows[21]);
}

#[test]
fn a_low_terminal_goes_without_the_chart_and_then_without_the_bytes() {
    let has = |height, text| {
        let rows = screen(&mut watched(false), 80, height);
        rows.iter().any(|row| row.contains(text))
    };
    for (height, chart, discarded) in [(24, true, true), (22, false, true), (15, false, false)] {
        assert_eq!(has(height, "the last ten seconds"), chart, "{height}");
        assert_eq!(has(height, "bytes discarded last"), discarded, "{height}");
        assert!(has(height, "resynchronised 0"), "{height}");
    }
}

#[test]
fn no_terminal_is_too_small_and_no_time_too_early() {
    for (width, height) in [(1, 1), (10, 3), (40, 12), (79, 23), (300, 100)] {
        screen(&mut session_without_bytes(), width, height);
        let mut session = watched(true);
        session.key(Key::Help);
        screen(&mut session, width, height);
    }
}
