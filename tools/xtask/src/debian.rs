//! What Debian has packages for.

use anyhow::Result;
use xshell::{Shell, cmd};

/// Installs those packages, if they are not there, which only root can do.
pub(crate) fn install(sh: &Shell, packages: &[&str]) -> Result<()> {
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
