//! Counts tests in the output of a command.

use std::ops::AddAssign;

/// Counts of test outcomes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TestCount {
    pub(crate) passed: usize,
    pub(crate) failed: usize,
    /// Tests that were announced, but have neither passed, failed nor been ignored.
    pub(crate) without_result: isize,
}

impl TestCount {
    /// Counts the tests in a line such as `running 5 tests`, `test result: ok. 5 passed; 0 failed; …`, or
    /// `5 proved, 0 failed`.
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
            let ended = count.ended() + number_before("ignored").unwrap_or(0);
            count.without_result = -ended.cast_signed();
        } else if let Some(line) = line.strip_suffix(" failed")
            && let Some((proved, failed)) = line.split_once(" proved, ")
            && let (Ok(proved), Ok(failed)) = (proved.parse(), failed.parse())
        {
            (count.passed, count.failed) = (proved, failed);
        }
        count
    }

    /// Returns the number of tests that have passed or failed.
    pub(crate) fn ended(self) -> usize {
        self.passed + self.failed
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
