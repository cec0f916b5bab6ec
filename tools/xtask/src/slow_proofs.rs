//! The harnesses that take more than 20 s. Without `--all`, `cargo xtask verify` proves them only if their sources have
//! changed since the last proof.

use std::fs;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::Path;

use anyhow::{Context as _, Result};
use serde::Deserialize;

use crate::theorems::is_called;
use crate::workspace::files;

/// The file that lists the slow harnesses. It also records the hash of the list and of the sources at the last proof of
/// all these harnesses.
const RECORD: &str = "proofs/slow-harnesses.toml";
/// The folders with the sources of the slow harnesses and of the prover.
const SOURCES: [&str; 4] = [
    "core/src",
    "formats/src",
    "tools/prover/src",
    "tools/prover/stand-in",
];

#[derive(Deserialize)]
pub(crate) struct SlowProofs {
    pub(crate) harnesses: Vec<String>,
    /// The hash at the last proof of all slow harnesses.
    proved: String,
    /// The hash of the list and of the sources as they are now.
    #[serde(skip)]
    now: String,
}

impl SlowProofs {
    /// Reads the record, and hashes the list and the sources.
    pub(crate) fn load(root: &Path) -> Result<Self> {
        let text = fs::read_to_string(root.join(RECORD)).context(RECORD)?;
        let mut slow: Self = toml::from_str(&text).context(RECORD)?;
        let mut hasher = DefaultHasher::new();
        slow.harnesses.hash(&mut hasher);
        for folder in SOURCES {
            for file in files(&root.join(folder))? {
                file.strip_prefix(root)?.hash(&mut hasher);
                fs::read(&file)?.hash(&mut hasher);
            }
        }
        slow.now = format!("{:016x}", hasher.finish());
        Ok(slow)
    }

    /// Returns whether the harnesses were proved with the sources as they are now.
    pub(crate) fn are_current(&self) -> bool {
        self.proved == self.now
    }

    /// Returns whether this is a slow harness.
    pub(crate) fn contains(&self, harness: &str) -> bool {
        self.harnesses.iter().any(|slow| is_called(harness, slow))
    }

    /// Returns a remark that the harnesses are not checked.
    pub(crate) fn skipped(&self) -> String {
        let count = self.harnesses.len();
        format!("{count} slow harnesses were proved earlier with the same sources, see {RECORD}")
    }

    /// Records that all harnesses were proved with the sources as they are now.
    pub(crate) fn record(&self, root: &Path) -> Result<()> {
        if !self.are_current() {
            let text = fs::read_to_string(root.join(RECORD))?;
            fs::write(root.join(RECORD), text.replace(&self.proved, &self.now))?;
            println!("{RECORD} records these proofs; commit it with the sources");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::Workspace;

    #[test]
    fn a_changed_source_makes_the_slow_proofs_run_until_they_are_recorded() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let root = &workspace.target.join("slow-proofs");
        if root.exists() {
            fs::remove_dir_all(root).expect("removed");
        }
        let write = |file: &str, text: &str| {
            let path = root.join(file);
            fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
            fs::write(path, text).expect("written");
        };
        write(RECORD, "proved = \"unknown\"\nharnesses = [\"slow\"]\n");
        for folder in SOURCES {
            write(&format!("{folder}/lib.rs"), "");
        }
        let load = || SlowProofs::load(root).expect("a record");
        assert!(!load().are_current());
        load().record(root).expect("written");
        assert!(load().are_current());
        assert!(load().contains("module::slow") && !load().contains("module::not_slow"));
        for folder in SOURCES {
            write(&format!("{folder}/module/deep.rs"), "// changed");
            assert!(!load().are_current(), "{folder}");
            load().record(root).expect("written");
        }
        let one_more = fs::read_to_string(root.join(RECORD)).expect("a record");
        write(RECORD, &one_more.replace('[', "[\"added\", "));
        assert!(!load().are_current(), "a harness is added to the list");
        load().record(root).expect("written");
        fs::rename(root.join("core/src/lib.rs"), root.join("core/src/moved.rs")).expect("moved");
        assert!(!load().are_current());
    }
}
