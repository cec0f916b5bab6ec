//! Cargo's further commands that the project needs, installed if need be: of a fixed version, and
//! into `target`, so that nothing outside of the project changes.

use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::command::{cargo, output, run};
use crate::workspace::Workspace;

/// One of them.
pub(crate) struct CargoTool {
    /// The package, which is also the program.
    pub(crate) package: &'static str,
    /// What to answer `--version` with, it must be asked so.
    pub(crate) ask_version: &'static [&'static str],
    pub(crate) version: &'static str,
}

impl CargoTool {
    /// Puts it in front of PATH of the commands that [`Found::use_in`] is given: the one in PATH
    /// already, if it is of the version; else the one in `target`, installed now if it is not there.
    pub(crate) fn find(&self, workspace: &Workspace) -> Result<Found> {
        if self.version_of(Path::new(self.package)).as_deref() == Some(self.version) {
            return Ok(self.found(None));
        }
        let root = workspace.target_directory.join(self.package);
        let folder = root.join("bin");
        if self.version_of(&folder.join(self.package)).as_deref() != Some(self.version) {
            self.install(workspace, &root)?;
        }
        Ok(self.found(Some(folder)))
    }

    fn found(&self, folder: Option<std::path::PathBuf>) -> Found {
        Found {
            says: format!("{} {}", self.package, self.version),
            folder,
        }
    }

    fn install(&self, workspace: &Workspace, root: &Path) -> Result<()> {
        let by_hand = format!(
            "{} {} could not be installed; by hand: cargo install --locked --version {} {}",
            self.package, self.version, self.version, self.package
        );
        run(cargo(workspace)
            .args(["install", "--locked", "--version", self.version, "--root"])
            .arg(root)
            .arg("--target-dir")
            .arg(root.join("build"))
            .arg(self.package))
        .context(by_hand)
    }

    fn version_of(&self, program: &Path) -> Option<String> {
        let answer = output(Command::new(program).args(self.ask_version)).ok()?;
        Some(answer.split_whitespace().nth(1)?.to_owned())
    }
}

/// Where it is.
pub(crate) struct Found {
    /// Name and version.
    pub(crate) says: String,
    /// Its folder, unless PATH has it.
    folder: Option<std::path::PathBuf>,
}

impl Found {
    /// Lets that cargo command find it.
    pub(crate) fn use_in(&self, command: &mut Command) -> Result<()> {
        if let Some(folder) = &self.folder {
            let path = std::env::var_os("PATH").unwrap_or_default();
            let folders = std::iter::once(folder.clone()).chain(std::env::split_paths(&path));
            command.env("PATH", std::env::join_paths(folders)?);
        }
        Ok(())
    }
}
