//! Checks the checker: harnesses that must fail, each in its own way.

use anyhow::{Context as _, Result, bail};

use super::cbmc::Cbmc;
use super::harness::{self, Harness};
use super::outcome::Outcome;
use super::{Limits, model, with_cbmc};
use crate::workspace::Workspace;

pub(crate) const PACKAGE: &str = "framelock-self-check";
const HARNESSES: &str = "proofs/self-check/src/harnesses";

pub(crate) fn harnesses(workspace: &Workspace) -> Result<Vec<Harness>> {
    harness::read(&workspace.root, &workspace.root.join(HARNESSES))
}

/// What must come of it, by its documentation.
pub(crate) fn expected(harness: &Harness) -> Result<&str> {
    let expected = harness.expected.as_deref();
    expected.with_context(|| format!("{} has no line `Expected: …`", harness.name))
}

/// Whether that came of it.
pub(crate) fn is_as_expected(expected: &str, outcome: &Outcome) -> bool {
    if expected == "proved" {
        return outcome.is_proved();
    }
    let mut failures = outcome.failures.iter();
    failures.any(|failure| failure.what.contains(expected))
}

/// Returns how many there are; an error if any does not come out as its documentation says.
pub(crate) fn run(workspace: &Workspace, cbmc: &Cbmc, limits: &Limits) -> Result<usize> {
    let harnesses = harnesses(workspace)?;
    let target = model::target(workspace);
    let module = model::compile(&workspace.root, &target, PACKAGE)?;
    let folder = target.join("self-check");
    let results = with_cbmc(cbmc, &module, PACKAGE, &harnesses, &folder, limits);
    let mut wrong = Vec::new();
    println!("\nHarnesses and what must come of them:");
    for (harness, outcome) in &results {
        let expected = expected(harness)?;
        let as_expected = is_as_expected(expected, outcome);
        let word = if as_expected { "yes" } else { "NO" };
        println!("  {word:<4} {:<44} {expected}", harness.name);
        if !as_expected {
            outcome.print_failures(&harness.name);
            wrong.push(harness.name.as_str());
        }
    }
    if !wrong.is_empty() {
        bail!(
            "the checker does not do what it must on {}",
            wrong.join(", ")
        );
    }
    Ok(results.len())
}
