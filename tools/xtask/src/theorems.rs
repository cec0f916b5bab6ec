//! The table of theorems in `proofs/README.md`, and which of them a harness is for.

use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result};

/// A row of the table.
pub(crate) struct Theorem {
    /// Its number and its statement up to the first colon.
    pub(crate) title: String,
    /// What is named in it: harnesses, or modules of them.
    names: Vec<String>,
}

/// All rows that are about harnesses.
pub(crate) fn theorems(root: &Path) -> Result<Vec<Theorem>> {
    let readme = root.join("proofs/README.md");
    let readme = fs::read_to_string(&readme).with_context(|| readme.display().to_string())?;
    let rows = readme.lines().filter_map(|line| line.strip_prefix("| "));
    let rows = rows.filter(|row| row.starts_with(|first: char| first.is_ascii_digit()));
    let theorem = |row: &str| {
        let mut columns = row.split(" | ");
        let (number, statement) = (columns.next()?, columns.next()?);
        let harnesses = columns.nth(1)?;
        let statement = statement.split([':', '.', ';']).next()?;
        let names = harnesses.split('`').skip(1).step_by(2);
        Some(Theorem {
            title: format!("{number:<4} {statement}"),
            names: names.map(str::to_owned).collect(),
        })
    };
    rows.map(|row| theorem(row).with_context(|| format!("not a theorem's row: {row}")))
        .collect()
}

impl Theorem {
    /// Whether its row names this harness, or a module that it is in.
    pub(crate) fn is_shown_by(&self, harness: &str) -> bool {
        let mut names = self.names.iter();
        names.any(|name| {
            is_called(harness, name) || format!("::{harness}").contains(&format!("::{name}::"))
        })
    }
}

/// Whether a harness is called that, with or without modules.
pub(crate) fn is_called(harness: &str, end: &str) -> bool {
    format!("::{harness}").ends_with(&format!("::{end}"))
}
