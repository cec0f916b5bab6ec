//! The committed list of mutants that no test can notice, each with its reason.

use std::path::Path;

use anyhow::{Context as _, Result};
use serde::Deserialize;

use super::outcome::Survivor;

const LIST: &str = "xtask/known-mutants.toml";

#[derive(Deserialize)]
pub(crate) struct Known {
    mutant: Vec<Entry>,
}

/// One of them. Lines are known by their text, not by their number.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    file: String,
    function: String,
    /// The text of the line; any line of the function unless given.
    line: Option<String>,
    /// What stands there instead; anything unless given.
    replacement: Option<String>,
    /// Why it is equivalent, or which theorem catches it.
    reason: String,
}

impl Entry {
    fn explains(&self, survivor: &Survivor) -> bool {
        let agrees = |wanted: &Option<String>, is: &str| wanted.as_deref().is_none_or(|w| w == is);
        self.file == survivor.file
            && self.function == survivor.function
            && agrees(&self.line, &survivor.line)
            && agrees(&self.replacement, &survivor.replacement)
    }
}

impl Known {
    pub(crate) fn read(root: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(root.join(LIST)).context(LIST)?;
        Self::of(&text)
    }

    fn of(text: &str) -> Result<Self> {
        let known: Self = toml::from_str(text).context(LIST)?;
        let without = known
            .mutant
            .iter()
            .find(|entry| entry.reason.trim().is_empty());
        if let Some(entry) = without {
            anyhow::bail!("{LIST}: {} in {} has no reason", entry.function, entry.file);
        }
        Ok(known)
    }

    pub(crate) fn explains(&self, survivor: &Survivor) -> bool {
        self.mutant.iter().any(|entry| entry.explains(survivor))
    }

    /// Entries for that file which explain none of the survivors: they are to be deleted.
    pub(crate) fn without_survivor(
        &self,
        file: &str,
        survivors: &[Survivor],
    ) -> impl Iterator<Item = String> {
        let entries = self.mutant.iter().filter(move |entry| entry.file == file);
        entries
            .filter(|entry| !survivors.iter().any(|survivor| entry.explains(survivor)))
            .map(|entry| {
                let line = entry.line.as_deref().unwrap_or("any line");
                format!(
                    "{LIST} has a mutant that does not survive: {} in {}, {line}",
                    entry.function, entry.file
                )
            })
    }
}
