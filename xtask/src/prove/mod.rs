//! `cargo xtask prove`: checks the theorems, with Kani or with CBMC.

mod cbmc;
mod cbmc_setup;
mod harness;
mod kani;
mod llvm;
mod model;
mod outcome;
mod public_functions;
mod seeded_bugs;
mod self_check;
mod theorem_table;

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Result, bail, ensure};
use clap::ValueEnum;

use self::cbmc::Cbmc;
use self::harness::Harness;
use self::llvm::Module;
use self::outcome::{Outcome, Row, rows, table};
use crate::stage::Report;
use crate::workspace::Workspace;

/// The package that the harnesses are in.
const PACKAGE: &str = "framelock-proofs";
const HARNESSES: &str = "proofs/src/harnesses";

const EXAMPLES: &str = "\
Examples:
  cargo xtask prove                          the theorems that each commit is checked for
  cargo xtask prove --all                    also those that take long, and the seeded bugs
  cargo xtask prove --harness any_length     those whose name has that in it
  cargo xtask prove --self-check             the checker on harnesses that must fail
  cargo xtask prove --seeded-bugs            the proofs on sources that are wrong

Takes Kani if it is installed; else CBMC, its engine: from PATH, or unpacked from Debian's packages \
into `target/cbmc`. Which one it took is in the table. The exit code is 1 if any harness fails, takes \
too long, is vacuous, or leaves a cover unsatisfied.";

/// Check the theorems.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag")]
pub(crate) struct Arguments {
    /// What to check with; by default Kani if it is installed, else CBMC.
    #[arg(long)]
    engine: Option<Engine>,

    /// Only the harnesses whose name contains this.
    #[arg(long, value_name = "NAME")]
    harness: Option<String>,

    /// Also the harnesses that take long, and, if no harness is named, the seeded bugs.
    #[arg(long)]
    all: bool,

    /// How many harnesses are checked at the same time; by default as many as there are cores.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,

    /// How long a harness may take, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u64,

    /// How the results are written.
    #[arg(long, default_value = "text")]
    format: Format,

    /// Check the checker: harnesses that must fail, each in its own way. With CBMC.
    #[arg(long, conflicts_with_all = ["harness", "all", "seeded_bugs"])]
    self_check: bool,

    /// Put one bug at a time into a copy of the sources: its theorem must fail. With CBMC.
    #[arg(long, conflicts_with_all = ["harness", "all"])]
    seeded_bugs: bool,

