//! The workspace: its folders and packages, and commands that run in it.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use anyhow::{Context as _, Result, ensure};
use cargo_metadata::MetadataCommand;

pub(crate) struct Workspace {
    pub(crate) root: PathBuf,
    pub(crate) target: PathBuf,
    #[cfg(test)]
    pub(crate) packages: Vec<cargo_metadata::Package>,
}

impl Workspace {
    /// Loads the workspace by asking cargo.
    pub(crate) fn load() -> Result<Self> {
        // Use the folder at run time, not the one at compile time. Cargo may have kept a program that was compiled in a
        // copy of the workspace, and this program would then check the copy.
        let here = env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| ".".into());
        let metadata = MetadataCommand::new().current_dir(here).no_deps().exec()?;
        Ok(Self {
            root: metadata.workspace_root.into(),
            target: metadata.target_directory.into(),
            #[cfg(test)]
            packages: metadata.packages,
        })
    }

    /// Copies all files of the workspace, except files that git ignores. Leaves identical files alone, so that they are
    /// not compiled again.
    pub(crate) fn copy(&self, to: &Path) -> Result<()> {
        let mut git = Command::new("git");
        git.args(["ls-files", "--cached", "--others", "--exclude-standard"]);
        let listed = git.current_dir(&self.root).output()?.stdout;
        for file in String::from_utf8(listed)?.lines() {
            let (from, to) = (self.root.join(file), to.join(file));
            fs::create_dir_all(to.parent().context("a file is in a folder")?)?;
            if let Ok(link) = fs::read_link(&from) {
                if !to.is_symlink() {
                    symlink(link, to)?;
                }
            } else if let Ok(content) = fs::read(&from)
                && fs::read(&to).ok().as_ref() != Some(&content)
            {
                fs::write(to, content)?;
            }
        }
        Ok(())
    }

    /// Returns a command that calls a function of `stages.sh`.
    pub(crate) fn script(&self, function_and_arguments: &[&str]) -> Command {
        let mut script = Command::new("sh");
        script
            .arg("tools/xtask/stages.sh")
            .args(function_and_arguments)
            .current_dir(&self.root)
            .env("TARGET", &self.target);
        script
    }
}

/// Runs a command. Its failure is an error.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let status = command.status()?;
    ensure!(status.success(), "{command:?} ended with {status}");
    Ok(())
}

/// Returns a command for the cargo that runs this program, in the given folder.
pub(crate) fn cargo_in(folder: &Path) -> Command {
    // `cargo xtask` passes the path of its cargo in CARGO, so that all stages use the same cargo.
    let program = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.current_dir(folder);
    command
}

/// Returns all files in the folder and in its subfolders except `target`, in a fixed order.
pub(crate) fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    ensure!(folder.exists(), "there is no {}", folder.display());
    if folder.is_file() {
        return Ok(vec![folder.to_owned()]);
    }
    let mut all = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if !path.ends_with("target") {
            all.extend(files(&path)?);
        }
    }
    all.sort();
    Ok(all)
}
