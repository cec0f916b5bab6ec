//! The report of a stage of `verify`, and the tests that a stage runs and counts.

use std::io::{BufRead as _, BufReader};
use std::ops::AddAssign;
use std::process::{Command, Stdio};

use anyhow::{Context as _, Result, ensure};

/// A stage's report about itself. The stage fills in the report while it runs, so the report is available even if the
/// stage fails.
#[derive(Default)]
pub(crate) struct Report {
    /// A remark, such as the tool that was used or the amount of work. May be empty.
    pub(crate) says: String,
    pub(crate) tests: TestCount,
}

/// Runs tests and counts them. The command's exit code does not suffice, because a test may end its program with exit
/// code 0 before the remaining tests have run.
pub(crate) fn run_tests(command: &mut Command, count: &mut TestCount) -> Result<()> {
    eprintln!("$ {command:?}");
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .context("cargo could not be started")?;
    for line in BufReader::new(child.stdout.take().context("standard output is piped")?).lines() {
        let line = line?;
        println!("{line}");
        *count += TestCount::of_line(&line);
    }
    let status = child.wait()?;
    ensure!(status.success(), "`{command:?}` ended with {status}");
    ensure!(
        count.without_result == 0,
        "{} tests have no result, because their program ended too early",
        count.without_result
    );
    ensure!(count.passed > 0, "no test was run");
    Ok(())
}

/// Counts of test outcomes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TestCount {
    pub(crate) passed: usize,
    pub(crate) failed: usize,
    /// Tests that were announced, but have neither passed, failed nor been ignored.
    without_result: isize,
}

impl TestCount {
    /// Counts the tests in a line such as `running 5 tests` or `test result: ok. 5 passed; 0
    /// failed; …`.
    pub(crate) fn of_line(line: &str) -> Self {
        let words: Vec<&str> = line.split([' ', ';']).collect();
        let number_before = |label| {
            let at = words.iter().position(|word| *word == label)?;
            words.get(at.checked_sub(1)?)?.parse::<usize>().ok()
        };
        let mut count = Self::default();
        if line.starts_with("running ") {
            let tests = number_before("tests").or_else(|| number_before("test"));
            count.without_result = tests.unwrap_or(0).cast_signed();
        } else if line.starts_with("test result: ") {
            count.passed = number_before("passed").unwrap_or(0);
            count.failed = number_before("failed").unwrap_or(0);
            let ended = count.passed + count.failed + number_before("ignored").unwrap_or(0);
            count.without_result = -ended.cast_signed();
        }
        count
    }
}

impl AddAssign for TestCount {
    fn add_assign(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.without_result += other.without_result;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_are_counted_including_those_without_a_result() {
        let mut count = TestCount::default();
        for line in [
            "running 8 tests",
            "test result: FAILED. 4 passed; 1 failed; 2 ignored; 0 measured; 0 filtered out",
            "running 1 test",
            "test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out",
        ] {
            count += TestCount::of_line(line);
        }
        let expected = TestCount {
            passed: 5,
            failed: 1,
            without_result: 1,
        };
        assert_eq!(count, expected);
    }
}
