//! `cargo xtask verify`: runs the stages, and adds up their results.

use std::io::{BufRead as _, BufReader};
use std::process::Stdio;
use std::time::Instant;

use anyhow::{Context as _, Result, ensure};
use clap::builder::PossibleValuesParser;

use crate::test_count::TestCount;
use crate::workspace::Workspace;

/// One check: a function of `stages.sh` that follows a line `#= NAME: CHECKS`, or `#= NAME (--all): CHECKS`.
struct Stage {
    /// The stage's name for `--only`. Its function has underscores for the hyphens.
    name: &'static str,
    /// The check in one line.
    checks: &'static str,
    /// True if the stage runs only with `--all` or `--only`. The hosted machines run it every night.
    is_nightly: bool,
}

/// Returns the stages in the order in which they run. Stages that fail fast come first.
fn stages() -> impl Iterator<Item = Stage> {
    let lines = include_str!("../stages.sh").lines();
    lines.filter_map(|line| {
        let (name, checks) = line.strip_prefix("#= ")?.split_once(": ")?;
        let nightly = name.strip_suffix(" (--all)");
        Some(Stage {
            name: nightly.unwrap_or(name),
            checks,
            is_nightly: nightly.is_some(),
        })
    })
}

const EXAMPLES: &str = "\
Examples:
  cargo xtask verify                              the stages that each commit must pass
  cargo xtask verify --all                        also the stages that take hours
  cargo xtask verify --list                       the stages and what they check
  cargo xtask verify --only format --only clippy  two stages, for a quick answer

Tools that a check needs are installed if possible. All stages run, even after one has \
failed. The exit code is 1 if any stage failed, and the last line counts the tests: \
\"N passed, M failed\", where a failed stage that is not a test counts as one.";

/// Run the checks, and install what they need
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Run only this stage; can be given more than once
    #[arg(long, value_name = "STAGE", value_parser = PossibleValuesParser::new(stages().map(|stage| stage.name)))]
    only: Vec<String>,

    /// Run every stage
    #[arg(long, conflicts_with = "only")]
    all: bool,

    /// List the stages and their checks instead of running them
    #[arg(long, conflicts_with_all = ["only", "all"])]
    list: bool,
}

impl Arguments {
    fn wants(&self, stage: &Stage) -> bool {
        if self.only.is_empty() {
            self.all || !stage.is_nightly
        } else {
            self.only.iter().any(|name| name == stage.name)
        }
    }
}

/// Runs the stages that the arguments choose. Returns whether all pass.
pub(crate) fn verify(workspace: &Workspace, arguments: &Arguments) -> bool {
    if arguments.list {
        for stage in stages() {
            let when = if stage.is_nightly { " (--all)" } else { "" };
            println!("{:<12} {}{when}", stage.name, stage.checks);
        }
        return true;
    }
    let (mut passed, mut failed) = (0, 0);
    let (mut lines, mut failures) = (Vec::new(), Vec::new());
    for stage in stages().filter(|stage| arguments.wants(stage)) {
        let name = stage.name;
        println!("\n=== {name}: {} ===", stage.checks);
        let (start, mut report) = (Instant::now(), Report::default());
        let outcome = run(workspace, name, &mut report);
        let word = if outcome.is_ok() { "passed" } else { "FAILED" };
        let seconds = start.elapsed().as_secs_f64();
        let count = report.tests.ended();
        let tests = (count > 0).then(|| format!("{count} tests"));
        let (tests, notes) = (tests.unwrap_or_default(), report.notes.join("; "));
        lines.push(format!(
            "{name:<12} {word} {seconds:7.1} s  {tests:<11}{notes}"
        ));
        passed += report.tests.passed;
        failed += report.tests.failed;
        if let Err(error) = outcome {
            println!("FAILED: {name}: {error:#}");
            failures.push(format!("FAILED: {name}: {error:#}\n"));
            // Count the stage itself, so that the last line never says `0 failed` after a failure.
            failed += usize::from(report.tests.failed == 0);
        }
    }
    println!("\n{}\n\n{}", lines.join("\n"), failures.join("\n"));
    println!("{passed} passed, {failed} failed");
    failures.is_empty()
}

