//! The stage that checks the core under every subset of its optional features.

use anyhow::{Result, bail};

use crate::command::{cargo, run};
use crate::lints::clippy_version;
use crate::stage::Report;
use crate::workspace::{CORE, Workspace};

/// No warning in the core under any subset of its features.
pub(crate) fn every_subset(workspace: &Workspace, report: &mut Report) -> Result<()> {
    report.engine = clippy_version(workspace)?;
    let features = workspace.package(CORE)?.optional_features();
    let subsets = subsets(&features);
    report.extent = format!("{} combinations", subsets.len());

    let mut failed = Vec::new();
    for subset in &subsets {
        let mut command = cargo(workspace);
        command.args(["clippy", "--package", CORE, "--no-default-features"]);
        if !subset.is_empty() {
            command.args(["--features", &subset.join(",")]);
        }
        // All of them, even after a failure: which ones fail says where to look.
        if let Err(error) = run(command.args(["--", "-Dwarnings"])) {
            failed.push(format!("{error:#}"));
        }
    }
    if !failed.is_empty() {
        bail!(
            "{} of {} combinations failed:\n{}",
            failed.len(),
            subsets.len(),
            failed.join("\n")
        );
    }
    Ok(())
}

/// Every subset, the empty one first.
fn subsets<'a>(features: &[&'a str]) -> Vec<Vec<&'a str>> {
    let mut subsets = vec![vec![]];
    for feature in features {
        for mut subset in subsets.clone() {
            subset.push(*feature);
            subsets.push(subset);
        }
    }
    subsets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_features_there_is_the_empty_subset() {
        assert_eq!(subsets(&[]), [Vec::<&str>::new()]);
    }

    #[test]
    fn every_subset_comes_once() {
        assert_eq!(
            subsets(&["a", "b", "c"]),
            [
                vec![],
                vec!["a"],
                vec!["b"],
                vec!["a", "b"],
                vec!["c"],
                vec!["a", "c"],
                vec!["b", "c"],
                vec!["a", "b", "c"],
            ]
        );
    }
}
