#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::time::Duration;

use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::super::demonstration::tests::DEFAULT;
use super::*;

fn demonstration(milliseconds: u64) -> Demonstration {
    let mut demonstration = Demonstration::new(DEFAULT).unwrap();
    demonstration.advance_to(Duration::from_millis(milliseconds));
    demonstration
}

/// The screen as text, row by row.
fn screen(demonstration: &Demonstration, width: u16, height: u16) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal
        .draw(|frame| draw(frame, demonstration, false))
        .unwrap();
    let buffer = terminal.backend().buffer();
    let cells = buffer.content().chunks(usize::from(width).max(1));
    cells
        .map(|row| row.iter().map(ratatui::buffer::Cell::symbol).collect())
        .collect()
}

/// The screen's two halves, of the rows that belong to the stations.
fn stations(screen: &[String]) -> [String; 2] {
    let half = |from: usize| {
        let rows = screen.iter().skip(2).take(9);
        let halves = rows.map(|row| row.chars().skip(from).take(40).collect::<String>());
        halves.collect::<Vec<_>>().join("\n")
    };
    [half(0), half(40)]
}

#[test]
fn parked_shows_one_station_deaf_and_the_other_live() {
    let screen = screen(&demonstration(22_000), 80, 24);
    assert_eq!(screen.len(), 24);
    assert!(screen[1].contains("22.0 of 26 s"), "{}", screen[1]);
    assert!(screen[1].trim_end().ends_with("one byte is lost"));

    let [discard, rescan] = stations(&screen);
    assert!(discard.contains("the lecture's machine: discard"));
    assert!(discard.contains("failsafe PARKED"));
    assert!(discard.contains(" 80 sent 41"));
    assert!(rescan.contains("the receiver: rescan"));
    assert!(rescan.contains("failsafe LIVE"));
    assert!(rescan.contains(" 41 sent 41"));
    assert!(rescan.contains(" 00 sent 00"));

    assert!(screen[23].contains("q quits"));
}

#[test]
fn the_close_up_marks_the_lost_byte_and_shows_both_machines() {
    let screen = screen(&demonstration(22_000), 80, 24);
    let close_up: Vec<&str> = screen[18..22]
        .iter()
        .map(|row| row.trim_matches(['│', ' ']))
        .collect();
    assert_eq!(
        close_up,
        [
            "sent      41 42 00 41 42 00 0D 41 42 00 41 42 00 0D 41 42 00 41 42 00 0D",
            "received  -- 42 00 41 42 00 0D 41 42 00 41 42 00 0D 41 42 00 41 42 00 0D",
            "lecture      A  A  B  1  2  3  4  CR A  B  1  2  3  4  CR A  B  1  2  3",
            "receiver     A  A  B  1  2  3  4  CR 2  3  4  CR ok B  1  2  3  4  CR ok",
        ]
    );
}

#[test]
fn the_counters_are_the_simulations() {
    let demonstration = demonstration(9_000);
    let screen = screen(&demonstration, 80, 24);
    let (line, reports) = demonstration.report();
    assert!(screen[1].contains(&format!("sent {}", line.frames_sent)));
    for (half, report) in stations(&screen).iter().zip(reports) {
        for text in [
            format!("received {} ", report.tally.delivered),
            format!("lost {} ", report.lost),
            format!("wrong {} ", report.wrong),
            format!("lost though delivered whole {} ", report.tally.lost_intact),
            format!("bytes discarded {} ", report.tally.bytes_discarded),
        ] {
            assert!(half.contains(&text), "{text:?} in\n{half}");
        }
    }
}

#[test]
fn a_high_terminal_has_a_chart_and_a_low_one_has_not() {
    let demonstration = demonstration(10_000);
    let has_chart = |height| {
        let screen = screen(&demonstration, 100, height);
        screen
            .iter()
            .any(|row| row.contains("the last ten seconds"))
    };
    assert!(has_chart(40));
    assert!(!has_chart(24));
}

#[test]
fn a_low_terminal_shows_the_stations_whole() {
    let screen = screen(&demonstration(10_000), 80, 15);
    assert!(stations(&screen)[1].contains("bytes discarded"));
    assert!(!screen.iter().any(|row| row.starts_with("│sent ")));
}

#[test]
fn no_terminal_is_too_small_and_no_time_too_early() {
    for milliseconds in [0, 5, 3_000] {
        let demonstration = demonstration(milliseconds);
        for (width, height) in [(1, 1), (10, 3), (40, 12), (79, 23), (300, 100)] {
            screen(&demonstration, width, height);
        }
    }
}