    /// List the harnesses, and the public functions with those that cover them; check none.
    #[arg(long)]
    list: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Engine {
    Kani,
    Cbmc,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

/// How the harnesses are to be run.
struct Limits {
    jobs: usize,
    each: Duration,
}

/// Runs what was asked for.
pub(crate) fn prove(arguments: &Arguments) -> Result<ExitCode> {
    let workspace = Workspace::load()?;
    let limits = Limits {
        jobs: arguments.jobs.unwrap_or_else(cores).max(1),
        each: Duration::from_secs(arguments.timeout),
    };
    if arguments.self_check || arguments.seeded_bugs {
        ensure!(
            arguments.engine != Some(Engine::Kani),
            "this is done with CBMC; leave `--engine kani` out"
        );
        let cbmc = cbmc_setup::cbmc(&cbmc_folder(&workspace))?;
        if arguments.self_check {
            self_check::run(&workspace, &cbmc, &limits)?;
        } else {
            seeded_bugs::run(&workspace, &cbmc, &limits)?;
        }
        return Ok(ExitCode::SUCCESS);
    }

    let harnesses = selected(&workspace, arguments)?;
    if arguments.list {
        for harness in &harnesses {
            let long = if harness.long { ", long" } else { "" };
            println!(
                "{:<60} {} ({}{long})",
                harness.name, harness.theorem, harness.length
            );
        }
        println!();
        public_functions::check(&workspace, &all_harnesses(&workspace)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let (says, results) = check(&workspace, arguments.engine, &harnesses, &limits)?;
    let rows = rows(&results, &says);
    match arguments.format {
        Format::Json => println!("{}", serde_json::to_string_pretty(&rows)?),
        Format::Text => {
            print(&results, &rows);
            let proved = rows.iter().filter(|row| row.proved).count();
            println!("{proved} proved, {} failed", rows.len() - proved);
        }
    }
    if rows.iter().any(|row| !row.proved) {
        return Ok(ExitCode::FAILURE);
    }
    if arguments.all && arguments.harness.is_none() {
        let cbmc = cbmc_setup::cbmc(&cbmc_folder(&workspace))?;
        seeded_bugs::run(&workspace, &cbmc, &limits)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn all_harnesses(workspace: &Workspace) -> Result<Vec<Harness>> {
    harness::read(&workspace.root, &workspace.root.join(HARNESSES))
}

/// The failures in full, and the table.
fn print(results: &[(&Harness, Outcome)], rows: &[Row]) {
    for (harness, outcome) in results {
        outcome.print_failures(&harness.name);
    }
    println!("{}", table(rows));
}

fn selected(workspace: &Workspace, arguments: &Arguments) -> Result<Vec<Harness>> {
    let mut all = all_harnesses(workspace)?;
    match &arguments.harness {
        Some(wanted) => all.retain(|harness| harness.name.contains(wanted.as_str())),
        None => all.retain(|harness| arguments.all || !harness.long),
    }
    ensure!(
        !all.is_empty(),
        "no harness has that in its name; `cargo xtask prove --list --all` shows all"
    );
    Ok(all)
}

/// Checks the harnesses with the engine, or with the first there is; returns which, and what it
/// found.
fn check<'h>(
    workspace: &Workspace,
    engine: Option<Engine>,
    harnesses: &'h [Harness],
    limits: &Limits,
) -> Result<(String, Vec<(&'h Harness, Outcome)>)> {
    let installed = kani::version(workspace);
    match (engine, installed) {
        (Some(Engine::Kani), None) => bail!(
            "Kani is not installed: `cargo install --locked kani-verifier && cargo kani setup`, \
             or leave `--engine kani` out for CBMC"
        ),
        (None | Some(Engine::Kani), Some(version)) => {
            eprintln!("Engine: {version}");
            let results = in_parallel(harnesses, limits.jobs, |harness| {
                kani::check(workspace, harness, limits.each)
            });
            Ok((version, results))
        }
        (Some(Engine::Cbmc), _) | (None, None) => {
            let cbmc = cbmc_setup::cbmc(&cbmc_folder(workspace))?;
            eprintln!("Engine: {}", cbmc.says);
            let target = model::target(workspace);
            let module = model::compile(&workspace.root, &target, PACKAGE)?;
            let folder = target.join("harnesses");
            let results = with_cbmc(&cbmc, &module, PACKAGE, harnesses, &folder, limits);
            Ok((cbmc.says, results))
        }
    }
}

/// Checks the harnesses of a module.
fn with_cbmc<'h>(
    cbmc: &Cbmc,
    module: &Module,
    package: &str,
    harnesses: &'h [Harness],
    folder: &Path,
    limits: &Limits,
) -> Vec<(&'h Harness, Outcome)> {
    in_parallel(harnesses, limits.jobs, |harness| {
        let symbol = symbol(package, harness);
        cbmc.check(module, &symbol, harness, folder, limits.each)
    })
}

/// What the compiled harness is called.
fn symbol(package: &str, harness: &Harness) -> String {
    format!(
        "harness:{}::harnesses::{}",
        package.replace('-', "_"),
        harness.name
    )
}

/// So many at a time, the results in the order of the harnesses. Each that is done is told.
fn in_parallel(
    harnesses: &[Harness],
    jobs: usize,
    check: impl Fn(&Harness) -> Result<Outcome> + Sync,
) -> Vec<(&Harness, Outcome)> {
    let outcomes = each_in_parallel(harnesses, jobs, |harness| {
        let outcome = Outcome::timed(|| check(harness));
        let word = if outcome.is_proved() {
            "proved"
        } else {
            "FAILED"
        };
        eprintln!("{word} {} in {:.1} s", harness.name, outcome.seconds);
        outcome
    });
    harnesses.iter().zip(outcomes).collect()
}

/// Does it for each item, so many at a time; the results are in the order of the items.
fn each_in_parallel<T: Sync, R: Send>(
    items: &[T],
    jobs: usize,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(items.len()) {
            scope.spawn(|| {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(place) else {
                        return;
                    };
                    let result = work(item);
                    let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
                    results.push((place, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(place, _)| *place);
    results.into_iter().map(|(_, result)| result).collect()
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn cbmc_folder(workspace: &Workspace) -> std::path::PathBuf {
    workspace.target_directory.join("cbmc")
}

fn usual_limits() -> Limits {
    Limits {
        jobs: cores(),
        each: Duration::from_secs(600),
    }
}

/// The stage of `verify`: every theorem that each commit is checked for, and every public function
/// of the core in one of them.
pub(crate) fn stage(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let mut harnesses = all_harnesses(workspace)?;
    public_functions::check(workspace, &harnesses)?;
    theorem_table::check(workspace, &harnesses)?;
    harnesses.retain(|harness| !harness.long);
    let (says, results) = check(workspace, None, &harnesses, &usual_limits())?;
    let rows = rows(&results, &says);
    print(&results, &rows);
    report.tests.passed = rows.iter().filter(|row| row.proved).count();
    report.tests.failed = rows.len() - report.tests.passed;
    report.extent = format!("{} harnesses", rows.len());
    report.engine.clone_from(&says);
    ensure!(
        report.tests.failed == 0,
        "{} of {} harnesses failed",
        report.tests.failed,
        rows.len()
    );
    Ok(())
}

/// The stage of `verify` that checks the checker.
pub(crate) fn checker_stage(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let cbmc = cbmc_setup::cbmc(&cbmc_folder(workspace))?;
    report.engine.clone_from(&cbmc.says);
    report.tests.passed = self_check::run(workspace, &cbmc, &usual_limits())?;
    report.extent = format!("{} harnesses with known outcomes", report.tests.passed);
    Ok(())
}
