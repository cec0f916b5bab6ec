//! Installs what a check needs: cargo commands, and Debian's packages.

use std::env;
use std::path::PathBuf;

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::workspace::Workspace;

impl Workspace {
    /// Where a cargo command is installed.
    fn tool(&self, package: &str) -> PathBuf {
        self.target_directory.join("tools").join(package)
    }

    /// Whether a cargo command of this version is there.
    pub(crate) fn has_tool(&self, package: &str, version: &str) -> bool {
        self.tool(package).join(version).exists()
    }

    /// A shell in the root, with a cargo command of this version, which is installed into `target` if
    /// it is not there.
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
    /// A Python that has these packages of `PyPI`, each with its version, in an environment in `target`.
    pub(crate) fn python_with(&self, packages: &[&str]) -> Result<PathBuf> {
        let sh = self.shell()?;
        let folder = self.tool("python").join(packages.join("_"));
        let stamp = folder.join("installed");
        if !stamp.exists() {
            let make = || cmd!(sh, "python3 -m venv --clear {folder}").run();
            // Debian has the module in a package of its own.
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

/// Installs those packages, if they are not there, which only root can do.
pub(crate) fn from_debian(sh: &Shell, packages: &[&str]) -> Result<()> {
    let state = "--showformat=${db:Status-Status},";
    let query = cmd!(sh, "dpkg-query --show {state} {packages...}");
    if query.ignore_status().ignore_stderr().read()? != "installed,".repeat(packages.len()) {
        // The lists of packages are often out of date. `--no-remove`: rather fail than take away
        // something that someone installed.
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
