//! `cargo xtask verify`: runs the stages, and adds up their results.

use std::io::{BufRead as _, BufReader};
use std::process::Stdio;
use std::time::Instant;

use anyhow::{Context as _, Result, ensure};
use clap::builder::PossibleValuesParser;

use crate::test_count::TestCount;
use crate::workspace::Workspace;

/// One check. To add a check, add a line to [`STAGES`], and a function to `stages.sh`.
struct Stage {
    /// The stage's name for `--only`. Its function has underscores for the hyphens.
    name: &'static str,
    /// The check in one line.
    checks: &'static str,
    when: When,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum When {
    /// The stage runs for each commit.
    Always,
    /// The stage runs only with `--all`. The hosted machines run it every night.
    Nightly,
}
use When::{Always, Nightly};

/// The stages in the order in which they run. Stages that fail fast come first.
#[rustfmt::skip]
const STAGES: &[Stage] = &[
    Stage { name: "format", when: Always,
        checks: "the sources are formatted by rustfmt" },
    Stage { name: "core", when: Always,
        checks: "the core compiles for microcontrollers under every set of its features; the formats compile too" },
    Stage { name: "prove", when: Always,
        checks: "the theorems, by Kani or by the offline prover; harnesses of more than 20 s only if their sources have changed" },
    Stage { name: "clippy", when: Always,
        checks: "no warning from the compiler or clippy, in all targets" },
    Stage { name: "tests", when: Always,
        checks: "unit and integration tests, and replay of the corpora" },
    Stage { name: "docs", when: Always,
        checks: "the documentation builds without warnings, and its examples run" },
    Stage { name: "interface", when: Always,
        checks: "the public interface of each published package equals the committed one" },
    Stage { name: "firmware", when: Always,
        checks: "the firmware builds for the nRF52840 without warnings, with each set of features" },
    Stage { name: "emulated", when: Always,
        checks: "the firmware's release images in the emulator" },
    Stage { name: "random", when: Nightly,
        checks: "the firmware with many more random streams, and under each assumption about the chip" },
    Stage { name: "examples", when: Nightly,
        checks: "the examples for Embassy and RTIC build without warnings and run in the emulator; the example for the RP2040 builds" },
    Stage { name: "rivals", when: Nightly,
        checks: "the answers of framelock and of other crates on faulty streams, and the formats' cost on the chip" },
    Stage { name: "statistics", when: Nightly,
        checks: "the simulator's findings, with all trials" },
    Stage { name: "tables", when: Nightly,
        checks: "pandas and polars read the tables that `decode` writes, and `encode` reads them back; the names of MAVLink's messages are those of pymavlink" },
    Stage { name: "generated", when: Nightly,
        checks: "code generated from two hundred random descriptions" },
    Stage { name: "slow-proofs", when: Nightly,
        checks: "the harnesses that take more than 20 s" },
    Stage { name: "c-proofs", when: Nightly,
        checks: "the receivers in C do the same as those in Rust, without undefined behaviour, by the offline prover" },
    Stage { name: "prover", when: Nightly,
        checks: "the offline prover refutes what must fail, and leaves no process running" },
    Stage { name: "bugs", when: Nightly,
        checks: "seeded bugs break every harness and every rule of the firmware, and planted mistakes their checks" },
    Stage { name: "machine-code", when: Nightly,
        checks: "the receiver's step is proved in the machine code of the images, and seeded bugs in it are noticed" },
    Stage { name: "fuzz", when: Nightly,
        checks: "every fuzz target, for a minute" },
    Stage { name: "systems", when: Nightly,
        checks: "the command line compiles for Windows and macOS" },
    Stage { name: "minimum", when: Nightly,
        checks: "the core and the formats compile with the oldest Rust that their manifests promise" },
    Stage { name: "semver", when: Nightly,
        checks: "the public interface is compatible with that of the commit `semver-baseline`" },
    Stage { name: "publish", when: Nightly,
        checks: "each published package can be published, without a warning" },
    Stage { name: "wheel", when: Nightly,
        checks: "the Python package, built, installed into a new environment and run there" },
    Stage { name: "licences", when: Nightly,
        checks: "the licences, duplicates and sources of all dependencies, by cargo-deny" },
    Stage { name: "web", when: Nightly,
        checks: "the page works in browsers" },
    Stage { name: "mutants", when: Nightly,
        checks: "some test notices each small change of the core, layouts and checksums (hours)" },
];

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
    #[arg(long, value_name = "STAGE", value_parser = PossibleValuesParser::new(STAGES.iter().map(|stage| stage.name)))]
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
            self.all || stage.when == Always
        } else {
            self.only.iter().any(|name| name == stage.name)
        }
    }
}

/// Runs the stages that the arguments choose. Returns whether all pass.
pub(crate) fn verify(workspace: &Workspace, arguments: &Arguments) -> bool {
    if arguments.list {
        for stage in STAGES {
            let when = if stage.when == Nightly {
                " (--all)"
            } else {
                ""
            };
            println!("{:<12} {}{when}", stage.name, stage.checks);
        }
        return true;
    }
    let (mut passed, mut failed) = (0, 0);
    let (mut lines, mut failures) = (Vec::new(), Vec::new());
    for stage in STAGES.iter().filter(|stage| arguments.wants(stage)) {
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
    /// The commands that have to run tests, and the number of tests that had ended before.
    announced: Vec<(String, usize)>,
}

impl Report {
    fn read(&mut self, line: &str) {
        if let Some(note) = line.strip_prefix("stage note: ") {
            if !self.notes.iter().any(|known| known == note) {
                self.notes.push(note.to_owned());
            }
        } else if let Some(command) = line.strip_prefix("tests: ") {
            self.announced
                .push((command.to_owned(), self.tests.ended()));
        }
        self.tests += TestCount::of_line(line);
    }

    /// Checks that each announced test has a result. Exit codes do not suffice, because a test may end its program with
    /// exit code 0 before the remaining tests have run.
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
        for (workflow, when) in [
            (
                include_str!("../../../.github/workflows/checks.yml"),
                Always,
            ),
            (
                include_str!("../../../.github/workflows/nightly.yml"),
                Nightly,
            ),
        ] {
            let stages = STAGES.iter().filter(|stage| stage.when == when);
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
            // The output must not look like that of the stage that runs this test.
            let status = workspace.script(arguments).stdout(Stdio::null()).status();
            !status.expect("sh").success()
        };
        assert!(!fails(&["tests_of", "true"]));
        assert!(fails(&["tests_of", "false"]));
        assert!(fails(&["eval", "stage() { false; true; }; stage"]));
        assert!(fails(&["no_such_stage"]));
        for stage in STAGES {
            let function = stage.name.replace('-', "_");
            assert!(!fails(&["type", &function]), "stages.sh has no {function}");
        }
    }
}
