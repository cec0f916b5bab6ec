//! Checks Kani harnesses with CBMC alone, for machines on which Kani cannot be set up. See
//! README.md.

mod c_file;
mod cbmc;
mod cbmc_setup;
mod child_processes;
mod compile;
mod harness;
mod llvm;
mod proof_cache;
mod translate;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, ensure};
use clap::{Parser, ValueEnum};
use rayon::iter::{ParallelBridge as _, ParallelIterator as _};
use serde_json::json;

use c_file::CFile;
use cbmc::{Answer, Verdict};
use compile::Sources;
use harness::{Harness, Language, harnesses};
use proof_cache::ProofCache;

const EXIT_CODES: &str = "\
Exit codes: 0 all harnesses are proved, 1 a harness fails, 2 the prover cannot run, \
3 no harness fails, but some could not be checked, or have no answer within the time limit.";

/// Check the Kani harnesses of the workspace in this folder with CBMC alone
#[derive(Parser)]
#[command(after_help = EXIT_CODES)]
struct Arguments {
    #[arg(default_value = "prove")]
    action: Action,

    /// Package whose library contains harnesses
    #[arg(long = "package", short, required = true)]
    packages: Vec<String>,

    /// Folder of C files, which contain harnesses and functions that harnesses in Rust call
    #[arg(long = "c", value_name = "FOLDER")]
    c_folder: Option<PathBuf>,

    /// Check only the harnesses with this name, with or without its modules. If no harness has the name, check those
    /// whose names contain it
    #[arg(long = "harness", value_name = "NAME")]
    harnesses: Vec<String>,

    /// Limit of processor time for each harness, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u64,

    /// Stop at the first harness that fails, and terminate the checks that still run
    #[arg(long, conflicts_with = "json")]
    fail_fast: bool,

    /// Print the outcomes as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Action {
    /// Check the harnesses
    Prove,
    /// List the harnesses as JSON
    List,
    /// Check the harnesses with the compiler and clippy; a warning is an error
    Clippy,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// Runs the action. Returns the exit code.
fn run(arguments: &Arguments) -> Result<ExitCode> {
    child_processes::end_with_the_prover()?;
    let sources = Sources::new(&arguments.packages)?;
    match arguments.action {
        Action::Prove => prove(&sources, arguments),
        Action::List => list(&sources, arguments).map(|()| ExitCode::SUCCESS),
        Action::Clippy => sources.clippy().map(|()| ExitCode::SUCCESS),
    }
}

/// Returns the harnesses that the arguments choose.
fn selected(sources: &Sources, files: &[CFile], arguments: &Arguments) -> Result<Vec<Harness>> {
    let mut harnesses = harnesses(&sources.as_written()?)?;
    // Keep only the harnesses of the given packages. The module also contains the harnesses of packages on which the
    // given packages depend.
    harnesses.retain(|harness| {
        let mut packages = arguments.packages.iter();
        packages.any(|package| harness.is_in(&package.replace('-', "_")))
    });
    harnesses.extend(files.iter().flat_map(CFile::harnesses));
    let mut wanted = BTreeSet::new();
    for name in &arguments.harnesses {
        let mut names: Vec<String> = harnesses.iter().map(|one| one.name.clone()).collect();
        let end = format!("::{name}");
        let is_whole = |one: &String| format!("::{one}").ends_with(&end);
        let any_whole = names.iter().any(is_whole);
        names.retain(|one| is_whole(one) || !any_whole && one.contains(name));
        ensure!(!names.is_empty(), "there is no harness {name}");
        wanted.extend(names);
    }
    harnesses.retain(|harness| wanted.is_empty() || wanted.contains(&harness.name));
    ensure!(!harnesses.is_empty(), "the packages have no harness");
    Ok(harnesses)
}

/// Prints the harnesses as JSON.
fn list(sources: &Sources, arguments: &Arguments) -> Result<()> {
    let files = c_file::read(arguments.c_folder.as_deref())?;
    println!("{}", json!(selected(sources, &files, arguments)?));
    Ok(())
}

fn prove(sources: &Sources, arguments: &Arguments) -> Result<ExitCode> {
    let files = c_file::read(arguments.c_folder.as_deref())?;
    let mut harnesses = selected(sources, &files, arguments)?;
    let module = sources.improved()?;
    let cbmc = cbmc_setup::find(&std::env::current_exe()?.with_file_name("debian-cbmc"))?;
    eprintln!("Engine: {}", cbmc.says);
    let cache = ProofCache::new(&sources.target, cbmc)?;
    // The last harness of a module probably takes longest. Reverse the order, so that no core waits for such a harness
    // at the end. With `--fail-fast`, keep the order. A wrong change makes many harnesses fail, so begin with the fast
    // ones.
    if !arguments.fail_fast {
        harnesses.reverse();
    }
    let check = |harness: Harness| {
        let program = || match harness.language {
            Language::Rust => translate::program(&module, &harness, &files),
            Language::C { .. } => c_file::program(&harness, &files),
        };
        let answer = cbmc::check(program, &harness, &cache, arguments.timeout);
        show(&answer, arguments.json);
        if arguments.fail_fast && answer.verdict.is_failure() {
            child_processes::end_all(1);
        }
        answer
    };
    // With `par_bridge`, the harnesses start in the order of the list.
    let harnesses = harnesses.into_iter().par_bridge();
    let mut answers: Vec<Answer> = harnesses.map(check).collect();
    answers.sort_by(|one, other| one.harness.cmp(&other.harness));
    let proved = |answer: &&Answer| answer.verdict == Verdict::Proved;
    let count = answers.iter().filter(proved).count();
    if arguments.json {
        println!("{:#}", json!(answers));
    } else {
        println!("{count} proved, {} not proved", answers.len() - count);
    }
    let any_fails = answers.iter().any(|answer| answer.verdict.is_failure());
    Ok(if any_fails {
        ExitCode::FAILURE
    } else if count < answers.len() {
        ExitCode::from(3)
    } else {
        ExitCode::SUCCESS
    })
}

/// Prints the outcome of a harness as soon as it is known. With `json`, leaves out the details, because the JSON output
/// will contain them.
fn show(answer: &Answer, json: bool) {
    let Answer {
        harness,
        properties,
        covers,
        seconds,
        ..
    } = answer;
    let verdict = format!("{:?}", answer.verdict);
    let when = if answer.is_old {
        "before".to_owned()
    } else {
        format!("{seconds:.1} s")
    };
    eprintln!("{verdict:<8} {harness} ({properties} properties, {covers} covers, {when})");
    if !json {
        let failures = answer.failures.iter().map(|failure| format!("  {failure}"));
        let inputs = answer.inputs.iter().map(|input| format!("    {input}"));
        failures.chain(inputs).for_each(|line| eprintln!("{line}"));
    }
}
