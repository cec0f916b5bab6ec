//! What fuzzing needs: cargo-fuzz and a nightly compiler.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::cargo_tool::{CargoTool, Found};
use crate::command::{output, run, version};
use crate::workspace::Workspace;

const CARGO_FUZZ: CargoTool = CargoTool {
    package: "cargo-fuzz",
    ask_version: &["--version"],
    version: "0.13.2",
};

/// The compiler's coverage counters and its choice of code generation are unstable options.
const TOOLCHAIN: &str = "nightly";

/// Both.
pub(crate) struct Fuzzer {
    /// What they are, with their versions.
    pub(crate) says: String,
    cargo_fuzz: Found,
    root: PathBuf,
    /// Where the targets are built.
    build: PathBuf,
}

impl Fuzzer {
    /// Finds them, and installs what is not there.
    pub(crate) fn set_up(workspace: &Workspace) -> Result<Self> {
        let compiler = nightly()?;
        let cargo_fuzz = CARGO_FUZZ.find(workspace)?;
        Ok(Self {
            says: format!("{}, {compiler}", cargo_fuzz.says),
            cargo_fuzz,
            root: workspace.root.clone(),
            build: workspace.target_directory.join("fuzz"),
        })
    }

    /// `cargo fuzz COMMAND`, with what is common to all of them.
    ///
    /// No sanitizer: the core and what checks it forbid `unsafe`, and without it there is no memory
    /// error for one to find. Comparisons are not traced, which takes more than half of the time: what
    /// the receivers compare with is in the dictionary and the seeds.
    pub(crate) fn command(&self, command: &str) -> Result<Command> {
        let mut cargo = rustup_run();
        cargo
            .arg("cargo")
            .args(["fuzz", command, "--sanitizer", "none"])
            .args(["--no-trace-compares", "--target-dir"])
            .arg(&self.build)
            .current_dir(&self.root);
        self.cargo_fuzz.use_in(&mut cargo)?;
        Ok(cargo)
    }
}

/// A command of the nightly toolchain. What `cargo xtask` says about its own is not for that one.
fn rustup_run() -> Command {
    let mut command = Command::new("rustup");
    command
        .args(["run", TOOLCHAIN])
        .env_remove("CARGO")
        .env_remove("RUSTC")
        .env_remove("RUSTUP_TOOLCHAIN")
        .env_remove("LD_LIBRARY_PATH");
    command
}

/// Its version.
fn nightly() -> Result<String> {
    if let Ok(found) = version(rustup_run().arg("rustc")) {
        return Ok(format!("{found} ({})", date()?));
    }
    run(Command::new("rustup").args(["toolchain", "install", TOOLCHAIN, "--profile", "minimal"]))
        .context("fuzzing needs a nightly compiler: rustup toolchain install nightly")?;
    Ok(format!(
        "{} ({})",
        version(rustup_run().arg("rustc"))?,
        date()?
    ))
}

/// The day its sources are from: "nightly" alone says nothing.
fn date() -> Result<String> {
    let answer = output(rustup_run().args(["rustc", "--version", "--verbose"]))?;
    let line = answer
        .lines()
        .find_map(|line| line.strip_prefix("commit-date: "));
    Ok(line.unwrap_or("date unknown").to_owned())
}
