//! Installs the tools that checks need: cargo commands, Python packages and Debian packages.

use std::env;
use std::path::PathBuf;

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::workspace::Workspace;

impl Workspace {
    /// Returns the folder in which a cargo command is installed.
    fn tool(&self, package: &str) -> PathBuf {
        self.target_directory.join("tools").join(package)
    }

    /// Returns whether this version of a cargo command is installed.
    pub(crate) fn has_tool(&self, package: &str, version: &str) -> bool {
        self.tool(package).join(version).exists()
    }

    /// Returns a shell in the root whose PATH contains this version of a cargo command. Installs
    /// the command into `target` if it is missing.
    pub(crate) fn shell_with(&self, package: &str, version: &str) -> Result<Shell> {
        let sh = self.shell()?;
        let root = self.tool(package);
        let stamp = root.join(version);
        if !self.has_tool(package, version) {
            let build = root.join("build");
            cmd!(
                sh,
                "cargo install --locked --force --version {version} --root {root} --target-dir {build} {package}"
            )
            .run()?;
            sh.remove_path(build)?;
            sh.write_file(stamp, "")?;
        }
        let path = env::var_os("PATH").unwrap_or_default();
        let folders = std::iter::once(root.join("bin")).chain(env::split_paths(&path));
        sh.set_var("PATH", env::join_paths(folders)?);
        Ok(sh)
    }
}

impl Workspace {
    /// Returns a Python interpreter with these versions of packages from `PyPI`. Installs them into an environment in
    /// `target`.
    pub(crate) fn python_with(&self, packages: &[&str]) -> Result<PathBuf> {
        let sh = self.shell()?;
        let folder = self.tool("python").join(packages.join("_"));
        let stamp = folder.join("installed");
        if !stamp.exists() {
            let make = || cmd!(sh, "python3 -m venv --clear {folder}").run();
            // On Debian, the module `venv` is in a package of its own.
            if make().is_err() {
                from_debian(&sh, &["python3", "python3-venv"])?;
                make()?;
            }
            let pip = folder.join("bin/pip");
            cmd!(
                sh,
                "{pip} install --quiet --only-binary :all: {packages...}"
            )
            .run()?;
            sh.write_file(stamp, "")?;
        }
        Ok(folder.join("bin/python"))
    }
}

/// Installs the Debian packages in this list that are missing. Only root can do this.
pub(crate) fn from_debian(sh: &Shell, packages: &[&str]) -> Result<()> {
    let state = "--showformat=${db:Status-Status},";
    let query = cmd!(sh, "dpkg-query --show {state} {packages...}");
    if query.ignore_status().ignore_stderr().read()? != "installed,".repeat(packages.len()) {
        // The package lists are often out of date, so update them first. With `--no-remove`, the
        // command fails rather than remove a package that someone installed.
        cmd!(sh, "apt-get -o DPkg::Lock::Timeout=120 update").run()?;
        cmd!(
            sh,
            "apt-get -o DPkg::Lock::Timeout=120 install --yes --no-install-recommends --no-remove
             {packages...}"
        )
        .env("DEBIAN_FRONTEND", "noninteractive")
        .run()?;
    }
    Ok(())
}
