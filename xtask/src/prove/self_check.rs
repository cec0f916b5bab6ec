//! Checks the checker: harnesses that must fail, each in its own way.

use anyhow::{Context as _, Result, bail};

use super::cbmc::Cbmc;
use super::{Limits, harness, model, with_cbmc};
use crate::workspace::Workspace;

const PACKAGE: &str = "framelock-self-check";
const HARNESSES: &str = "proofs/self-check/src/harnesses";

/// Returns how many there are; an error if any does not come out as its documentation says.
pub(crate) fn run(workspace: &Workspace, cbmc: &Cbmc, limits: &Limits) -> Result<usize> {
    let harnesses = harness::read(&workspace.root, &workspace.root.join(HARNESSES))?;
    let target = model::target(workspace);
    let module = model::compile(&workspace.root, &target, PACKAGE)?;
    let folder = target.join("self-check");
    let results = with_cbmc(cbmc, &module, PACKAGE, &harnesses, &folder, limits);
    let mut wrong = Vec::new();
    println!("\nHarnesses and what must come of them:");
    for (harness, outcome) in &results {
        let expected = harness
            .expected
            .as_deref()
            .context("no line `Expected: …`")?;
        let mut found = outcome.failures.iter().map(|failure| failure.what.as_str());
        let as_expected = if expected == "proved" {
            outcome.is_proved()
        } else {
            found.any(|failure| failure.contains(expected))
        };
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
