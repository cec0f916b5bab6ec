//! Tests of the firmware on chips that deviate from the default assumptions in one way each.

use std::process::Command;
use std::time::Duration;

use framelock_limited::Process;
use nrf52840_emulator::Assumptions;

use crate::firmware::{Firmware, GAP, RESTART, frames, is_some_of};

/// The table in `docs/board.md` has a row for each deviation. The row says that nothing is lost, or names the counters
/// that report the loss. If one ENDRX is lost in addition, at most five frames are lost. But if the row says that a
/// restart loses the bytes of up to 12 ms, the frames of these 12 ms may be lost, too.
#[test]
fn each_deviation_loses_what_the_guide_says() {
    let guide = include_str!("../../docs/board.md");
    for (name, chip) in Assumptions::each() {
        let start = format!("| `{name}` |");
        let row = guide.lines().find(|line| line.starts_with(&start));
        let row = row.unwrap_or_else(|| panic!("{name} is missing in the guide"));
        for (image, frame_time) in [("default", 608), ("megabaud", 70)] {
            let mut firmware = Firmware::booted(image).assuming(chip);
            let (sent, bytes) = frames(200);
            firmware.send_and_wait(&bytes, GAP);
            let reported = firmware.counter("overrun") > 0 && firmware.counter("restarts") > 0;
            let is_lost = firmware.commits() != sent;
            let [says_nothing, says_reports] =
                ["| nothing", "`overrun` and `restarts`"].map(|text| row.contains(text));
            assert_eq!(
                [!is_lost, reported],
                [says_nothing, says_reports && is_lost],
                "{row}"
            );

            let mut firmware = Firmware::booted(image).assuming(chip);
            firmware.assume(|all| all.lost_end = 1);
            firmware.send_and_wait(&bytes, RESTART);
            let commits = firmware.commits();
            assert!(is_some_of(&commits, &sent), "{row}");
            assert!(firmware.counter("overrun") > 0, "{row}");
            assert_eq!(firmware.counter("restarts"), 1, "{row}");
            let waits = if row.contains("12 ms") {
                12_000 / frame_time
            } else {
                0
            };
            assert!(
                commits.len() + 5 + waits >= sent.len(),
                "{row}: {}",
                commits.len()
            );
        }
    }
}

/// The time limit for all tests under one deviation.
const LIMIT: Duration = Duration::from_hours(1);

/// This test takes minutes, so only `cargo xtask verify --all` runs it. It leaves out the figures, which hold only for
/// the default assumptions, and the tests that choose their assumptions themselves.
#[test]
#[ignore = "takes minutes"]
fn every_test_passes_under_each_assumption() {
    let tests = std::env::current_exe().unwrap();
    let failed: Vec<_> = Assumptions::each()
        .into_iter()
        // Leave out `lost_end`: a lost ENDRX costs frames, which most tests do not allow. The script `line_errors.txt`
        // and the module `random` test the effects of a lost ENDRX.
        .filter(|(name, _)| *name != "lost_end")
        .filter(|(name, _)| {
            println!("{name}");
            let mut all = Command::new(&tests);
            all.args(["--include-ignored", "--skip", "figures::"]);
            all.args(["--skip", "assumptions::", "--skip", "under_each_assumption"]);
            all.env("FRAMELOCK_ASSUMPTION", name);
            !Process::start_within(LIMIT, &mut all)
                .unwrap()
                .wait()
                .unwrap()
                .success()
        })
        .collect();
    assert!(failed.is_empty(), "{failed:#?}");
}
