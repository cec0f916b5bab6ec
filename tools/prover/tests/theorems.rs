//! Checks all theorems in a test, because cargo-mutants notices a change only if a test fails.

use std::process::Command;
use std::time::Duration;

use framelock_limited::Process;

/// The limit for all theorems. Each harness has a limit of its own.
const LIMIT: Duration = Duration::from_secs(4 * 3600);

#[test]
#[ignore = "needs CBMC and takes minutes: cargo-mutants runs it, see proofs/README.md"]
fn every_theorem_is_proved() {
    let packages = [
        "framelock",
        "framelock-proofs",
        "framelock-formats",
        "framelock-reception",
    ];
    let mut prover = Command::new(env!("CARGO_BIN_EXE_framelock-offline-prover"));
    let packages = packages.iter().flat_map(|package| ["--package", package]);
    prover.args(packages).args(["--fail-fast", "--timeout=120"]);
    let mut running = Process::start_within(LIMIT, &mut prover).expect("the prover starts");
    let status = running.wait().expect("the prover ends");
    // Exit code 3 means that no harness fails, but some have no answer in time or could not be checked. Such a harness
    // does not show that the change was noticed.
    let is_noticed = !matches!(status.code(), Some(0 | 3));
    assert!(!is_noticed, "a harness failed: see above");
}
