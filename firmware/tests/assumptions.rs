//! Runs all tests again under each assumption about the chip.

use std::process::Command;
use std::time::Duration;

use framelock_limited::Process;
use nrf52840_emulator::Assumptions;

/// The limit for all tests under one assumption.
const LIMIT: Duration = Duration::from_hours(1);

/// This test takes minutes, so only `cargo xtask verify --all` runs it. It leaves out the figures, which hold only for
/// the default assumptions.
#[test]
#[ignore = "takes minutes"]
fn every_test_passes_under_each_assumption() {
    let tests = std::env::current_exe().unwrap();
    let failed: Vec<_> = Assumptions::each()
        .into_iter()
        // Leave out the assumption that an ENDRX is lost, because then a frame is lost, too. The modules `line_errors`
        // and `random` test the effects of a lost ENDRX.
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
