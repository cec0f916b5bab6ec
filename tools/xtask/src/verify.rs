//! `cargo xtask verify`: runs the stages, and adds up their results.

use std::time::Instant;

use anyhow::Result;
use clap::builder::PossibleValuesParser;

use crate::stage_report::{Report, TestCount};
use crate::workspace::Workspace;
use crate::{
    browser, bugs, checks, firmware, fuzz, machine_code, mutants, prove, published, release,
};

/// One check. To add a check, write its function and add a line to [`STAGES`].
struct Stage {
    /// The stage's name for `--only`.
    name: &'static str,
    /// The check in one line.
    checks: &'static str,
    when: When,
    run: fn(&Workspace, &mut Report) -> Result<()>,
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
    Stage { name: "format", when: Always, run: checks::format,
        checks: "the sources are formatted by rustfmt" },
    Stage { name: "core", when: Always, run: checks::core,
        checks: "the core compiles for microcontrollers under every set of its features; the formats compile too" },
    Stage { name: "prove", when: Always, run: prove::stage,
        checks: "the theorems, by Kani or by the offline prover" },
    Stage { name: "clippy", when: Always, run: checks::clippy,
        checks: "no warning from the compiler or clippy, in all targets" },
    Stage { name: "tests", when: Always, run: checks::tests,
        checks: "unit and integration tests, replay of the corpora, and each benchmark once, untimed" },
    Stage { name: "docs", when: Always, run: checks::docs,
        checks: "the documentation builds without warnings, and its examples run" },
    Stage { name: "interface", when: Always, run: published::interface,
        checks: "the public interface of each published package equals the committed one" },
    Stage { name: "firmware", when: Always, run: firmware::every_build,
        checks: "the firmware builds for the nRF52840 without warnings, with each set of features" },
    Stage { name: "emulated", when: Always, run: firmware::in_the_emulator,
        checks: "the firmware's release images in the emulator, and the formats' cost on the chip" },
    Stage { name: "random", when: Nightly, run: firmware::random_streams,
        checks: "the firmware with many more random streams, and under each assumption about the chip" },
    Stage { name: "examples", when: Nightly, run: firmware::examples,
        checks: "the examples for Embassy and RTIC build without warnings and run in the emulator; the example for the RP2040 builds" },
    Stage { name: "statistics", when: Nightly, run: checks::statistics,
        checks: "the simulator's findings, with all trials" },
    Stage { name: "tables", when: Nightly, run: checks::tables,
        checks: "pandas and polars read the tables that `decode` writes, and `encode` reads them back; the names of MAVLink's messages are those of pymavlink" },
    Stage { name: "generated", when: Nightly, run: checks::generated,
        checks: "code generated from two hundred random descriptions" },
    Stage { name: "c-proofs", when: Nightly, run: prove::c_stage,
        checks: "the receivers in C do the same as those in Rust, without undefined behaviour, by the offline prover" },
    Stage { name: "prover", when: Nightly, run: prove::prover_stage,
        checks: "the offline prover refutes what must fail, and leaves no process running" },
    Stage { name: "bugs", when: Nightly, run: bugs::stage,
        checks: "seeded bugs break every harness and every rule of the firmware, and planted mistakes their checks" },
    Stage { name: machine_code::NAME, when: Nightly, run: machine_code::stage,
        checks: "the receiver's step is proved in the machine code of the images, and seeded bugs in it are noticed" },
    Stage { name: "fuzz", when: Nightly, run: fuzz::stage,
        checks: "every fuzz target, for a minute" },
    Stage { name: "systems", when: Nightly, run: checks::systems,
        checks: "the command line compiles for Windows and macOS" },
    Stage { name: "minimum", when: Nightly, run: checks::minimum,
        checks: "the core and the formats compile with the oldest Rust that their manifests promise" },
    Stage { name: "semver", when: Nightly, run: published::semver,
        checks: "the public interface is compatible with that of the commit `semver-baseline`" },
    Stage { name: "publish", when: Nightly, run: published::publish,
        checks: "each published package can be published, without a warning" },
    Stage { name: "wheel", when: Nightly, run: release::wheel,
        checks: "the Python package, built, installed into a new environment and run there" },
    Stage { name: "licences", when: Nightly, run: release::licences,
        checks: "the licences, duplicates and sources of all dependencies, by cargo-deny" },
    Stage { name: "web", when: Nightly, run: browser::stage,
        checks: "the page works in browsers" },
    Stage { name: "mutants", when: Nightly, run: mutants::stage,
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
        for Stage {
            name, checks, when, ..
        } in STAGES
        {
            let when = if *when == Nightly { " (--all)" } else { "" };
            println!("{name:<10} {checks}{when}");
        }
        return true;
    }
    let mut sum = TestCount::default();
    let (mut lines, mut failures) = (Vec::new(), Vec::new());
    for stage in STAGES.iter().filter(|stage| arguments.wants(stage)) {
        println!("\n=== {}: {} ===", stage.name, stage.checks);
        let (start, mut report) = (Instant::now(), Report::default());
        let outcome = (stage.run)(workspace, &mut report);
        let seconds = start.elapsed().as_secs_f64();
        let (name, tests) = (stage.name, report.tests);
        let word = if outcome.is_ok() { "passed" } else { "FAILED" };
        let ran = match tests.passed + tests.failed {
            0 => String::new(),
            count => format!("{count} tests"),
        };
        lines.push(format!(
            "{name:<10} {word} {seconds:7.1} s  {ran:<11}{}",
            report.says
        ));
        sum += tests;
        if let Err(error) = outcome {
            println!("FAILED: {name}: {error:#}");
            failures.push(format!("FAILED: {name}: {error:#}"));
            // Count the stage itself, so that the last line never says `0 failed` after a failure.
            sum.failed += usize::from(tests.failed == 0);
        }
    }
    println!("\n{}\n", lines.join("\n"));
    for failure in &failures {
        println!("{failure}\n");
    }
    println!("{} passed, {} failed", sum.passed, sum.failed);
    failures.is_empty()
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
}
