//! The table at the end, and the line below it.

use std::time::Duration;

use comfy_table::{Table, presets};

use crate::stage::Report;

/// What became of one stage.
pub(crate) struct Row {
    pub(crate) stage: &'static str,
    pub(crate) report: Report,
    pub(crate) time: Duration,
    /// Why it failed, if it did.
    pub(crate) failure: Option<String>,
}

/// A table without rows, as all are that are printed here.
pub(crate) fn with_header<const COLUMNS: usize>(header: [&str; COLUMNS]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN).set_header(header);
    table
}

/// Stage, engine, time and result, one row each.
pub(crate) fn table(rows: &[Row]) -> Table {
    let mut table = with_header(["stage", "engine", "time", "result"]);
    for row in rows {
        let word = if row.failure.is_some() {
            "FAILED"
        } else {
            "passed"
        };
        let result = if row.report.extent.is_empty() {
            word.to_owned()
        } else {
            format!("{word} ({})", row.report.extent)
        };
        table.add_row([
            row.stage.to_owned(),
            match row.report.engine.as_str() {
                "" => "none".to_owned(),
                engine => engine.to_owned(),
            },
            format!("{:.1} s", row.time.as_secs_f64()),
            result,
        ]);
    }
    table
}

/// The last line: the tests that passed, and the tests that failed. A stage that failed without
/// a failed test counts as one, so that the line never says `0 failed` after a failure.
pub(crate) fn last_line(rows: &[Row]) -> String {
    let passed: usize = rows.iter().map(|row| row.report.tests.passed).sum();
    let failed: usize = rows
        .iter()
        .map(|row| {
            let tests = row.report.tests;
            let stage = usize::from(row.failure.is_some());
            (tests.failed + tests.unfinished()).max(stage)
        })
        .sum();
    format!("{passed} passed, {failed} failed")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_count::TestCount;

    fn row(passed: usize, failed: usize, failure: Option<&str>) -> Row {
        Row {
            stage: "stage",
            report: Report {
                engine: "engine 1.0".to_owned(),
                extent: String::new(),
                tests: TestCount {
                    announced: passed + failed,
                    passed,
                    failed,
                    ignored: 0,
                },
            },
            time: Duration::from_millis(1234),
            failure: failure.map(str::to_owned),
        }
    }

    #[test]
    fn tests_are_added_up() {
        let rows = [row(0, 0, None), row(40, 0, None), row(2, 0, None)];
        assert_eq!(last_line(&rows), "42 passed, 0 failed");
    }

    #[test]
    fn failed_tests_count_each() {
        let rows = [row(40, 3, Some("tests failed"))];
        assert_eq!(last_line(&rows), "40 passed, 3 failed");
    }

    #[test]
    fn tests_without_a_result_count_as_failed() {
        let mut crashed = row(5, 1, Some("crashed"));
        crashed.report.tests.announced += 3;
        assert_eq!(last_line(&[crashed]), "5 passed, 4 failed");
    }

    #[test]
    fn a_stage_that_failed_without_a_failed_test_counts_as_one() {
        let rows = [row(0, 0, Some("not formatted")), row(5, 0, Some("crashed"))];
        assert_eq!(last_line(&rows), "5 passed, 2 failed");
    }

    #[test]
    fn a_row_tells_engine_time_and_result() {
        let shown = table(&[row(1, 0, None), row(0, 0, Some("why"))]).to_string();
        for part in ["engine 1.0", "1.2 s", "passed", "FAILED"] {
            assert!(shown.contains(part), "{part:?} is missing in:\n{shown}");
        }
    }
}
