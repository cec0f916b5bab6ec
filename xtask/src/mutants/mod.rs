//! `cargo xtask mutants`: changes the core and the reference, one place at a time, and demands that a
//! test notices, or that a committed list says why none can.

mod known;
mod outcome;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context as _, Result, bail};

use self::known::Known;
use self::outcome::{Outcomes, Survivor};
use crate::cargo_tool::{CargoTool, Found};
use crate::command::{announce, cannot_start, cargo};
use crate::table::with_header;
use crate::workspace::Workspace;

const CARGO_MUTANTS: CargoTool = CargoTool {
    package: "cargo-mutants",
    ask_version: &["mutants", "--version"],
    version: "27.1.0",
};

/// Whose tests must notice.
const TESTS_OF: &str = "framelock";

/// The sources that are changed, and the tests that notice soonest: they are built and run first,
/// and only what they miss is tried against all.
const SOURCES: [Source; 12] = [
    Source::core("core/src/accounting.rs", &["against_reference"]),
    Source::core("core/src/failsafe.rs", &["failsafe"]),
    Source::core(
        "core/src/format.rs",
        &["checksum", "protocol_findings", "any_format"],
    ),
    Source::core(
        "core/src/lecture.rs",
        &["lecture_table", "against_reference"],
    ),
    Source::core("core/src/parser.rs", &["against_reference"]),
    Source::core("core/src/reader.rs", &["reader"]),
    Source::core(
        "core/src/receiver.rs",
        &["any_format", "lecture_table", "receiver_rule"],
    ),
    Source::core("core/src/scan.rs", &["against_reference"]),
    Source::core("core/src/setpoint.rs", &["protocol_findings"]),
    Source::core("core/src/slice.rs", &["any_format"]),
    Source::core("core/src/window.rs", &["any_format", "receiver_rule"]),
    Source {
        package: "framelock-proofs",
        file: "proofs/src/reference.rs",
        // Tests are named for the build as well, and the reference's own package has none of these.
        tests: &[],
    },
];

struct Source {
    package: &'static str,
    file: &'static str,
    tests: &'static [&'static str],
}

impl Source {
    const fn core(file: &'static str, tests: &'static [&'static str]) -> Self {
        Self {
            package: TESTS_OF,
            file,
            tests,
        }
    }
}

const EXAMPLES: &str = "\
Examples:
  cargo xtask mutants                               all: takes an hour or two
  cargo xtask mutants --file core/src/failsafe.rs   one source

Sets up cargo-mutants (from PATH, else installed into target). The exit code is 1 if a mutant survives \
that is not in xtask/known-mutants.toml, or if that list has one that does not survive.";

/// Test the tests: change the sources one place at a time, and see that something fails.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Only the mutants of this source; can be given more than once.
    #[arg(long, value_name = "FILE", value_parser = clap::builder::PossibleValuesParser::new(SOURCES.iter().map(|source| source.file)))]
    file: Vec<String>,
}

/// Runs them.
pub(crate) fn mutants(arguments: &Arguments) -> Result<ExitCode> {
    let workspace = Workspace::load()?;
    let tool = CARGO_MUTANTS.find(&workspace)?;
    println!("Mutants by {}", tool.says);
    let known = Known::read(&workspace.root)?;

    let mut table = with_header([
        "source",
        "mutants",
        "caught",
        "do not compile",
        "known",
        "missed",
    ]);
    let mut problems = Vec::new();
    for source in &SOURCES {
        if !arguments.file.is_empty() && !arguments.file.iter().any(|file| file == source.file) {
            continue;
        }
        let outcomes = try_all(&workspace, &tool, source)?;
        let (is_known, missed): (Vec<&Survivor>, Vec<&Survivor>) = outcomes
            .survivors
            .iter()
            .partition(|survivor| known.explains(survivor));
        table.add_row([
            source.file.to_owned(),
            outcomes.total().to_string(),
            outcomes.caught.to_string(),
            outcomes.unviable.to_string(),
            is_known.len().to_string(),
            missed.len().to_string(),
        ]);
        problems.extend(missed.iter().map(|survivor| format!("missed: {survivor}")));
        problems.extend(known.without_survivor(source.file, &outcomes.survivors));
    }
    println!("\n{table}");
    if !problems.is_empty() {
        bail!("{}", problems.join("\n"));
    }
    Ok(ExitCode::SUCCESS)
}

/// Tries the mutants of one source: with the tests that notice soonest, then what is left with all.
fn try_all(workspace: &Workspace, tool: &Found, source: &Source) -> Result<Outcomes> {
    let folder = workspace.target_directory.join("mutants").join(source.file);
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    std::fs::create_dir_all(&folder)?;
    if source.tests.is_empty() {
        run_once(workspace, tool, source, &folder, false)?;
        return Outcomes::read(&workspace.root, &folder);
    }
    run_once(workspace, tool, source, &folder, true)?;
    let soonest = Outcomes::read(&workspace.root, &folder)?;
    if soonest.survivors.is_empty() {
        return Ok(soonest);
    }
    Outcomes::leave_out_what_did_not_end(&folder)?;
    run_once(workspace, tool, source, &folder, false)?;
    let all = Outcomes::read(&workspace.root, &folder)?;
    Ok(soonest.then(all))
}

fn run_once(
    workspace: &Workspace,
    tool: &Found,
    source: &Source,
    folder: &PathBuf,
    soonest: bool,
) -> Result<()> {
    let mut command = cargo(workspace);
    command
        .args(["mutants", "--package", source.package])
        .args(["--test-package", TESTS_OF, "--all-features"])
        .args(["--file", source.file, "--no-shuffle"])
        // A mutant may wait for what never comes. In seconds, and several times what the tests take.
        .args(["--timeout", if soonest { "30" } else { "90" }])
        .args(["--build-timeout", "600"])
        .arg("--output")
        .arg(folder);
    if soonest {
        for test in source.tests {
            command.arg(format!("--cargo-arg=--test={test}"));
        }
    } else {
        // Without what the tests before have caught.
        command.args(["--iterate", "--cargo-arg=--tests"]);
    }
    tool.use_in(&mut command)?;
    announce(&command);
    let status = command.status().with_context(|| cannot_start(&command))?;
    // 0: all caught; 2: some missed; 3: some ran for too long.
    match status.code() {
        Some(0 | 2 | 3) => Ok(()),
        _ => bail!("cargo mutants ended with {status}"),
    }
}
