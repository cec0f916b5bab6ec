//! The stages that judge the sources without running them: format, clippy, documentation.

use anyhow::{Context, Result, anyhow};

use crate::command::{cargo, run, version};
use crate::stage::Report;
use crate::workspace::Workspace;

/// The sources are formatted by rustfmt.
pub(crate) fn format(workspace: &Workspace, report: &mut Report) -> Result<()> {
    report.engine = version(cargo(workspace).arg("fmt"))
        .context("rustfmt is needed: rustup component add rustfmt")?;
    run(cargo(workspace).args(["fmt", "--all", "--check"])).map_err(|error| {
        anyhow!("{error:#}; if it showed differences, `cargo fmt --all` settles them")
    })
}

/// No warning from the compiler or clippy, in libraries, programs, tests and benchmarks.
pub(crate) fn clippy(workspace: &Workspace, report: &mut Report) -> Result<()> {
    report.engine = clippy_version(workspace)?;
    run(cargo(workspace).args([
        "clippy",
        "--workspace",
        "--all-targets",
        "--all-features",
        "--",
        "-Dwarnings",
    ]))
}

/// The documentation builds without warnings.
pub(crate) fn documentation(workspace: &Workspace, report: &mut Report) -> Result<()> {
    report.engine = version(&mut std::process::Command::new("rustdoc"))
        .context("rustdoc is needed: rustup component add rustc")?;
    run(cargo(workspace)
        .args(["doc", "--workspace", "--no-deps", "--all-features"])
        .env("RUSTDOCFLAGS", "-Dwarnings"))
}

/// Which clippy there is.
pub(crate) fn clippy_version(workspace: &Workspace) -> Result<String> {
    version(cargo(workspace).arg("clippy")).context("clippy is needed: rustup component add clippy")
}
