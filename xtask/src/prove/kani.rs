//! Checks harnesses with Kani itself.

use std::fs::{self, File};
use std::time::Duration;

use anyhow::Result;

use super::harness::Harness;
use super::outcome::{Failure, Outcome};
use crate::command::{cargo, output, status_within};
use crate::workspace::Workspace;

/// Name and version, if it is installed and set up.
pub(crate) fn version(workspace: &Workspace) -> Option<String> {
    let answer = output(cargo(workspace).args(["kani", "--version"])).ok()?;
    let version = answer.split_whitespace().nth(1)?;
    Some(format!("Kani {version}"))
}

pub(crate) fn check(workspace: &Workspace, harness: &Harness, limit: Duration) -> Result<Outcome> {
    let folder = workspace.target_directory.join("kani-answers");
    fs::create_dir_all(&folder)?;
    let path = folder.join(harness.name.replace("::", "."));
    let file = File::create(&path)?;
    let mut command = cargo(workspace);
    command
        .args(["kani", "--package", super::PACKAGE, "--exact", "--harness"])
        .arg(format!("harnesses::{}", harness.name))
        .stdout(file.try_clone()?)
        .stderr(file);
    if status_within(limit, &mut command)?.is_none() {
        return Ok(Outcome::no_answer(limit));
    }
    Ok(judge(&fs::read_to_string(path)?))
}

/// Reads the summary lines that Kani ends a harness with. Kani itself calls a harness successful
/// whose covers are not satisfied; here it is not.
fn judge(answer: &str) -> Outcome {
    let mut outcome = Outcome::default();
    let mut successful = false;
    let mut last_check = "";
    for line in answer.lines().map(str::trim) {
        if let Some(says) = line.strip_prefix("- Description: ") {
            last_check = says.trim_matches('"');
        } else if line.starts_with("Failed Checks: ") {
            outcome.failures.push(Failure::new(line));
        } else if let Some(place) = line.strip_prefix("File: ") {
            if let Some(failure) = outcome.failures.last_mut() {
                failure.what = format!("{} at {place}", failure.what);
            }
        } else if line.ends_with("cover properties satisfied") {
            (outcome.covers_satisfied, outcome.covers) = counts(line).unwrap_or_default();
        } else if line.starts_with("** ") && line.contains(" failed") {
            outcome.properties = counts(line).map_or(0, |(_, all)| all);
        }
        successful |= line == "VERIFICATION:- SUCCESSFUL";
    }
    if outcome.covers_satisfied < outcome.covers {
        let missing = outcome.covers - outcome.covers_satisfied;
        outcome
            .failures
            .push(Failure::new(format!("{missing} covers are not satisfied")));
    }
    if !successful && outcome.failures.is_empty() {
        let last = answer.lines().last().unwrap_or_default();
        let what = format!("Kani did not succeed (last check: {last_check}): {last}");
        outcome.failures.push(Failure::new(what));
    }
    outcome
}

/// `** 1 of 2 …`
fn counts(line: &str) -> Option<(usize, usize)> {
    let mut numbers = line.split_whitespace().filter_map(|word| word.parse().ok());
    Some((numbers.next()?, numbers.next()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUCCESS: &str = "\
        SUMMARY:\n ** 0 of 17 failed (1 unreachable)\n\n ** 2 of 2 cover properties satisfied\n\n\
        VERIFICATION:- SUCCESSFUL\nVerification Time: 0.3s\n";

    #[test]
    fn success_is_read_with_its_counts() {
        let outcome = judge(SUCCESS);
        assert!(outcome.is_proved());
        assert_eq!((outcome.properties, outcome.covers), (17, 2));
    }

    #[test]
    fn an_unsatisfied_cover_a_failed_check_and_a_broken_run_fail() {
        let uncovered = SUCCESS.replace("2 of 2", "1 of 2");
        assert!(!judge(&uncovered).is_proved());
        let failed = "Failed Checks: attempt to add with overflow\n File: \"x.rs\", line 3, in f\n\
            VERIFICATION:- FAILED\n";
        let outcome = judge(failed);
        let first = outcome.failures.first();
        assert!(first.is_some_and(|failure| failure.what.contains("overflow at \"x.rs\", line 3")));
        assert!(!judge("error: could not compile").is_proved());
    }
}
