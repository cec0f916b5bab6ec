//! Checks Kani harnesses with CBMC alone, for machines where Kani cannot be set up: see README.md.

mod cbmc;
mod cbmc_setup;
mod child_processes;
mod compile;
mod harness;
mod llvm;
mod proof_cache;
mod translate;

use std::collections::BTreeSet;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, ensure};
use clap::{Parser, ValueEnum};
use rayon::ThreadPoolBuilder;
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};
use serde_json::json;

use cbmc::{Answer, Verdict};
use compile::Sources;
use harness::{Harness, harnesses};
use proof_cache::ProofCache;

/// Check the Kani harnesses of the workspace in this folder, with CBMC alone.
#[derive(Parser)]
struct Arguments {
    #[arg(default_value = "prove")]
    action: Action,

    /// A package with harnesses in its library.
    #[arg(long = "package", short, required = true)]
    packages: Vec<String>,

    /// Only the harnesses of this name, with or without modules, or if there are none, those whose
    /// names contain it.
    #[arg(long = "harness", value_name = "NAME")]
    harnesses: Vec<String>,

    /// How long each harness may take, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 600)]
    timeout: u64,

    /// How many harnesses are checked at the same time; 0 is as many as there are cores.
    #[arg(long, value_name = "N", default_value_t = 0)]
    jobs: usize,

    /// Prove again what was proved before and has not changed.
    #[arg(long)]
    anew: bool,

    /// End with the first harness that fails, whatever else still runs.
    #[arg(long, conflicts_with = "format")]
    fail_fast: bool,

    /// How the results are written.
    #[arg(long, default_value = "text")]
    format: Format,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Action {
    /// Check the harnesses.
    Prove,
    /// List the harnesses.
    List,
    /// Have the compiler and clippy look at the harnesses; a warning is an error.
    Clippy,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Text,
    Json,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// Whether all is well.
fn run(arguments: &Arguments) -> Result<bool> {
    child_processes::end_with_the_prover()?;
    let sources = Sources::new(&arguments.packages)?;
    match arguments.action {
        Action::Prove => prove(&sources, arguments),
        Action::List => list(&sources, arguments).map(|()| true),
        Action::Clippy => sources.clippy().map(|()| true),
    }
}

/// The harnesses that were asked for.
fn selected(sources: &Sources, arguments: &Arguments) -> Result<Vec<Harness>> {
    let mut harnesses = harnesses(&sources.as_written()?)?;
    let mut wanted = BTreeSet::new();
    for name in &arguments.harnesses {
        let end = format!("::{name}");
        let is_whole = |one: &str| one == name || one.ends_with(&end);
        let names: Vec<String> = harnesses
            .iter()
            .map(|harness| harness.name.clone())
            .collect();
        let any_whole = names.iter().any(|one| is_whole(one));
        let is_found = |one: &String| is_whole(one) || !any_whole && one.contains(name);
        let found: Vec<String> = names.into_iter().filter(is_found).collect();
        ensure!(!found.is_empty(), "there is no harness {name}");
        wanted.extend(found);
    }
    harnesses.retain(|harness| wanted.is_empty() || wanted.contains(&harness.name));
    ensure!(!harnesses.is_empty(), "the packages have no harness");
    Ok(harnesses)
}

fn list(sources: &Sources, arguments: &Arguments) -> Result<()> {
    let harnesses = selected(sources, arguments)?;
    if arguments.format == Format::Json {
        println!("{}", json!(harnesses));
        return Ok(());
    }
    for harness in harnesses {
        println!("{}", harness.name);
    }
    Ok(())
}

fn prove(sources: &Sources, arguments: &Arguments) -> Result<bool> {
    let harnesses = selected(sources, arguments)?;
    let module = sources.improved()?;
    let cbmc = cbmc_setup::find(&std::env::current_exe()?.with_file_name("debian-cbmc"))?;
    eprintln!("Engine: {}", cbmc.says);
    let cache = ProofCache::new(&sources.target, &cbmc, arguments.anew)?;
    let limit = Duration::from_secs(arguments.timeout);
    let pool = ThreadPoolBuilder::new().num_threads(arguments.jobs);
    let check = |harness: &Harness| {
        let answer = cbmc::check(&cbmc, &module, harness, &cache, limit);
        show(&answer, arguments.format);
        if arguments.fail_fast && answer.verdict != Verdict::Proved {
            child_processes::end_all(1);
        }
        answer
    };
    let answers: Vec<Answer> = pool
        .build()?
        .install(|| harnesses.par_iter().map(check).collect());
    let proved = |answer: &&Answer| answer.verdict == Verdict::Proved;
    let count = answers.iter().filter(proved).count();
    if arguments.format == Format::Json {
        println!("{:#}", json!(answers));
    } else {
        println!("{count} proved, {} failed", answers.len() - count);
    }
    Ok(count == answers.len())
}

/// Shows what became of a harness, as soon as that is known; the details only to a reader.
fn show(answer: &Answer, format: Format) {
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
    if format == Format::Text {
        let failures = answer.failures.iter().map(|failure| format!("  {failure}"));
        let inputs = answer.inputs.iter().map(|input| format!("    {input}"));
        failures.chain(inputs).for_each(|line| eprintln!("{line}"));
    }
}
