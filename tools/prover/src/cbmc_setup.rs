//! Finds CBMC, or unpacks Debian's packages of CBMC into a folder next to the prover.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::child_processes::output;

const UNPACK: &str = include_str!("unpack-cbmc.sh");

const BY_HAND: &str = "install CBMC 6 so that `cbmc` is in PATH \
    (https://github.com/diffblue/cbmc/releases), or Kani (`cargo install --locked kani-verifier && \
    cargo kani setup`)";

/// A CBMC that is ready to run.
pub(crate) struct Cbmc {
    pub(crate) program: PathBuf,
    /// CBMC's name, version and origin.
    pub(crate) says: String,
}

/// Returns the CBMC in PATH if it has the right version. Otherwise returns Debian's CBMC, and unpacks it into `folder`
/// if necessary.
pub(crate) fn find(folder: &Path) -> Result<Cbmc> {
    if let Ok(version) = version(Path::new("cbmc")) {
        if version.starts_with("6.") {
            return Ok(Cbmc {
                program: "cbmc".into(),
                says: format!("CBMC {version} (in PATH)"),
            });
        }
        eprintln!("The CBMC in PATH is {version}; the proofs need 6.x");
    }
    if !folder.exists() {
        eprintln!("Unpacking Debian's CBMC into {}", folder.display());
        output(Command::new("sh").args(["-c", UNPACK, "sh"]).arg(folder))
            .with_context(|| format!("CBMC is missing and could not be set up: {BY_HAND}"))?;
    }
    let program = folder.join("cbmc");
    let version = version(&program)
        .with_context(|| format!("{} does not run: {BY_HAND}", program.display()))?;
    Ok(Cbmc {
        program,
        says: format!("CBMC {version} (Debian's)"),
    })
}

fn version(program: &Path) -> Result<String> {
    let answer = output(Command::new(program).arg("--version"))?;
    let version = answer.split_whitespace().next();
    Ok(version
        .context("the program does not print its version")?
        .to_owned())
}
