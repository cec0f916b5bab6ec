//! `cargo xtask mutants`: cargo-mutants makes one small change to the sources at a time. For each
//! change, some test or some harness of a theorem must fail.
//!
//! cargo-mutants compiles and tests only for the computer, not for the chip. So for the firmware's images, this command
//! uses only cargo-mutants' list of changes. It makes each change in a copy of the firmware, builds the images from the
//! copy, and tests them in the emulator. Some test must fail.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Result, ensure};
use clap::ValueEnum;
use serde::Deserialize;
use xshell::{Shell, cmd};

use crate::firmware;
use crate::prove::{Engine, OFFLINE_PROVER, Prover};
use crate::stage_report::Report;
use crate::theorems::Answer;
use crate::workspace::{CORE, Workspace};

const CARGO_MUTANTS: &str = "27.1.0";

/// Make one small change to the sources at a time, and check that some test or harness notices it
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Checks that must notice the changes
    #[arg(long, default_value = "tests")]
    by: By,

    /// Arguments for cargo-mutants, see `cargo mutants --help`
    #[arg(last = true)]
    more: Vec<String>,
}

const EXAMPLES: &str = "\
Examples:
  cargo xtask mutants --by harnesses -- --re core/src/line.rs    changes of one file, against the theorems
  cargo xtask mutants --by harnesses -- --shard 0/8              an eighth of all changes
  cargo xtask mutants --by harnesses -- --iterate                only changes that were not noticed before
  cargo xtask mutants --by images -- --file src/receive.rs       a file of the firmware, in the emulator

The results are in target/mutants-by-tests, -by-harnesses and -by-images.";

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum By {
    /// The tests of the core and of the formats
    Tests,
    /// The theorems' harnesses that the change reaches, with the offline prover
    Harnesses,
    /// The firmware's tests, which run its images in the emulator; the reception is left out
    /// because it has harnesses
    Images,
}

/// Runs the stage of `verify --all`, which checks all changes with the tests. Checking them with
/// the harnesses would take most of a day.
pub(crate) fn stage(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let (by, more) = (By::Tests, Vec::new());
    mutants(workspace, &Arguments { by, more })
}

/// Checks the changes that the arguments choose.
pub(crate) fn mutants(workspace: &Workspace, Arguments { by, more }: &Arguments) -> Result<()> {
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
            return by_images(workspace, &sh, &output, more);
        }
    };
    if *by == By::Harnesses {
        // cargo-mutants itself first checks that the tests pass without a change, but it does not check
        // these harnesses.
        let unchanged = Prover::new(workspace, Some(Engine::Offline))?.check(&[])?;
        let all = unchanged.iter().all(Answer::is_proved);
        ensure!(all, "some harness fails even without a change");
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
    // Exit code 3 means that some change made the tests run into their time limit. Such a change counts as noticed.
    ensure!(
        matches!(status.code(), Some(0 | 3)),
        "some changes are not noticed: see above"
    );
    Ok(())
}

/// Only the self-test contains these files, so only the self-test's tests can notice changes in them.
const OF_SELF_TEST: [&str; 2] = ["src/self-test.rs", "src/loopback.rs"];

/// A change from the output of `cargo mutants --list --json`.
#[derive(Deserialize)]
struct Mutant {
    name: String,
    /// The changed file, relative to `firmware/`.
    file: String,
    /// The difference that the change makes to the file.
    diff: String,
}

/// Checks all changes of the firmware, or only those that the arguments `more` for cargo-mutants select. A file in
/// `output` lists the changes that were noticed in earlier runs. These changes are not checked again.
fn by_images(workspace: &Workspace, sh: &Shell, output: &Path, more: &[String]) -> Result<()> {
    let config = "firmware/mutants.toml";
    let list = cmd!(
        sh,
        "cargo mutants --dir firmware --config {config} --list --json {more...}"
    );
    let mut mutants: Vec<Mutant> = serde_json::from_str(&list.read()?)?;
    // cargo-mutants lists a change twice if two of the firmware's programs share the changed code.
    let mut listed = BTreeSet::new();
    mutants.retain(|mutant| listed.insert(mutant.name.clone()));
    fs::create_dir_all(output)?;
    let noticed = output.join("noticed.txt");
    let before = fs::read_to_string(&noticed).unwrap_or_default();
    let mut noticed = fs::File::options()
        .create(true)
        .append(true)
        .open(noticed)?;
    let copy = output.join("copy");
    firmware::copy(workspace, &copy)?;
    let images = firmware::build_images(workspace, &copy)?;
    let tests = Tests::of(workspace, images)?;
    let mut missed = Vec::new();
    for (number, mutant) in mutants.iter().enumerate() {
        if before.lines().any(|name| name == mutant.name) {
            continue;
        }
        firmware::copy(workspace, &copy)?;
        let file = copy.join("firmware").join(&mutant.file);
        let patch = cmd!(sh, "patch --quiet {file}").stdin(&mutant.diff);
        patch.quiet().run()?;
        let of_self_test = OF_SELF_TEST.contains(&mutant.file.as_str());
        let only = if of_self_test { "self_test::" } else { "" };
        let says = if firmware::build_images(workspace, &copy).is_err() {
            "does not compile".to_owned()
        } else if let Some(test) = tests.first_to_fail(only)? {
            writeln!(noticed, "{}", mutant.name)?;
            format!("noticed by {test}")
        } else {
            missed.push(mutant.name.as_str());
            "NOT NOTICED".to_owned()
        };
        let (number, all) = (number + 1, mutants.len());
        println!("{number} of {all}: {}: {says}", mutant.name);
    }
    ensure!(missed.is_empty(), "not noticed:\n{}", missed.join("\n"));
    Ok(())
}

/// The firmware's tests, except those that compare figures with `firmware/FIGURES.txt`. Every change alters the bytes
/// and cycles of the firmware, so these tests would notice everything.
struct Tests {
    program: PathBuf,
    images: PathBuf,
    /// The names of the tests, from the fastest to the slowest.
    names: Vec<String>,
}

impl Tests {
    /// Prepares the tests. All of them must pass with the unchanged firmware.
    fn of(workspace: &Workspace, images: PathBuf) -> Result<Self> {
        let program = firmware::test_program(workspace)?;
        let list = Command::new(&program)
            .args(["--list", "--format=terse"])
            .output()?;
        let list = String::from_utf8(list.stdout)?;
        let names = list.lines().filter_map(|line| line.strip_suffix(": test"));
        let names = names.filter(|name| !name.starts_with("figures::"));
        let mut tests = Self {
            program,
            images,
            names: names.map(str::to_owned).collect(),
        };
        let mut timed = Vec::new();
        for name in &tests.names {
            let began = Instant::now();
            ensure!(tests.passes(name)?, "{name} fails even without a change");
            timed.push((began.elapsed(), name.clone()));
        }
        timed.sort_unstable();
        tests.names = timed.into_iter().map(|(_, name)| name).collect();
        Ok(tests)
    }

    fn passes(&self, name: &str) -> Result<bool> {
        let mut test = Command::new(&self.program);
        test.args(["--exact", name]);
        test.env("FRAMELOCK_IMAGES", &self.images);
        Ok(test.output()?.status.success())
    }

    /// Returns the first test that fails among those whose names begin with `only`.
    fn first_to_fail(&self, only: &str) -> Result<Option<&str>> {
        for name in self.names.iter().filter(|name| name.starts_with(only)) {
            if !self.passes(name)? {
                return Ok(Some(name));
            }
        }
        Ok(None)
    }
}
