//! `cargo xtask fuzz`: sets up and runs the fuzz targets.

use anyhow::{Context as _, Result, ensure};
use xshell::{Cmd, Shell, cmd};

use crate::stage_report::Report;
use crate::workspace::Workspace;

const CARGO_FUZZ: &str = "0.13.2";

/// The longest input, in bytes.
const LONGEST_INPUT: u32 = 256;

const EXAMPLES: &str = "\
Examples:
  cargo xtask fuzz                                  every target for a minute
  cargo xtask fuzz parser --seconds 900 --jobs 2    one target, for longer, on two cores

New inputs are kept in fuzz/corpus-found, and inputs that show a bug in fuzz/artifacts. The exit code is 1 \
if an input shows a bug. `cargo test -p framelock-oracles` replays the committed corpora.";

/// Search for inputs that contradict the theorems: a fuzzer generates inputs, and oracles check the outcomes
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Target to run [default: all targets]
    target: Option<String>,

    /// Duration for each target, in seconds
    #[arg(long, value_name = "N", default_value_t = 60)]
    seconds: u64,

    /// Number of parallel processes for a target
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    jobs: u32,
}

/// Runs the stage of `verify --all`: every target for a minute.
pub(crate) fn stage(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let arguments = Arguments {
        target: None,
        seconds: 60,
        jobs: 1,
    };
    report.says = format!("{} targets", run(workspace, &arguments)?);
    Ok(())
}

pub(crate) fn fuzz(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    run(workspace, arguments).map(|_| ())
}

/// Runs the targets. Returns their number.
fn run(workspace: &Workspace, arguments: &Arguments) -> Result<usize> {
    let fuzzer = Fuzzer::set_up(workspace)?;
    let targets = match &arguments.target {
        Some(target) => vec![target.clone()],
        None => fuzzer.targets()?,
    };
    ensure!(!targets.is_empty(), "there is no target");
    for target in &targets {
        fuzzer.run(target, arguments.seconds, arguments.jobs)?;
    }
    Ok(targets.len())
}

/// The cargo-fuzz command with a nightly compiler, because coverage counters need unstable compiler options.
struct Fuzzer {
    sh: Shell,
}

impl Fuzzer {
    fn set_up(workspace: &Workspace) -> Result<Self> {
        let sh = workspace.shell_with("cargo-fuzz", CARGO_FUZZ)?;
        let fuzzer = Self { sh };
        if fuzzer
            .nightly("rustc", ["--version"])
            .quiet()
            .read()
            .is_err()
        {
            cmd!(
                fuzzer.sh,
                "rustup toolchain install nightly --profile minimal"
            )
            .run()
            .context("fuzzing needs a nightly compiler")?;
        }
        Ok(fuzzer)
    }

    /// Returns a command of the nightly toolchain. Removes the variables that `cargo xtask` has inherited from its own
    /// toolchain.
    fn nightly<const N: usize>(&self, program: &str, arguments: [&str; N]) -> Cmd<'_> {
        ["CARGO", "RUSTC", "RUSTUP_TOOLCHAIN", "LD_LIBRARY_PATH"]
            .into_iter()
            .fold(
                cmd!(self.sh, "rustup run nightly {program}"),
                Cmd::env_remove,
            )
            .args(arguments)
    }

    fn targets(&self) -> Result<Vec<String>> {
        let list = self.nightly("cargo", ["fuzz", "list"]).read()?;
        Ok(list.lines().map(str::to_owned).collect())
    }

    /// Runs a target without a sanitizer. The core and the oracles forbid `unsafe`, so there is no memory error to
    /// find. Comparisons are not traced, because tracing would take more than half of the time. Instead, the dictionary
    /// and the seeds contain the values with which the receivers compare bytes.
    fn run(&self, target: &str, seconds: u64, jobs: u32) -> Result<()> {
        let found = format!("fuzz/corpus-found/{target}");
        self.sh.create_dir(&found)?;
        let dictionary = format!("fuzz/{target}.dict");
        let dictionary = self
            .sh
            .path_exists(&dictionary)
            .then(|| format!("-dict={dictionary}"));
        self.nightly(
            "cargo",
            ["fuzz", "run", "--sanitizer=none", "--no-trace-compares"],
        )
        .arg(format!("--jobs={jobs}"))
        .args([target, &found, &format!("fuzz/corpus/{target}"), "--"])
        .arg(format!("-max_total_time={seconds}"))
        .arg(format!("-max_len={LONGEST_INPUT}"))
        .args(dictionary)
        .run()
        .with_context(|| {
            format!(
                "if an input shows a bug, it is in fuzz/artifacts/{target}; once the bug is fixed, \
                     keep the input in fuzz/corpus/{target} under a name that describes it"
            )
        })
    }
}
