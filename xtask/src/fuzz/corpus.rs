//! The corpora: those committed, those found here, and how small they can be.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};

use super::Target;
use super::setup::Fuzzer;
use crate::command::run;
use crate::firmware::images;
use crate::firmware_tests::IMAGES;
use crate::workspace::Workspace;

/// The committed one.
pub(crate) fn committed(workspace: &Workspace, target: Target) -> PathBuf {
    workspace.root.join("fuzz/corpus").join(target.name())
}

/// Inputs that were found on this machine.
pub(crate) fn found_here(workspace: &Workspace, target: Target) -> PathBuf {
    let folder = workspace.target_directory.join("fuzz-corpus");
    folder.join(target.name())
}

/// Adds to the committed corpus the fewest and smallest inputs found here that reach what it does
/// not. What is committed stays: the inputs with names are there for what they are.
pub(crate) fn minimise(workspace: &Workspace, fuzzer: &Fuzzer, target: Target) -> Result<()> {
    let found = found_here(workspace, target);
    ensure!(
        found.exists(),
        "nothing has been found here yet: fuzz first"
    );
    let committed = committed(workspace, target);
    for entry in fs::read_dir(&committed)? {
        let path = entry?.path();
        // What the fuzzer has named, by the input's hash, is what it may choose again.
        if is_hash(&path) {
            fs::copy(&path, found.join(path.file_name().unwrap_or_default()))?;
            fs::remove_file(&path)?;
        }
    }
    run(fuzzer
        .command("run")?
        .arg(target.name())
        .args([&committed, &found])
        .args(["--", "-merge=1"])
        .arg(format!(
            "-use_counters={}",
            u8::from(target.is_of_numbers())
        ))
        .arg(format!("-max_len={}", target.longest_input()))
        .env(IMAGES, images(workspace, &workspace.root)))
}

fn is_hash(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.is_some_and(|name| name.len() == 40 && name.bytes().all(|byte| byte.is_ascii_hexdigit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_that_have_a_name_are_told_from_those_the_fuzzer_named() {
        assert!(is_hash(Path::new(
            "a/da39a3ee5e6b4b0d3255bfef95601890afd80709"
        )));
        assert!(!is_hash(Path::new("a/deaf-lecture-machine")));
    }
}
