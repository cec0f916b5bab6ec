//! `cargo xtask verify`: runs the stages and sums them up.

use std::process::ExitCode;
use std::time::Instant;

use anyhow::Result;
use clap::builder::PossibleValuesParser;

use crate::stage::{Report, STAGES, Stage};
use crate::table::{Row, last_line, table};
use crate::workspace::Workspace;

const EXAMPLES: &str = "\
Examples:
  cargo xtask verify                              every check there is
  cargo xtask verify --list                       the stages and what they check
  cargo xtask verify --only format --only clippy  two stages, for a quick answer

What is missing for a check is installed, where it can be. All stages run, even after one has \
failed. The exit code is 1 if any stage failed, and the last line counts the tests: \
\"N passed, M failed\", where a failed stage that is not a test counts as one.";

/// Set up and pass every check there is.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Run this stage only; can be given more than once.
    #[arg(
        long,
        value_name = "STAGE",
        value_parser = PossibleValuesParser::new(STAGES.iter().map(|stage| stage.name)),
    )]
    only: Vec<String>,

    /// List the stages and what they check, and run none.
    #[arg(long, conflicts_with = "only")]
    list: bool,
}

/// Runs the stages that were asked for.
pub(crate) fn verify(arguments: &Arguments) -> Result<ExitCode> {
    if arguments.list {
        for stage in STAGES {
            println!("{:<10} {}", stage.name, stage.checks);
        }
        return Ok(ExitCode::SUCCESS);
    }

    let stages: Vec<&Stage> = STAGES
        .iter()
        .filter(|stage| is_wanted(stage.name, &arguments.only))
        .collect();
    let workspace = Workspace::load()?;
    println!("Verifying {}", workspace.root.display());
    let rows: Vec<Row> = stages
        .iter()
        .enumerate()
        .map(|(index, stage)| {
            println!(
                "\n=== {}/{} {}: {} ===",
                index + 1,
                stages.len(),
                stage.name,
                stage.checks
            );
            run_stage(&workspace, stage)
        })
        .collect();

    println!();
    for row in &rows {
        if let Some(failure) = &row.failure {
            println!("FAILED: {}: {failure}\n", row.stage);
        }
    }
    if stages.len() < STAGES.len() {
        println!(
            "PARTIAL: only {} of {} stages were run, so this does not verify the project.\n",
            stages.len(),
            STAGES.len()
        );
    }
    println!("{}", table(&rows));
    println!("{}", last_line(&rows));

    if rows.iter().any(|row| row.failure.is_some()) {
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

fn is_wanted(name: &str, only: &[String]) -> bool {
    only.is_empty() || only.iter().any(|wanted| wanted == name)
}

fn run_stage(workspace: &Workspace, stage: &Stage) -> Row {
    let mut report = Report::default();
    let start = Instant::now();
    let failure = (stage.run)(workspace, &mut report)
        .err()
        .map(|error| format!("{error:#}"));
    if let Some(failure) = &failure {
        println!("FAILED: {failure}");
    }
    Row {
        stage: stage.name,
        report,
        time: start.elapsed(),
        failure,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_only_every_stage_is_wanted() {
        assert!(STAGES.iter().all(|stage| is_wanted(stage.name, &[])));
    }

    #[test]
    fn with_only_just_the_named_stages_are_wanted() {
        let only = ["docs".to_owned(), "format".to_owned()];
        let wanted: Vec<&str> = STAGES
            .iter()
            .map(|stage| stage.name)
            .filter(|name| is_wanted(name, &only))
            .collect();
        assert_eq!(wanted, ["format", "docs"]);
    }

    #[test]
    fn the_hosted_checks_run_every_stage() {
        let workflow = include_str!("../../.github/workflows/checks.yml");
        let names: Vec<&str> = STAGES.iter().map(|stage| stage.name).collect();
        let matrix = format!("stage: [{}]", names.join(", "));
        assert!(workflow.contains(&matrix), "checks.yml wants {matrix}");
    }

    #[test]
    fn a_failing_stage_keeps_what_it_reported() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let stage = Stage {
            name: "stage",
            checks: "something",
            run: |_, report| {
                report.engine = "engine 1.0".to_owned();
                anyhow::bail!("it does not hold")
            },
        };
        let row = run_stage(&workspace, &stage);
        assert_eq!(row.report.engine, "engine 1.0");
        assert_eq!(row.failure.as_deref(), Some("it does not hold"));
    }
}
