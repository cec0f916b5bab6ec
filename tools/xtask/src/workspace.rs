//! The workspace as cargo describes it, and copies of it in which mistakes are seeded.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use anyhow::{Context as _, Result, ensure};
use cargo_metadata::{MetadataCommand, Package};
use xshell::Shell;

use crate::browser;

/// The package that microcontrollers use, in the folder `core`.
pub(crate) const CORE: &str = "framelock";

/// The option with which every cargo command that compiles also runs clippy. Clippy's compiler is rustc with more
/// lints, and works only with its own toolchain. An environment variable could also select clippy, but programs that
/// cargo runs would inherit the variable.
pub(crate) const CLIPPY: [&str; 2] = ["--config", "build.rustc-workspace-wrapper='clippy-driver'"];

/// The variable that turns clippy's warnings into errors.
pub(crate) const NO_WARNINGS: (&str, &str) = ("CLIPPY_ARGS", "-Dwarnings");

pub(crate) struct Workspace {
    pub(crate) root: PathBuf,
    pub(crate) target_directory: PathBuf,
    /// The version of all packages.
    pub(crate) version: String,
    /// The core's optional features.
    pub(crate) core_features: Vec<String>,
    /// All packages.
    #[cfg(test)]
    pub(crate) packages: Vec<Package>,
    /// The packages whose manifests do not contain `publish = false`.
    pub(crate) published: Vec<Package>,
    /// The baseline commit. The public interface must stay compatible with the interface at this commit.
    pub(crate) semver_baseline: String,
}

impl Workspace {
    /// Loads the workspace by asking cargo.
    pub(crate) fn load() -> Result<Self> {
        // Use the folder at run time, not the one at compile time. Cargo may have kept a program that was compiled in a
        // copy of the workspace, and this program would then check the copy.
        let here = env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| ".".into());
        let metadata = MetadataCommand::new().current_dir(here).no_deps().exec()?;
        let core = metadata.packages.iter().find(|one| one.name == CORE);
        let core = core.context("the workspace has no core")?;
        let baseline = metadata.workspace_metadata.get("semver-baseline");
        let version = core.version.to_string();
        let core_features = core.features.keys().cloned().collect();
        let mut published = metadata.packages.clone();
        published.retain(|package| package.publish.is_none());
        Ok(Self {
            version,
            core_features,
            #[cfg(test)]
            packages: metadata.packages,
            published,
            semver_baseline: baseline
                .and_then(serde_json::Value::as_str)
                .context("Cargo.toml has no semver-baseline")?
                .to_owned(),
            root: metadata.workspace_root.into(),
            target_directory: metadata.target_directory.into(),
        })
    }

    /// Returns a command that runs cargo in the root.
    pub(crate) fn cargo(&self) -> Command {
        cargo_in(&self.root)
    }

    /// Returns the command that tests all packages except the [browser's](browser::TESTS). All stages pass the same
    /// packages to cargo. These packages determine the features of common dependencies. With other packages, cargo
    /// would compile the dependencies again. Clippy compiles the tests (see [`CLIPPY`]), so that they need not be
    /// compiled again to run.
    pub(crate) fn cargo_test(&self) -> Command {
        let mut cargo = self.cargo();
        cargo.args(["test", "--workspace", "--all-features"]);
        cargo.args(["--exclude", browser::TESTS]);
        cargo.args(CLIPPY).envs([NO_WARNINGS]);
        cargo
    }

    /// Returns a shell in the root.
    pub(crate) fn shell(&self) -> Result<Shell> {
        let sh = Shell::new()?;
        sh.change_dir(&self.root);
        Ok(sh)
    }

    /// Copies these folders to a workspace at `to`, whose packages are `members`.
    pub(crate) fn copy(&self, to: &Path, folders: &[&str], members: &[&str]) -> Result<()> {
        for folder in folders {
            copy_folder(&self.root.join(folder), &to.join(folder))?;
        }
        let manifest = fs::read_to_string(self.root.join("Cargo.toml"))?;
        let mut manifest: toml::Table = toml::from_str(&manifest).context("Cargo.toml")?;
        let workspace = manifest.get_mut("workspace");
        let workspace = workspace.and_then(toml::Value::as_table_mut);
        let workspace = workspace.context("Cargo.toml has no [workspace]")?;
        workspace.insert("members".to_owned(), members.to_vec().into());
        workspace.remove("default-members");
        workspace.remove("exclude");
        fs::write(to.join("Cargo.toml"), toml::to_string(&manifest)?)?;
        fs::copy(self.root.join("Cargo.lock"), to.join("Cargo.lock"))?;
        Ok(())
    }
}

/// Returns a command for the cargo that runs this program, in the given folder.
pub(crate) fn cargo_in(folder: &Path) -> Command {
    // `cargo xtask` passes the path of its cargo in CARGO, so that all stages use the same cargo.
    let program = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.current_dir(folder);
    command
}

fn copy_folder(from: &Path, to: &Path) -> Result<()> {
    for path in files(from)? {
        copy_file(&path, &to.join(path.strip_prefix(from)?))?;
    }
    Ok(())
}

/// Copies a file. Leaves an identical file alone, so that it is not compiled again.
pub(crate) fn copy_file(from: &Path, to: &Path) -> Result<()> {
    let content = fs::read(from)?;
    if !fs::read(to).is_ok_and(|old| old == content) {
        fs::create_dir_all(to.parent().context("a file is in a folder")?)?;
        fs::write(to, content)?;
    }
    Ok(())
}

/// Returns whether every proof must be repeated, even if nothing has changed. Hosted machines set `CI`, and keep the build
/// folder between runs.
pub(crate) fn must_repeat() -> bool {
    env::var_os("CI").is_some()
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

/// Returns the targets of `[text](target)` and of `[text]: target`, without fragments.
#[cfg(test)]
pub(crate) fn links(text: &str) -> impl Iterator<Item = &str> {
    let inline = text.split("](").skip(1);
    let inline = inline.filter_map(|rest| rest.split([')', ' ', '\n']).next());
    let named = text.lines().filter_map(|line| line.strip_prefix('['));
    let named = named.filter_map(|line| line.split_once("]: ")?.1.split(' ').next());
    let all = inline.chain(named);
    all.filter_map(|link| link.split('#').next())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_relative_link_leads_to_a_file() {
        let root = Workspace::load().expect("cargo knows this workspace").root;
        let mut broken = Vec::new();
        for entry in fs::read_dir(&root).expect("a folder").flatten() {
            let name = entry.file_name().into_string().expect("a plain name");
            if name.starts_with('.') || name == "target" {
                continue;
            }
            for file in files(&entry.path()).expect("readable folders") {
                if file.extension().is_none_or(|extension| extension != "md") {
                    continue;
                }
                let text = fs::read_to_string(&file).expect("text");
                let folder = file.parent().expect("a file is in a folder");
                let relative = links(&text).filter(|link| !link.contains(':'));
                let missing = relative.filter(|link| !folder.join(link).exists());
                broken.extend(missing.map(|link| format!("{}: {link}", file.display())));
            }
        }
        assert!(broken.is_empty(), "{}", broken.join("\n"));
    }
}