/// The results that a stage has printed.
#[derive(Default)]
struct Report {
    tests: TestCount,
    /// Remarks, such as the tool that was chosen.
    notes: Vec<String>,
    /// The commands that must run tests, each with the number of tests that had ended before the command began.
    announced: Vec<(String, usize)>,
}

impl Report {
    fn read(&mut self, line: &str) {
        if let Some(note) = line.strip_prefix("remark: ") {
            if !self.notes.iter().any(|known| known == note) {
                self.notes.push(note.to_owned());
            }
        } else if let Some(command) = line.strip_prefix("tests: ") {
            self.announced
                .push((command.to_owned(), self.tests.ended()));
        }
        self.tests += TestCount::of_line(line);
    }

    /// Checks that each command ran a test, that each announced test has a result, and that no test failed. Exit codes
    /// do not suffice, because a test may end its program with exit code 0 before the remaining tests have run.
    fn check(&self) -> Result<()> {
        let ends = self.announced.iter().skip(1).map(|(_, before)| *before);
        let ends = ends.chain([self.tests.ended()]);
        for ((command, before), end) in self.announced.iter().zip(ends) {
            ensure!(*before < end, "no test was run by `{command}`");
        }
        ensure!(
            self.tests.without_result == 0,
            "{} tests have no result, because their program ended too early",
            self.tests.without_result
        );
        ensure!(self.tests.failed == 0, "{} failed", self.tests.failed);
        Ok(())
    }
}

/// Runs a stage. Fills in the report while the stage runs, so that the report is available even if the stage fails.
fn run(workspace: &Workspace, name: &str, report: &mut Report) -> Result<()> {
    let mut stage = workspace.script(&[&name.replace('-', "_")]);
    let mut stage = stage.stdout(Stdio::piped()).spawn()?;
    for line in BufReader::new(stage.stdout.take().context("standard output is piped")?).lines() {
        let line = line?;
        println!("{line}");
        report.read(&line);
    }
    let status = stage.wait()?;
    ensure!(status.success(), "ended with {status}: see above");
    report.check()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hosted_checks_run_every_stage() {
        for (workflow, is_nightly) in [
            (include_str!("../../../.github/workflows/checks.yml"), false),
            (include_str!("../../../.github/workflows/nightly.yml"), true),
        ] {
            let stages = stages().filter(|stage| stage.is_nightly == is_nightly);
            let names: Vec<&str> = stages.map(|stage| stage.name).collect();
            let matrix = format!("stage: [{}]", names.join(", "));
            assert!(workflow.contains(&matrix), "a workflow lacks {matrix}");
        }
    }

    /// Returns whether a stage with this output passes if its commands succeed.
    fn passes(lines: &[&str]) -> bool {
        let mut report = Report::default();
        for line in lines {
            report.read(line);
        }
        report.check().is_ok()
    }

    #[test]
    fn a_stage_passes_only_if_every_announced_test_has_passed() {
        const RUN: [&str; 3] = [
            "tests: cargo test",
            "running 2 tests",
            "test result: ok. 1 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out",
        ];
        assert!(passes(&[]), "a stage without tests");
        assert!(passes(&RUN));
        assert!(!passes(&["tests: cargo test"]));
        assert!(!passes(&[&RUN[..], &["tests: cargo test"]].concat()));
        assert!(!passes(&[&["tests: cargo test"], &RUN[..]].concat()));
        assert!(!passes(&[&RUN[..], &["running 1 test"]].concat()));
        assert!(!passes(&[&RUN[..], &["5 proved, 1 failed"]].concat()));
    }

    #[test]
    fn a_command_that_fails_ends_its_stage() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let fails = |arguments: &[&str]| {
            // Discard the output. Otherwise `cargo xtask verify` would read it as output of the stage that runs this
            // test.
            let status = workspace.script(arguments).stdout(Stdio::null()).status();
            !status.expect("sh").success()
        };
        assert!(!fails(&["tests_of", "true"]));
        assert!(fails(&["tests_of", "false"]));
        assert!(fails(&["eval", "stage() { false; true; }; stage"]));
        assert!(fails(&["no_such_stage"]));
        assert!(stages().count() > 20);
        for stage in stages() {
            let function = stage.name.replace('-', "_");
            assert!(!fails(&["type", &function]), "stages.sh has no {function}");
        }
    }
}
