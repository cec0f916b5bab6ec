//! `cargo xtask mutants`: cargo-mutants changes the sources one place at a time; some test, or some harness of a theorem,
//! must fail.

use std::process::{Command, ExitCode};

use anyhow::{Result, ensure};
use clap::ValueEnum;
use xshell::cmd;

use crate::answer::Answer;
use crate::mutated_firmware;
use crate::prove::{Engine, OFFLINE_PROVER, Prover};
use crate::report::Report;
use crate::workspace::{CORE, Workspace};

const CARGO_MUTANTS: &str = "27.1.0";

/// Change the sources one place at a time: some test, or some harness, must notice.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// What must notice.
    #[arg(long, default_value = "tests")]
    by: By,

    /// For cargo-mutants, which `cargo mutants --help` explains.
    #[arg(last = true)]
    more: Vec<String>,
}

const EXAMPLES: &str = "\
Examples:
  cargo xtask mutants --by harnesses -- --re core/src/line.rs    one file's, against the theorems
  cargo xtask mutants --by harnesses -- --shard 0/8              an eighth of them
  cargo xtask mutants --by harnesses -- --iterate                only those that were not noticed before
  cargo xtask mutants --by images -- --file src/receive.rs       a file of the firmware's, in the emulator

What came of it is in target/mutants-by-tests, -by-harnesses and -by-images.";

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum By {
    /// The tests of the core and of the formats.
    Tests,
    /// The theorems' harnesses, by the offline prover: those that the change reaches.
    Harnesses,
    /// The firmware's tests, which run its images in the emulator. The reception is left out: it has harnesses.
    Images,
}

pub(crate) fn mutants(arguments: &Arguments) -> Result<ExitCode> {
    run(&Workspace::load()?, arguments)?;
    Ok(ExitCode::SUCCESS)
}

/// The stage of `verify --all`: all of them, against the tests. Against the harnesses they take most of a day.
pub(crate) fn stage(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let (by, more) = (By::Tests, Vec::new());
    run(workspace, &Arguments { by, more })
}

fn run(workspace: &Workspace, Arguments { by, more }: &Arguments) -> Result<()> {
    let sh = workspace.shell_with("cargo-mutants", CARGO_MUTANTS)?;
    let (config, tested, output) = match by {
        By::Tests => (
            ".cargo/mutants.toml",
            &[CORE, "framelock-formats"][..],
            "mutants-by-tests",
        ),
        By::Harnesses => (
            "proofs/mutants.toml",
            &[OFFLINE_PROVER][..],
            "mutants-by-harnesses",
        ),
        By::Images => {
            let output = workspace.target_directory.join("mutants-by-images");
            return mutated_firmware::run(workspace, &sh, &output, more);
        }
    };
    if *by == By::Harnesses {
        // cargo-mutants tries the tests of what it changes before, and not these.
        let unchanged = Prover::new(workspace, Some(Engine::Offline))?.check(&[])?;
        let all = unchanged.iter().all(Answer::is_proved);
        ensure!(all, "without any change some harness fails");
    }
    let output = workspace.target_directory.join(output);
    let tested = tested
        .iter()
        .flat_map(|package| ["--test-package", *package]);
    let mutants = cmd!(
        sh,
        "cargo mutants --workspace --config {config} {tested...} --output {output} {more...}"
    );
    let status = Command::from(mutants).status()?;
    // 3: some mutant's tests do not come to an end, which is noticed as well.
    ensure!(
        matches!(status.code(), Some(0 | 3)),
        "some are not noticed: see above"
    );
    Ok(())
}
