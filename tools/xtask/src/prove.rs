//! `cargo xtask prove`: checks the theorems with Kani or the offline prover.

use std::path::PathBuf;
use std::process::Stdio;

use anyhow::{Context as _, Result, ensure};
use clap::ValueEnum;
use serde::de::DeserializeOwned;

use crate::kani;
use crate::slow_proofs::SlowProofs;
use crate::theorems::{Answer, Harness, theorems};
use crate::workspace::{Workspace, cargo_in};

/// The packages that contain the theorems. Kani's flags in the root's Cargo.toml name the same packages. So Kani's
/// command line must not name them again, because Kani rejects a package that is named twice.
const THEOREMS: &[&str] = &[
    "framelock",
    "framelock-proofs",
    "framelock-formats",
    "framelock-reception",
];
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

    /// Limit for each harness, in seconds: of processor time for the offline prover, of real time for Kani
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u32,

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
        Prover::of_c(workspace)
    } else {
        Prover::new(workspace, arguments.engine)
    };
    prover.timeout = arguments.timeout;
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
        println!("remark: {}", slow.skipped());
        let mut names = prover.list()?;
        names.retain(|name| !slow.contains(name));
        names
    } else {
        Vec::new()
    };
    let all_hold = report(&prover.check(&names)?);
    if all_hold {
        slow.record(&prover.root)?;
    }
    Ok(all_hold)
}

/// Prints each theorem with its harnesses.
fn list(prover: &Prover) -> Result<()> {
    let harnesses = prover.list()?;
    for theorem in theorems(&prover.root)? {
        println!("{}", theorem.title());
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

/// An engine, and the sources that it checks.
#[derive(Clone)]
pub(crate) struct Prover {
    pub(crate) engine: Engine,
    timeout: u32,
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
    pub(crate) fn new(workspace: &Workspace, engine: Option<Engine>) -> Self {
        let (engine, says) = match (engine, kani::version()) {
            (None, Ok(says)) => (Engine::Kani, says),
            (Some(Engine::Kani), _) => (Engine::Kani, "Kani".to_owned()),
            (None, Err(why)) => (Engine::Offline, format!("the offline prover, since {why}")),
            (Some(Engine::Offline), _) => (Engine::Offline, "the offline prover".to_owned()),
        };
        println!("remark: {says}");
        Self {
            engine,
            timeout: 600,
            root: workspace.root.clone(),
            packages: THEOREMS.to_vec(),
            target: workspace.target.clone(),
            manifest: workspace.root.join("Cargo.toml"),
            tools: workspace.target.clone(),
        }
    }

    /// Returns the offline prover for the proofs about the receivers in C. Kani does not link C.
    pub(crate) fn of_c(workspace: &Workspace) -> Self {
        let prover = Self::new(workspace, Some(Engine::Offline));
        Self {
            packages: vec![C_PROOFS],
            ..prover
        }
    }

    /// Returns the names of all harnesses.
    pub(crate) fn list(&self) -> Result<Vec<String>> {
        self.named(&[])
    }

    /// Returns the complete names of the harnesses that `names` choose, or of all harnesses if `names` is empty.
    fn named(&self, names: &[String]) -> Result<Vec<String>> {
        let harnesses: Vec<Harness> = self.offline("list", names)?;
        Ok(harnesses.into_iter().map(|one| one.name).collect())
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

    /// Checks the harnesses that the names choose, or all harnesses if there is no name.
    pub(crate) fn check(&self, names: &[String]) -> Result<Vec<Answer>> {
        match self.engine {
            Engine::Offline => self.offline("prove", names),
            Engine::Kani => {
                let mut command = cargo_in(&self.root);
                command
                    .env("CARGO_TARGET_DIR", &self.target)
                    .args(["kani", "--output-format", "terse", "-Zunstable-options"])
                    .arg(format!("--harness-timeout={}s", self.timeout))
                    .arg("--jobs");
                let packages = self.packages.iter();
                let further = packages.filter(|it| !THEOREMS.contains(it));
                command.args(further.map(|it| format!("--package={it}")));
                // Give Kani complete names. With `--exact`, it then checks no other harness whose name contains one of
                // these names.
                let names = if names.is_empty() {
                    Vec::new()
                } else {
                    self.named(names)?
                };
                kani::check(&mut command, &names)
            }
        }
    }

    /// Runs the offline prover. Returns its answer.
    pub(crate) fn offline<T: DeserializeOwned>(&self, action: &str, names: &[String]) -> Result<T> {
        let mut command = cargo_in(&self.root);
        command
            .args(["run", "--quiet", "--package", OFFLINE_PROVER])
            .arg("--manifest-path")
            .arg(&self.manifest)
            .arg("--target-dir")
            .arg(&self.tools)
            .env("CARGO_TARGET_DIR", &self.target)
            .args(["--", action, "--json"])
            .arg(format!("--timeout={}", self.timeout))
            .args(self.packages.iter().flat_map(|one| ["--package", one]))
            .args(names.iter().flat_map(|name| ["--harness", name]));
        if self.packages.contains(&C_PROOFS) {
            command.arg("--c").arg(self.root.join(C_FOLDER));
        }
        // This command needs no time limit, because each harness has one.
        let output = command.stderr(Stdio::inherit()).output()?;
        ensure!(
            !output.stdout.is_empty(),
            "the offline prover gave no answer; see above"
        );
        serde_json::from_slice(&output.stdout).context("not an answer of the offline prover")
    }
}
