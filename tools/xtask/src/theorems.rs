//! Reads the table in `proofs/README.md`, which lists the harnesses of each theorem. Also reads a prover's answers
//! about harnesses.

use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result};
use serde::Deserialize;

/// A row of the table.
pub(crate) struct Theorem {
    /// The theorem's number, and its statement up to the first colon, full stop or semicolon.
    pub(crate) title: String,
    /// The names in the row: harnesses, or modules of harnesses.
    pub(crate) names: Vec<String>,
    /// The clauses of the protocol, the tests and the fuzz oracles in the row.
    #[cfg_attr(not(test), expect(dead_code, reason = "a test checks that they exist"))]
    pub(crate) others: [Vec<String>; 3],
}

/// Returns all rows about harnesses.
pub(crate) fn theorems(root: &Path) -> Result<Vec<Theorem>> {
    let readme = root.join("proofs/README.md");
    let readme = fs::read_to_string(&readme).with_context(|| readme.display().to_string())?;
    let rows = readme.lines().filter_map(|line| line.strip_prefix("| "));
    let rows = rows.filter(|row| row.starts_with(|first: char| first.is_ascii_digit()));
    let theorem = |row: &str| {
        let mut columns = row.split(" | ");
        let (number, statement, clauses) = (columns.next()?, columns.next()?, columns.next()?);
        let (harnesses, tests, oracles) = (columns.next()?, columns.next()?, columns.next()?);
        let statement = statement.split([':', '.', ';']).next()?;
        let quoted = |column: &str| {
            let names = column.split('`').skip(1).step_by(2);
            names.map(str::to_owned).collect()
        };
        Some(Theorem {
            title: format!("{number:<4} {statement}"),
            names: quoted(harnesses),
            others: [
                clauses.split(", ").map(str::to_owned).collect(),
                quoted(tests),
                quoted(oracles),
            ],
        })
    };
    rows.map(|row| theorem(row).with_context(|| format!("not a theorem's row: {row}")))
        .collect()
}

impl Theorem {
    /// Returns the theorem's number, such as `13b`.
    pub(crate) fn number(&self) -> &str {
        self.title.split(' ').next().unwrap_or(&self.title)
    }

    /// Returns whether the row names this harness or a module that contains it.
    pub(crate) fn is_shown_by(&self, harness: &str) -> bool {
        self.names.iter().any(|name| is_named(harness, name))
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
    /// True if the harness ends with a cover, which shows that some input reaches the end. Kani does not require such a
    /// cover.
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
