//! Tests of `framelock demo` as a process, without a terminal.

use crate::process;

/// Runs `framelock demo`, which must succeed without messages, and returns its standard output.
fn shown(arguments: &[&str]) -> String {
    process::shown(&[&["demo"], arguments].concat(), "")
}

/// Returns a row of the table: the numbers of the lecture's machine and of framelock.
fn row(shown: &str, name: &str) -> [u64; 2] {
    let numbers = shown
        .lines()
        .find_map(|line| line.trim_start().strip_prefix(name))
        .unwrap_or_else(|| panic!("no row '{name}' in\n{shown}"));
    let numbers: Vec<u64> = numbers
        .split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect();
    numbers.try_into().unwrap()
}

#[test]
fn the_default_demo_shows_the_difference() {
    let shown = shown(&[]);
    let [lecture, framelock] = row(&shown, "lost");
    assert!(lecture > framelock + 55);
    let [lecture, framelock] = row(&shown, "though delivered whole");
    assert!(lecture > 55);
    assert_eq!(framelock, 0);
    assert_eq!(row(&shown, "failsafe engagements"), [3, 1]);
    let [lecture, framelock] = row(&shown, "deaf for at most, ms");
    assert!(lecture > 5_500);
    assert_eq!(framelock, 0);
    // The output is the story, a line for each second, and the table, within 80 columns.
    let deaf = shown.find("\nONE LOST BYTE\nOne byte was lost").unwrap();
    let hold = "\n     4 s      40      20       1.9 s  hold           1           -  live\n";
    assert!(shown[deaf..].contains(hold), "{shown}");
    assert!(shown.contains("\n    20 s     160 "));
    for line in shown.lines() {
        assert!(line.len() <= 80, "{line}");
    }
}

#[test]
fn the_same_seed_gives_the_same_lines() {
    let seven = shown(&["--seed", "7"]);
    assert_eq!(shown(&["--seed", "7", "--plain"]), seven);
    assert_eq!(shown(&["--seed", "7", "--speed", "0.1"]), seven);
    assert_ne!(shown(&["--seed", "8"]), seven);
}

#[test]
fn without_faults_the_story_mentions_none() {
    let shown = shown(&["--drop", "0", "--flip", "0"]);
    assert!(shown.contains("\nA GOOD LINE\n") && !shown.contains("lost, and one frame"));
    assert!(
        shown.ends_with("\nBroken by the line: 0. Missed though whole: lecture 0, framelock 0.\n")
    );
    assert_eq!(row(&shown, "received"), [160; 2]);
}

#[test]
fn with_an_idle_gap_rule_the_lectures_machine_finds_every_frame_too() {
    for seed in ["1", "2", "3"] {
        let shown = shown(&["--idle-gap", "20", "--seed", seed]);
        assert_eq!(row(&shown, "though delivered whole"), [0, 0]);
        assert!(shown.contains("idle gap: a pause of more than 20 byte times"));
        assert!(shown.contains("With the\nidle-gap rule each receiver"));
        assert!(!shown.contains("deaf:"));
    }
}

#[test]
fn a_long_run_takes_few_lines() {
    let shown = shown(&["--seconds", "3600", "--rate", "10"]);
    assert!(shown.lines().count() < 70);
    assert_eq!(row(&shown, "frames sent")[0], 28_800);
}
