//! The stage that tests the tests: cargo-mutants changes the core one place at a time, as
//! `.cargo/mutants.toml` says, and some test must fail.

use std::process::Command;

use anyhow::{Result, ensure};
use xshell::cmd;

use crate::report::Report;
use crate::workspace::Workspace;

const CARGO_MUTANTS: &str = "27.1.0";

pub(crate) fn stage(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let sh = workspace.shell_with("cargo-mutants", CARGO_MUTANTS)?;
    let output = &workspace.target_directory;
    let mutants = cmd!(sh, "cargo mutants --workspace --output {output}");
    let status = Command::from(mutants).status()?;
    // 3: some mutant's tests do not come to an end, which is noticed as well.
    ensure!(
        matches!(status.code(), Some(0 | 3)),
        "some are not noticed: see above"
    );
    Ok(())
}
