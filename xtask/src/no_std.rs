//! The stage that builds the core for microcontrollers, where there is no std.

use std::process::Command;

use anyhow::{Result, bail};

use crate::bare_metal::Source;
use crate::command::{cargo, run};
use crate::stage::Report;
use crate::workspace::{CORE, Workspace};

/// From the smallest to the largest: no atomic compare-and-swap, a floating-point unit, not Arm.
const TARGETS: [&str; 3] = [
    "thumbv6m-none-eabi",
    "thumbv7em-none-eabihf",
    "riscv32imac-unknown-none-elf",
];

/// The core builds for microcontrollers, where there is no std.
pub(crate) fn build_core(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let source = Source::of(&TARGETS)?;
    report.engine = source.describe()?;
    report.extent = format!("{} targets", TARGETS.len());
    println!("The targets' libraries: {}", report.engine);

    for features in ["--no-default-features", "--all-features"] {
        build(workspace, &source, features)?;
    }
    Ok(())
}

/// Builds the core for all targets.
fn build(workspace: &Workspace, source: &Source, features: &str) -> Result<()> {
    // At once, so that all processors have work while Rust's `core` is built for each.
    let Err(error) = run(&mut build_command(workspace, source, features, &TARGETS)) else {
        return Ok(());
    };
    // Cargo does not say for which of the targets it failed; one by one shows it.
    let failed: Vec<&str> = TARGETS
        .into_iter()
        .filter(|target| run(&mut build_command(workspace, source, features, &[target])).is_err())
        .collect();
    bail!("{error:#}; on its own it fails for: {}", failed.join(", "))
}

fn build_command(
    workspace: &Workspace,
    source: &Source,
    features: &str,
    targets: &[&str],
) -> Command {
    let mut command = cargo(workspace);
    command.args(["build", "--package", CORE, features, "--release"]);
    for target in targets {
        command.args(["--target", target]);
    }
    // An own folder, so that a second compiler does not disturb what the host's builds keep.
    command
        .arg("--target-dir")
        .arg(workspace.target_directory.join("no-std"));
    source.use_in(&mut command);
    command
}
