//! `framelock demo` as its user meets it, without a terminal.

use crate::process;

/// What it writes to standard output; it must succeed, and have nothing to complain of.
fn shown(arguments: &[&str]) -> String {
    process::shown(&[&["demo"], arguments].concat(), "")
}

/// What it complains of; it must fail with 2, and show nothing.
fn complaint(arguments: &[&str]) -> String {
    let output = process::run(&[&["demo"], arguments].concat(), "");
    assert!(output.stdout.is_empty());
    process::complaint(output)
}

/// A row of the table: of the lecture's machine and of the receiver.
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
fn by_default_the_difference_is_to_be_seen() {
    let shown = shown(&[]);
    let [discard, rescan] = row(&shown, "lost");
    assert!(discard > rescan + 150);
    let [discard, rescan] = row(&shown, "though delivered whole");
    assert!(discard > 200);
    assert_eq!(rescan, 0);
    assert_eq!(row(&shown, "failsafe engagements"), [2, 1]);
    // A line for each second, between a header of two and the table.
    assert!(shown.contains("\n    26 s  motion      1125"));
}

#[test]
fn the_same_seed_gives_the_same_lines() {
    let seven = shown(&["--seed", "7"]);
    assert_eq!(shown(&["--seed", "7", "--plain"]), seven);
    assert_eq!(shown(&["--seed", "7", "--speed", "0.1"]), seven);
    assert_ne!(shown(&["--seed", "8"]), seven);
}

#[test]
fn without_faults_nothing_is_lost_wrong_or_discarded() {
    for seed in ["1", "2", "3"] {
        let shown = shown(&["--drop", "0", "--flip", "0", "--seed", seed]);
        let sent = row(&shown, "frames sent");
        assert_eq!(sent[0], 1125);
        assert_eq!(row(&shown, "received"), sent);
        for name in ["lost", "wrong commits", "bytes discarded"] {
            assert_eq!(row(&shown, name), [0, 0], "{name}");
        }
        assert!(shown.contains("The line broke 0 frames"));
    }
}

#[test]
fn what_was_sent_was_received_or_lost() {
    for seed in ["1", "2", "3"] {
        let shown = shown(&["--seed", seed, "--drop", "0.05", "--flip", "0.05"]);
        let [sent, received, lost] =
            ["frames sent", "received", "lost"].map(|name| row(&shown, name));
        for policy in 0..2 {
            assert_eq!(received[policy] + lost[policy], sent[policy]);
        }
        let [whole, wrong] =
            ["though delivered whole", "wrong commits"].map(|name| row(&shown, name)[1]);
        assert!(whole <= wrong);
    }
}

#[test]
fn an_idle_gap_rule_helps_the_lectures_machine() {
    let shown = shown(&["--idle-gap", "20"]);
    assert_eq!(row(&shown, "though delivered whole"), [0, 0]);
    assert!(shown.contains("idle gap: more than 20 byte times"));
}

#[test]
fn a_long_run_is_told_in_few_lines() {
    let shown = shown(&["--seconds", "3600", "--rate", "10"]);
    assert!(shown.lines().count() < 50);
    assert_eq!(row(&shown, "frames sent")[0], 31_154);
}

#[test]
fn impossible_parameters_are_named() {
    for (arguments, named) in [
        (&["--drop", "1.5"][..], "a number from 0 to 1 is wanted"),
        (&["--drop", "-1"], "--drop <PROBABILITY>"),
        (&["--flip", "NaN"], "--flip <PROBABILITY>"),
        (&["--flip", "often"], "'often'"),
        (&["--speed", "0"], "a number from 0.01 to 100 is wanted"),
        (&["--seconds", "0"], "--seconds"),
        (&["--rate", "0"], "--rate"),
        (&["--baud", "1"], "--baud"),
        (
            &["--baud", "9600", "--rate", "200"],
            "need 14000 baud: raise --baud from 9600, or lower --rate to 137 at most",
        ),
        (
            &["--baud", "300", "--rate", "5"],
            "lower --rate to 4 at most",
        ),
    ] {
        let message = complaint(arguments);
        assert!(message.contains(named), "{arguments:?}: {message}");
    }
}
