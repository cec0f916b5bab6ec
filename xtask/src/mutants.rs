//! The stage that tests the tests: cargo-mutants changes the core one place at a time, as
//! `.cargo/mutants.toml` says, and some test must fail.

use anyhow::Result;
use xshell::cmd;

use crate::report::Report;
use crate::workspace::Workspace;

const CARGO_MUTANTS: &str = "27.1.0";

pub(crate) fn stage(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let sh = workspace.shell_with("cargo-mutants", CARGO_MUTANTS)?;
    let output = &workspace.target_directory;
    Ok(cmd!(sh, "cargo mutants --workspace --output {output}").run()?)
}
