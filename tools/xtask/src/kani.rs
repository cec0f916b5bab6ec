//! Kani: checks whether it is set up, runs it and reads its answers.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::{env, fs};

use anyhow::{Context as _, Result, ensure};

use crate::theorems::Answer;

/// Returns the version of Kani, or an error if Kani is not set up. Only reads folders, because calling `cargo kani`
/// would start the setup if Kani is installed but not set up.
pub(crate) fn version() -> Result<String> {
    let home = env::var_os("KANI_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(env::home_dir()?.join(".kani")));
    let files = fs::read_dir(home.unwrap_or_default()).into_iter().flatten();
    let names = files.filter_map(|file| file.ok()?.file_name().into_string().ok());
    let names: Vec<String> = names.collect();
    // If the downloaded bundle still exists, it was not unpacked completely.
    let unfinished = names.iter().any(|name| name.ends_with(".tar.gz"));
    let mut versions = names.iter().filter_map(|name| name.strip_prefix("kani-"));
    let version = versions.next().filter(|_| !unfinished);
    let version = version.context("Kani is not set up: `cargo kani setup`")?;
    Ok(format!("Kani {version}"))
}

/// Lets Kani check the harnesses with exactly these names. Without names, checks all harnesses.
pub(crate) fn check(command: &mut Command, names: &[String]) -> Result<Vec<Answer>> {
    command.env("NO_COLOR", "1");
    command.args((!names.is_empty()).then_some("--exact"));
    command.args(names.iter().flat_map(|name| ["--harness", name]));
    let lines = lines_of(command)?;
    let mut answers = answers(&lines);
    // Kani's sum, such as `Complete - 170 successfully verified harnesses, 1 failures, 171 total.`
    let sum = lines
        .iter()
        .find_map(|line| line.strip_prefix("Complete - "));
    let sum = sum.context("Kani did not finish: see above")?;
    let total = format!(" {} total.", answers.len());
    ensure!(
        sum.ends_with(&total),
        "the number of reports read differs from Kani's own sum: {sum}"
    );
    for name in names {
        ensure!(answers.contains_key(name), "Kani did not check {name}");
    }
    for (harness, answer) in &mut answers {
        harness.clone_into(&mut answer.harness);
        if answer.verdict.is_empty() {
            answer.fail("error", "Kani did not report on this harness");
        }
    }
    Ok(answers.into_values().collect())
}

/// Reads Kani's terse output. Several of Kani's threads write this output, and the first line of each report names the
/// thread.
fn answers(lines: &[String]) -> BTreeMap<String, Answer> {
    let mut answers = BTreeMap::<String, Answer>::new();
    let mut harness_of = BTreeMap::new();
    let mut thread = "";
    for line in lines {
        let named = line
            .strip_prefix("Thread ")
            .and_then(|rest| rest.split_once(": "));
        let line = match named {
            Some((number, rest)) => {
                thread = number;
                rest.trim()
            }
            None => line.trim(),
        };
        if let Some(name) = line.strip_prefix("Checking harness ") {
            harness_of.insert(thread, name.trim_end_matches("..."));
        }
        let Some(&name) = harness_of.get(thread) else {
            continue;
        };
        let answer = answers.entry(name.to_owned()).or_default();
        if line.starts_with("Failed Checks: ") {
            let bound = line.contains("unwinding assertion");
            answer.fail(
                if bound {
                    "unwinding_too_small"
                } else {
                    "failed"
                },
                line,
            );
        } else if line.starts_with("File: ")
            && let Some(last) = answer.failures.last_mut()
        {
            *last = format!("{last} {line}");
        } else if line.starts_with("** ") && line.contains("cover properties satisfied") {
            // A line such as `** 1 of 2 cover properties satisfied (1 unreachable)`
            let words: Vec<&str> = line.split(' ').collect();
            if !matches!(words.as_slice(), ["**", satisfied, "of", all, ..] if satisfied == all) {
                answer.fail("cover_unsatisfied", line);
            }
        } else if line.starts_with("CBMC timed out") {
            answer.fail("no_answer_in_time", line);
        } else if line.starts_with("CBMC failed") || line.contains("undetermined") {
            answer.fail("error", line);
        } else if line == "VERIFICATION:- SUCCESSFUL" && answer.failures.is_empty() {
            "proved".clone_into(&mut answer.verdict);
        }
    }
    answers
}

/// Runs the command. Prints the lines of its output, and returns them.
fn lines_of(command: &mut Command) -> Result<Vec<String>> {
    let mut child = command.stdout(Stdio::piped()).spawn()?;
    let output = BufReader::new(child.stdout.take().context("standard output is piped")?);
    let printed = |line: &std::io::Result<String>| println!("{}", line.as_deref().unwrap_or("?"));
    let lines = output.lines().inspect(printed).collect::<Result<_, _>>()?;
    child.wait()?;
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_thread_reports_on_its_own_harness() {
        let lines = [
            "Thread 1: Checking harness one...",
            "Thread 2: Checking harness two...",
            "Thread 1: ",
            "Failed Checks: assertion failed: false",
            "VERIFICATION:- FAILED",
            "Thread 2:  ** 1 of 1 cover properties satisfied",
            "VERIFICATION:- SUCCESSFUL",
            "Thread 1: Checking harness three...",
            "** 0 of 1 cover properties satisfied",
            "VERIFICATION:- SUCCESSFUL",
        ];
        let answers = answers(&lines.map(str::to_owned));
        let verdict = |name| answers.get(name).map(|one| &*one.verdict);
        assert_eq!(verdict("one"), Some("failed"));
        assert_eq!(verdict("two"), Some("proved"));
        assert_eq!(verdict("three"), Some("cover_unsatisfied"));
    }

    /// Returns the verdict about a harness for which Kani prints these lines.
    fn verdict(lines: &[&str]) -> String {
        let lines = ["Thread 1: Checking harness module::harness..."]
            .iter()
            .chain(lines);
        let lines: Vec<String> = lines.map(|&line| line.to_owned()).collect();
        let answers = answers(&lines);
        answers
            .get("module::harness")
            .map_or_else(String::new, |one| one.verdict.clone())
    }

    #[test]
    fn a_harness_is_proved_only_if_everything_that_kani_prints_says_so() {
        const PROVED: [&str; 2] = [
            "Thread 1:  ** 2 of 2 cover properties satisfied",
            "VERIFICATION:- SUCCESSFUL",
        ];
        let after = |line| verdict(&[&[line][..], &PROVED].concat());
        assert_eq!(verdict(&PROVED), "proved");
        assert_eq!(after("Failed Checks: assertion failed: true"), "failed");
        assert_eq!(
            after("Failed Checks: unwinding assertion loop 0"),
            "unwinding_too_small"
        );
        assert_eq!(
            after("** 1 of 2 cover properties satisfied"),
            "cover_unsatisfied"
        );
        assert_eq!(
            after("CBMC timed out. You may want to rerun"),
            "no_answer_in_time"
        );
        assert_eq!(after("CBMC failed with status 6"), "error");
        assert_eq!(after("** 0 of 9 failed (9 undetermined)"), "error");
        assert_eq!(verdict(&["VERIFICATION:- FAILED"]), "");
        assert_eq!(verdict(&[]), "", "`check` makes this an error");
    }
}
