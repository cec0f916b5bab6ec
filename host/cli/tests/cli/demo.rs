//! Tests of `framelock demo` as a process, without a terminal.

use crate::process;

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
fn the_demo_shows_the_difference() {
    let shown = process::shown(&["demo"], "");
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
