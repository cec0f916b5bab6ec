//! `cargo xtask prove`: checks the theorems with Kani or the offline prover.

use std::env;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context as _, Result, ensure};
use clap::ValueEnum;
use framelock_limited::Process;
use serde::de::DeserializeOwned;

use crate::kani;
use crate::slow_proofs::SlowProofs;
use crate::theorems::{Answer, Harness, theorems};
use crate::workspace::{Workspace, cargo_in};

/// The packages that contain the theorems.
const THEOREMS: &[&str] = &[
    "framelock",
    "framelock-proofs",
    "framelock-formats",
    "framelock-reception",
];
/// The packages that Kani's flags in the root's Cargo.toml name. Kani rejects a package that is named twice.
const NAMED_IN_ROOT: &[&str] = &["framelock", "framelock-proofs", "framelock-reception"];
/// The package with the proofs about the receivers in C, and the package's folder, which also contains harnesses in C.
pub(crate) const C_PROOFS: &str = "framelock-c-proofs";
const C_FOLDER: &str = "c/proofs";
const OFFLINE_PROVER: &str = "framelock-offline-prover";

/// Check the theorems, with the Kani harnesses of `core`, `proofs`, `formats` and `firmware/reception`
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Engine that checks the harnesses [default: Kani if it is set up, otherwise the offline
    /// prover]
    #[arg(long)]
    engine: Option<Engine>,

    /// Check only the harness with this name, or the harnesses of the theorem with this number. If there is neither,
    /// check the harnesses whose names contain NAME
    #[arg(long = "harness", value_name = "NAME")]
    harnesses: Vec<String>,

    /// Check the proofs about the receivers in C instead, with the offline prover
    #[arg(long = "c", conflicts_with_all = ["engine", "list"])]
    of_c: bool,

    /// Check only the slow harnesses, which proofs/slow-harnesses.toml lists. Without this option, they are checked if
    /// the sources have changed since their last proof
    #[arg(long, conflicts_with_all = ["harnesses", "of_c", "list"])]
    slow: bool,

    /// Time limit for each harness, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u32,

    /// Number of harnesses checked at the same time [default: the number of cores]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,

    /// List all harnesses, grouped by theorem, instead of checking them
    #[arg(long, conflicts_with = "harnesses")]
    list: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Engine {
    Kani,
    Offline,
}

/// Checks the chosen harnesses. Returns whether all hold.
pub(crate) fn prove(workspace: &Workspace, arguments: &Arguments) -> Result<bool> {
    let mut prover = if arguments.of_c {
        Prover::of_c(workspace)?
    } else {
        Prover::new(workspace, arguments.engine)?
    };
    prover.timeout = arguments.timeout;
    prover.jobs = arguments.jobs;
    if arguments.list {
        list(&prover)?;
        return Ok(true);
    }
    if arguments.of_c || !arguments.harnesses.is_empty() {
        let names = prover.with_theorems(&arguments.harnesses)?;
        return Ok(report(&prover.check(&names)?));
    }
    let slow = SlowProofs::load(&prover.root)?;
    let names = if arguments.slow {
        slow.harnesses.clone()
    } else if slow.are_current() {
        println!("stage note: {}", slow.skipped());
        let mut names = prover.list()?;
        names.retain(|name| !slow.contains(name));
        names
    } else {
        Vec::new()
    };
    let all_hold = report(&prover.check(&names)?);
    if all_hold {
        slow.record()?;
    }
    Ok(all_hold)
}

/// Prints each theorem with the harnesses that it names.
fn list(prover: &Prover) -> Result<()> {
    let harnesses = prover.list()?;
    for theorem in theorems(&prover.root)? {
        println!("{}", theorem.title);
        for harness in harnesses.iter().filter(|one| theorem.is_shown_by(one)) {
            println!("     {harness}");
        }
    }
    Ok(())
}

/// Prints the harnesses that were not proved, and the totals. Returns whether all were proved.
fn report(answers: &[Answer]) -> bool {
    let failed: Vec<&Answer> = answers.iter().filter(|one| !one.is_proved()).collect();
    for answer in &failed {
        println!("FAILED {} ({})", answer.harness, answer.verdict);
        for line in answer.failures.iter().chain(&answer.inputs) {
            println!("  {line}");
        }
    }
    let proved = answers.len() - failed.len();
    println!("{proved} proved, {} failed", failed.len());
    failed.is_empty()
}

/// An available engine, and the sources that it checks.
#[derive(Clone)]
pub(crate) struct Prover {
    pub(crate) engine: Engine,
    timeout: u32,
    jobs: Option<usize>,
    /// The root of the workspace, or of a copy of it.
    pub(crate) root: PathBuf,
    pub(crate) packages: Vec<&'static str>,
    /// The folder in which the sources are built. A copy has its own folder, because cargo would
    /// otherwise mistake the copy's packages for those of the workspace.
    pub(crate) target: PathBuf,
    /// The manifest of the workspace, which contains the offline prover.
    manifest: PathBuf,
    tools: PathBuf,
}

impl Prover {
    /// Chooses the requested engine. If none is requested, chooses Kani if it is set up, and otherwise the offline
    /// prover.
    pub(crate) fn new(workspace: &Workspace, engine: Option<Engine>) -> Result<Self> {
        let (engine, says) = match (engine, kani::version()) {
            (None | Some(Engine::Kani), Ok(says)) => (Engine::Kani, says),
            (Some(Engine::Kani), Err(why)) => return Err(why),
            (None, Err(why)) => (Engine::Offline, format!("the offline prover, since {why}")),
            (Some(Engine::Offline), _) => (Engine::Offline, "the offline prover".to_owned()),
        };
        println!("stage note: {says}");
        Ok(Self {
            engine,
            timeout: 600,
            jobs: None,
            root: workspace.root.clone(),
            packages: THEOREMS.to_vec(),
            target: workspace.target.clone(),
            manifest: workspace.root.join("Cargo.toml"),
            tools: workspace.target.clone(),
        })
    }

    /// Returns the offline prover for the proofs about the receivers in C. Kani does not link C.
    pub(crate) fn of_c(workspace: &Workspace) -> Result<Self> {
        let prover = Self::new(workspace, Some(Engine::Offline))?;
        Ok(Self {
            packages: vec![C_PROOFS],
            ..prover
        })
    }

    /// Returns the names of all harnesses.
    pub(crate) fn list(&self) -> Result<Vec<String>> {
        Ok(self.listed()?.into_iter().map(|one| one.name).collect())
    }

    /// Returns all harnesses, as the offline prover lists them.
    pub(crate) fn listed(&self) -> Result<Vec<Harness>> {
        self.offline("list", &[])
    }

    /// Returns the names, with each number of a theorem replaced by the names of the theorem's harnesses.
    fn with_theorems(&self, names: &[String]) -> Result<Vec<String>> {
        let theorems = theorems(&self.root)?;
        let mut all = Vec::new();
        for name in names {
            let rows = theorems.iter().filter(|row| row.number() == name);
            let rows: Vec<_> = rows.collect();
            if rows.is_empty() {
                all.push(name.clone());
                continue;
            }
            let mut shown = self.list()?;
            shown.retain(|one| rows.iter().any(|row| row.is_shown_by(one)));
            ensure!(!shown.is_empty(), "theorem {name} has no harness here");
            all.extend(shown);
        }
        Ok(all)
    }

    /// Checks the harnesses that the names choose.
    pub(crate) fn check(&self, names: &[String]) -> Result<Vec<Answer>> {
        match self.engine {
            Engine::Offline => self.offline("prove", names),
            Engine::Kani => {
                let mut command = cargo_in(&self.root);
                command
                    .env("CARGO_TARGET_DIR", &self.target)
                    .args(["kani", "--output-format", "terse", "-Zunstable-options"])
                    .arg(format!("--harness-timeout={}s", self.timeout))
                    .arg("--jobs")
                    .args(self.jobs.map(|jobs| jobs.to_string()));
                let packages = self.packages.iter();
                let further = packages.filter(|it| !NAMED_IN_ROOT.contains(it));
                command.args(further.map(|it| format!("--package={it}")));
                kani::check(&mut command, names)
            }
        }
    }

    /// Runs the offline prover. Returns its answer.
    fn offline<T: DeserializeOwned>(&self, action: &str, names: &[String]) -> Result<T> {
        let mut command = self.offline_command();
        command
            .args([action, "--format=json"])
            .arg(format!("--timeout={}", self.timeout))
            .arg(format!("--jobs={}", self.jobs.unwrap_or(0)))
            .args(chosen(names, must_repeat()));
        let limit = match action {
            "list" => Duration::from_secs(1800),
            _ => Duration::from_secs(86_400),
        };
        let prover = Process::start_within(limit, command.stdout(Stdio::piped()))?;
        let output = prover.wait_with_output()?;
        ensure!(
            !output.stdout.is_empty(),
            "the offline prover gave no answer; see above"
        );
        serde_json::from_slice(&output.stdout).context("not an answer of the offline prover")
    }

    fn offline_command(&self) -> Command {
        let mut command = cargo_in(&self.root);
        command
            .args(["run", "--quiet", "--package", OFFLINE_PROVER])
            .arg("--manifest-path")
            .arg(&self.manifest)
            .arg("--target-dir")
            .arg(&self.tools)
            .env("CARGO_TARGET_DIR", &self.target)
            .arg("--");
        for package in &self.packages {
            command.args(["--package", package]);
        }
        if self.packages.contains(&C_PROOFS) {
            command.arg("--c").arg(self.root.join(C_FOLDER));
        }
        command
    }
}

/// Returns whether every proof must be repeated. Hosted machines set `CI`, and keep the build folder between runs.
fn must_repeat() -> bool {
    env::var_os("CI").is_some()
}

/// Returns the offline prover's arguments that select harnesses, and that make it repeat every proof.
fn chosen(names: &[String], repeats: bool) -> Vec<&str> {
    let names = names.iter().flat_map(|name| ["--harness", name]);
    names.chain(repeats.then_some("--anew")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proofs_are_repeated_only_on_hosted_machines() {
        assert_eq!(must_repeat(), env::var_os("CI").is_some());
        let names = ["one".to_owned(), "two".to_owned()];
        let usual = ["--harness", "one", "--harness", "two"];
        assert_eq!(chosen(&names, false), usual);
        assert_eq!(chosen(&names, true), [&usual[..], &["--anew"]].concat());
        assert_eq!(chosen(&[], true), ["--anew"]);
    }
}
