#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::time::Duration;

use super::*;
use crate::view_parts;

/// The beginning of the status row. The blanks distinguish the status row from a row of the story that contains these
/// words.
const LECTURE: &str = "the lecture's machine  ";

fn demonstration(milliseconds: u64) -> Demonstration {
    let mut demonstration = Demonstration::new().unwrap();
    demonstration.advance_to(Duration::from_millis(milliseconds));
    demonstration
}

/// Returns the rows of the screen as text.
fn screen(demonstration: &Demonstration, width: u16, height: u16) -> Vec<String> {
    view_parts::tests::screen(width, height, |frame| {
        draw(frame, demonstration, false);
    })
}

/// Returns the index of the row that begins with this text.
fn row(screen: &[String], start: &str) -> usize {
    let mut rows = screen.iter();
    let found = rows.position(|row| row.trim_start().starts_with(start));
    found.unwrap_or_else(|| panic!("no {start:?} in\n{}", screen.join("\n")))
}

#[test]
fn within_five_seconds_one_receiver_is_deaf_and_the_other_listens() {
    let screen = screen(&demonstration(4_500), 80, 24);
    assert!(screen[0].trim_end().ends_with("q quits, space pauses"));
    let heading = &screen[row(&screen, "ONE LOST BYTE")];
    assert!(heading.trim_end().ends_with("4.5 of 20 s"), "{heading}");

    let lecture = &screen[row(&screen, LECTURE)..];
    assert!(lecture[0].contains(" DEAF for 2.4 s "), "{}", lecture[0]);
    assert!(lecture[0].contains("failsafe RAMP"), "{}", lecture[0]);
    let (heard, missed) = ("●".repeat(20), "○".repeat(24));
    assert_eq!(lecture[1].trim(), format!("{heard}×{missed}"));
    assert_eq!(
        lecture[2].trim(),
        "● 20 delivered  ○ 24 missed though whole  × 1 broken by the line  ! 0 wrong"
    );

    let framelock = &screen[row(&screen, "framelock  ")..];
    assert!(framelock[0].contains(" LISTENING "), "{}", framelock[0]);
    assert!(framelock[0].contains("failsafe LIVE"), "{}", framelock[0]);
    assert_eq!(framelock[1].trim(), format!("{heard}×{}", "●".repeat(24)));
    assert!(framelock[2].contains("● 44 delivered  ○ 0 missed though whole"));
}

/// The first frame that the lecture's machine misses was due at 2.1 s.
#[test]
fn a_time_that_would_be_rounded_to_zero_is_not_shown() {
    for (milliseconds, status) in [
        (2_110, " DEAF  "),
        (2_190, " DEAF  "),
        (2_210, " DEAF for 0.1 s "),
    ] {
        let screen = screen(&demonstration(milliseconds), 80, 24);
        let lecture = &screen[row(&screen, LECTURE)];
        assert!(lecture.contains(status), "{milliseconds}: {lecture}");
    }
}

#[test]
fn the_close_up_marks_the_lost_byte_and_shows_both_machines() {
    let screen = screen(&demonstration(7_000), 80, 24);
    let close_up: Vec<&str> = screen[row(&screen, "sent ")..][..4]
        .iter()
        .map(|row| row.trim())
        .collect();
    assert_eq!(
        close_up,
        [
            "sent      41 42 00 41 42 00 0D│41 42 00 41 42 00 0D│41 42 00 41 42 00 0D│",
            "arrived   -- 42 00 41 42 00 0D│41 42 00 41 42 00 0D│41 42 00 41 42 00 0D│",
            "lecture      A  A  B  1  2  3 │4  CR A  B  1  2  3 │4  CR A  B  1  2  3 │",
            "framelock    A  A  B  1  2  3 │4  CR 2  3  4  CR ok│B  1  2  3  4  CR ok│",
        ]
    );
}

/// After the failsafe has moved only one of the seats, the bars differ.
#[test]
fn the_seats_show_the_outputs_of_the_failsafes() {
    let screen = screen(&demonstration(7_000), 80, 24);
    let seat = |name| &screen[row(&screen, name) + 3];
    let blocks = |row: &str| row.matches('█').count();
    let [lecture, framelock] = [LECTURE, "framelock  "].map(seat);
    assert!(lecture.contains("pitch ███┃"), "{lecture}");
    assert!(framelock.contains("pitch ███┃"), "{framelock}");
    assert!(
        blocks(lecture) > 2 * blocks(framelock),
        "{lecture}{framelock}"
    );
}

#[test]
fn every_story_is_told_to_its_end_on_every_terminal_that_has_room() {
    for milliseconds in [1_000, 4_000, 10_000, 14_000, 18_000] {
        let demonstration = demonstration(milliseconds);
        let story = story(&demonstration);
        let end = story.text.split_whitespace().next_back().unwrap();
        for (width, height) in [(80, 23), (80, 24), (300, 100)] {
            let screen = screen(&demonstration, width, height);
            let above = &screen[..row(&screen, LECTURE)];
            let mut rows = above.iter().rev().map(|row| row.trim());
            let last = rows.find(|row| !row.is_empty()).unwrap();
            assert!(last.ends_with(end), "{width}x{height}: {last}");
            for start in ["seat", "arrived", "framelock "] {
                row(&screen, start);
            }
        }
    }
}

#[test]
fn on_a_terminal_that_is_too_small_it_says_what_it_needs() {
    let demonstration = demonstration(3_000);
    let shown = screen(&demonstration, 50, 12).join("");
    assert!(shown.starts_with("The demo needs 80 columns and 23 rows; this"));
    assert!(shown.contains("framelock demo | cat"));
    for (width, height) in [(1, 1), (79, 23), (80, 22)] {
        let shown = screen(&demonstration, width, height).join("");
        assert!(!shown.contains("LISTENING"), "{shown}");
    }
}
