//! The stages that run tests and count them.

use anyhow::{Result, bail};

use crate::command::{cargo, run_and_read, version};
use crate::firmware_tests;
use crate::fuzz;
use crate::stage::Report;
use crate::test_count::TestCount;
use crate::workspace::Workspace;

/// Unit and integration tests.
pub(crate) fn unit_and_integration(workspace: &Workspace, report: &mut Report) -> Result<()> {
    run_tests(workspace, report, &["--lib", "--bins", "--tests"])
}

/// The examples in the documentation.
pub(crate) fn documentation_examples(workspace: &Workspace, report: &mut Report) -> Result<()> {
    run_tests(workspace, report, &["--doc"])
}

fn run_tests(workspace: &Workspace, report: &mut Report, which: &[&str]) -> Result<()> {
    report.engine = version(&mut cargo(workspace))?;
    let outcome = run_and_read(
        cargo(workspace)
            .args(["test", "--workspace", "--all-features", "--no-fail-fast"])
            // These need the firmware's images, and have a stage of their own.
            .args(["--exclude", firmware_tests::PACKAGE])
            .args(["--exclude", fuzz::NEEDS_IMAGES])
            .args(which),
        |line| report.tests += TestCount::from_line(line),
    );
    let count = report.tests;
    report.extent = count.to_string();
    outcome?;

    // Success is not enough: a test that ends its program with exit code 0 takes the rest along.
    if count.unfinished() > 0 {
        bail!(
            "{} tests were announced but have no result: their program ended before them",
            count.unfinished()
        );
    }
    if count.executed() == 0 {
        bail!("no test was executed, so nothing was tested");
    }
    Ok(())
}
