//! `cargo xtask fuzz`: the fuzz targets, with everything they need set up.

mod corpus;
mod coverage;
mod replay;
mod session;
mod setup;

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, bail, ensure};
use clap::ValueEnum;

use self::session::{Outcome, Session};
use self::setup::Fuzzer;
use crate::stage::Report;
use crate::workspace::Workspace;

pub(crate) use self::replay::NEEDS_IMAGES;

/// How long `verify` tries each target for.
const A_FEW_SECONDS: Duration = Duration::from_secs(5);

const EXAMPLES: &str = "\
Examples:
  cargo xtask fuzz                                   every target for a minute
  cargo xtask fuzz parser --seconds 900 --jobs 2     one, for longer, on two cores
  cargo xtask fuzz firmware                          the firmware's images, in the emulator
  cargo xtask fuzz --replay                          the committed corpora, on stable Rust
  cargo xtask fuzz --coverage                        which regions of the core the corpora reach
  cargo xtask fuzz chunks --minimise                 replaces the committed corpus by the smallest \
that reaches as much as it and what has been found here

Sets up cargo-fuzz (from PATH, else installed into target) and a nightly compiler. New inputs are kept \
in target/fuzz-corpus, inputs that show a bug in target/fuzz-findings. The exit code is 1 if there is \
one.";

/// Try to break what is proved: compare it with the reference on inputs that a fuzzer makes up.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The target; all of them unless given.
    #[arg(value_enum)]
    target: Option<Target>,

    /// How long each target is tried for, in seconds.
    #[arg(long, value_name = "N", default_value_t = 60)]
    seconds: u64,

    /// How many processes try it at the same time.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    jobs: u32,

    /// Replay the committed corpora as tests, and fuzz nothing.
    #[arg(long, conflicts_with_all = ["target", "minimise", "coverage"])]
    replay: bool,

    /// Report which regions of the core the committed corpora reach; it is an error if one is not
    /// reached and fuzz/coverage-gaps.toml does not say why.
    #[arg(long, conflicts_with_all = ["target", "minimise"])]
    coverage: bool,

    /// Minimise the committed corpus, with what has been found here merged into it.
    #[arg(long, requires = "target")]
    minimise: bool,
}

/// What can be fuzzed, as `fuzz/Cargo.toml` names it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Target {
    /// Bytes, against the reference.
    Parser,
    /// Streams cut into slices, resets and line events.
    Chunks,
    /// Frames, and what the line does to them.
    Faults,
    /// Schedules of frames and time.
    Failsafe,
    /// The command line's reader.
    Decode,
    /// The firmware's release images in the emulator.
    Firmware,
}

impl Target {
    const ALL: [Self; 6] = [
        Self::Parser,
        Self::Chunks,
        Self::Faults,
        Self::Failsafe,
        Self::Decode,
        Self::Firmware,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Parser => "parser",
            Self::Chunks => "chunks",
            Self::Faults => "faults",
            Self::Failsafe => "failsafe",
            Self::Decode => "decode",
            Self::Firmware => "firmware",
        }
    }

    /// Whether an input is also worth keeping if it runs the same as others more or less often. What
    /// the failsafe does depends on numbers; what the others do shows in what they run.
    fn is_of_numbers(self) -> bool {
        matches!(self, Self::Failsafe)
    }

    /// The longest input, in bytes.
    fn longest_input(self) -> u32 {
        match self {
            // A board is emulated for as long as the input says.
            Self::Firmware => 128,
            _ => 256,
        }
    }
}

/// `cargo xtask fuzz`.
pub(crate) fn fuzz(arguments: &Arguments) -> Result<ExitCode> {
    let workspace = Workspace::load()?;
    if arguments.replay {
        replay::all(&workspace, &mut Report::default())?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.coverage {
        coverage::coverage(&workspace)?;
        return Ok(ExitCode::SUCCESS);
    }
    let targets: Vec<Target> = arguments
        .target
        .map_or_else(|| Target::ALL.to_vec(), |target| vec![target]);
    let fuzzer = Fuzzer::set_up(&workspace)?;
    println!("Fuzzing with {}", fuzzer.says);
    if arguments.minimise {
        for target in targets {
            corpus::minimise(&workspace, &fuzzer, target)?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let time = Duration::from_secs(arguments.seconds);
    let outcomes = run_all(&workspace, &fuzzer, &targets, time, arguments.jobs)?;
    if outcomes.iter().any(|outcome| !outcome.findings.is_empty()) {
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

/// The stage of `verify`: the corpora replayed, every target for a few seconds.
pub(crate) fn stage(workspace: &Workspace, report: &mut Report) -> Result<()> {
    replay::all(workspace, report)?;
    let fuzzer = Fuzzer::set_up(workspace)?;
    report.engine.clone_from(&fuzzer.says);
    let outcomes = run_all(workspace, &fuzzer, &Target::ALL, A_FEW_SECONDS, 1)?;
    let executions: u64 = outcomes.iter().map(|outcome| outcome.executions).sum();
    report.extent = format!(
        "corpora replayed; {} targets, {executions} executions",
        outcomes.len()
    );
    let findings = outcomes.iter().map(|outcome| outcome.findings.len());
    ensure!(
        findings.sum::<usize>() == 0,
        "an input shows a bug: see above"
    );
    Ok(())
}

/// Runs one after the other, and sums up.
fn run_all(
    workspace: &Workspace,
    fuzzer: &Fuzzer,
    targets: &[Target],
    time: Duration,
    jobs: u32,
) -> Result<Vec<Outcome>> {
    let mut outcomes = Vec::new();
    for &target in targets {
        let session = Session {
            workspace,
            fuzzer,
            target,
            time,
            jobs,
        };
        outcomes.push(session.run()?);
    }
    println!("\n{}", session::table(targets, &outcomes));
    if outcomes.iter().any(|outcome| outcome.executions == 0) {
        bail!("a target ran no input");
    }
    Ok(outcomes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So that no target is left out of `verify`.
    #[test]
    fn every_target_of_the_manifest_is_known() {
        let manifest = include_str!("../../../fuzz/Cargo.toml");
        let names: Vec<&str> = manifest
            .split("[[bin]]\nname = \"")
            .skip(1)
            .filter_map(|rest| rest.split('"').next())
            .collect();
        assert_eq!(names, Target::ALL.map(Target::name));
    }
}
