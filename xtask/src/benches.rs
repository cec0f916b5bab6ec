//! The stage that runs each benchmark once, untimed.

use anyhow::{Result, bail};

use crate::command::{cargo, run_and_read, version};
use crate::stage::Report;
use crate::workspace::Workspace;

/// The benchmarks compile and confirm their answers, untimed.
pub(crate) fn confirm(workspace: &Workspace, report: &mut Report) -> Result<()> {
    report.engine = version(&mut cargo(workspace))?;

    let mut confirmed = 0;
    let mut failed = Vec::new();
    for package in &workspace.packages {
        // By name: `--benches` would also run the unit tests, which do not know `--test`.
        for benchmark in package.benchmarks() {
            match confirm_one(workspace, &package.name, benchmark) {
                Ok(count) => confirmed += count,
                Err(error) => failed.push(format!("{error:#}")),
            }
        }
    }

    report.extent = format!("{confirmed} benchmarks");
    if !failed.is_empty() {
        bail!("{}", failed.join("\n"));
    }
    if confirmed == 0 {
        bail!("the workspace has no benchmarks, so nothing was confirmed");
    }
    Ok(())
}

/// Runs one benchmark program; returns how many benchmarks in it succeeded.
fn confirm_one(workspace: &Workspace, package: &str, benchmark: &str) -> Result<usize> {
    let mut succeeded = 0;
    run_and_read(
        cargo(workspace)
            .args(["bench", "--package", package, "--all-features"])
            // `--test` is criterion's: run everything once, measure nothing.
            .args(["--bench", benchmark, "--", "--test"]),
        // Criterion writes this line after each benchmark that ran.
        |line| succeeded += usize::from(line == "Success"),
    )?;
    if succeeded == 0 {
        bail!("the benchmark program `{benchmark}` of `{package}` ran no benchmark");
    }
    Ok(succeeded)
}
