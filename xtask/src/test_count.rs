//! Counting tests, from the lines in which the test programs announce them and sum them up.

use std::fmt;
use std::ops::AddAssign;

/// How many tests had which result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TestCount {
    /// How many the test programs set out to run, those ignored included.
    pub(crate) announced: usize,
    pub(crate) passed: usize,
    pub(crate) failed: usize,
    pub(crate) ignored: usize,
}

impl TestCount {
    /// Counts what a line of a test program's output tells. Most lines tell nothing.
    pub(crate) fn from_line(line: &str) -> Self {
        announcement(line)
            .or_else(|| sums(line))
            .unwrap_or_default()
    }

    /// How many came to an end.
    pub(crate) fn executed(self) -> usize {
        self.passed + self.failed
    }

    /// How many were announced but have no result: their program ended in the midst of them,
    /// possibly with an exit code that claims success.
    pub(crate) fn unfinished(self) -> usize {
        self.announced
            .saturating_sub(self.executed() + self.ignored)
    }
}

/// Reads a line such as `running 5 tests`.
fn announcement(line: &str) -> Option<TestCount> {
    let number = line.strip_prefix("running ")?;
    let number = number
        .strip_suffix(" tests")
        .or_else(|| number.strip_suffix(" test"))?;
    Some(TestCount {
        announced: number.parse().ok()?,
        ..TestCount::default()
    })
}

/// Reads a line such as
/// `test result: ok. 5 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; ...`.
fn sums(line: &str) -> Option<TestCount> {
    let sums = line.strip_prefix("test result: ")?;
    let number = |label: &str| {
        sums.split(';').find_map(|sum| {
            let mut words = sum.split_whitespace().rev();
            (words.next()? == label).then(|| words.next()?.parse().ok())?
        })
    };
    Some(TestCount {
        announced: 0,
        passed: number("passed")?,
        failed: number("failed")?,
        ignored: number("ignored")?,
    })
}

impl AddAssign for TestCount {
    fn add_assign(&mut self, other: Self) {
        self.announced += other.announced;
        self.passed += other.passed;
        self.failed += other.failed;
        self.ignored += other.ignored;
    }
}

impl fmt::Display for TestCount {
    /// Such as `45 tests, 1 failed, 2 ignored`, without what there was none of.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} tests", self.executed())?;
        for (count, what) in [
            (self.failed, "failed"),
            (self.unfinished(), "unfinished"),
            (self.ignored, "ignored"),
        ] {
            if count > 0 {
                write!(formatter, ", {count} {what}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the lines of an output tell, added up.
    fn count(lines: &[&str]) -> TestCount {
        let mut count = TestCount::default();
        for line in lines {
            count += TestCount::from_line(line);
        }
        count
    }

    #[test]
    fn reads_a_success() {
        let count = count(&[
            "running 7 tests",
            "test result: ok. 5 passed; 0 failed; 2 ignored; 0 measured; 0 filtered out; finished in 0.00s",
        ]);
        let expected = TestCount {
            announced: 7,
            passed: 5,
            failed: 0,
            ignored: 2,
        };
        assert_eq!(count, expected);
        assert_eq!(count.unfinished(), 0);
    }

    #[test]
    fn adds_up_several_programs_with_a_failure() {
        let count = count(&[
            "running 1 test",
            "test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s",
            "running 15 tests",
            "test result: FAILED. 12 passed; 3 failed; 0 ignored; 0 measured; 1 filtered out; finished in 4.20s",
        ]);
        let expected = TestCount {
            announced: 16,
            passed: 13,
            failed: 3,
            ignored: 0,
        };
        assert_eq!(count, expected);
        assert_eq!(count.executed(), 16);
    }

    #[test]
    fn reads_a_coloured_line() {
        let count = count(&[
            "test result: \u{1b}[32mok\u{1b}(B\u{1b}[m. 7 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s",
        ]);
        assert_eq!(count.passed, 7);
    }

    #[test]
    fn a_program_that_ended_in_the_midst_of_its_tests_is_noticed() {
        let count = count(&["running 3 tests", "test one ... ok"]);
        assert_eq!(count.executed(), 0);
        assert_eq!(count.unfinished(), 3);
    }

    #[test]
    fn passes_over_other_lines() {
        for line in [
            "",
            "running all tests",
            "test tests::reads_a_success ... ok",
            "test result: ok.",
            "test result: ok. many passed; 0 failed; 0 ignored",
        ] {
            assert_eq!(TestCount::from_line(line), TestCount::default(), "{line:?}");
        }
    }

    #[test]
    fn shows_what_there_was() {
        let mut count = TestCount {
            announced: 44,
            passed: 44,
            failed: 0,
            ignored: 0,
        };
        assert_eq!(count.to_string(), "44 tests");
        count.announced = 50;
        count.failed = 1;
        count.ignored = 2;
        assert_eq!(
            count.to_string(),
            "45 tests, 1 failed, 3 unfinished, 2 ignored"
        );
    }
}
