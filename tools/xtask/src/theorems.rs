//! Reads the table in `proofs/README.md`, which lists the harnesses of each theorem. Also defines the types of a
//! prover's list of harnesses and of its answers.

use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result};
use serde::Deserialize;

/// A row of the table: the theorem's number, its statement, the clauses of the protocol, harnesses, tests and fuzz
/// oracles.
pub(crate) struct Theorem(pub(crate) [String; 6]);

/// Returns all rows that begin with a theorem's number.
pub(crate) fn theorems(root: &Path) -> Result<Vec<Theorem>> {
    let readme = fs::read_to_string(root.join("proofs/README.md")).context("proofs/README.md")?;
    let rows = readme.lines().filter_map(|line| line.strip_prefix("| "));
    let rows = rows.filter(|row| row.starts_with(|first: char| first.is_ascii_digit()));
    rows.map(|row| {
        let columns: Vec<String> = row.split(" | ").take(6).map(str::to_owned).collect();
        let columns = columns.try_into().ok();
        columns
            .map(Theorem)
            .with_context(|| format!("not a theorem's row: {row}"))
    })
    .collect()
}

/// Returns the names between backticks.
pub(crate) fn quoted(column: &str) -> impl Iterator<Item = &str> {
    column.split('`').skip(1).step_by(2)
}

impl Theorem {
    /// Returns the theorem's number, such as `13b`.
    pub(crate) fn number(&self) -> &str {
        &self.0[0]
    }

    /// Returns the number, and the statement up to the first colon, full stop or semicolon.
    pub(crate) fn title(&self) -> String {
        let [number, statement, ..] = &self.0;
        let statement = statement.split([':', '.', ';']).next().unwrap_or(statement);
        format!("{number:<4} {statement}")
    }

    /// Returns the names in the row: harnesses, or modules of harnesses.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        quoted(&self.0[3])
    }

    /// Returns whether the row names this harness or a module that contains it.
    pub(crate) fn is_shown_by(&self, harness: &str) -> bool {
        self.names().any(|name| is_named(harness, name))
    }
}

/// Returns whether this is the name of the harness or of a module that contains it.
pub(crate) fn is_named(harness: &str, name: &str) -> bool {
    is_called(harness, name) || format!("::{harness}").contains(&format!("::{name}::"))
}

/// Returns whether a harness has this name, with or without its modules.
pub(crate) fn is_called(harness: &str, end: &str) -> bool {
    format!("::{harness}").ends_with(&format!("::{end}"))
}

/// A harness in the offline prover's list.
#[derive(Deserialize)]
pub(crate) struct Harness {
    pub(crate) name: String,
    /// True if the harness ends with a cover. Kani shows only for such harnesses that some input reaches the end.
    #[cfg(test)]
    pub(crate) ends_with_cover: bool,
}

/// A prover's answer about a harness.
#[derive(Default, Deserialize)]
pub(crate) struct Answer {
    pub(crate) harness: String,
    pub(crate) verdict: String,
    pub(crate) failures: Vec<String>,
    /// The inputs of the counterexample.
    pub(crate) inputs: Vec<String>,
}

impl Answer {
    pub(crate) fn is_proved(&self) -> bool {
        self.verdict == "proved"
    }

    /// Returns whether the engine has shown that the harness fails. A missing answer does not count as a failure.
    pub(crate) fn is_refuted(&self) -> bool {
        !["proved", "error", "no_answer_in_time"].contains(&self.verdict.as_str())
    }

    pub(crate) fn fail(&mut self, verdict: &str, what: &str) {
        verdict.clone_into(&mut self.verdict);
        self.failures.push(what.to_owned());
    }
}
