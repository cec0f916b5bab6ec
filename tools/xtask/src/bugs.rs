//! `cargo xtask bugs`: puts one mistake at a time into a copy of the sources. For each mistake, a file lists the
//! harnesses or the test that must fail. A harness that no mistake breaks proves nothing.

use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use serde::Deserialize;

use crate::firmware::{self, test_passes};
use crate::machine_code;
use crate::prove::{Engine, Prover};
use crate::stage_report::Report;
use crate::workspace::Workspace;

const PROOFS: &str = "proofs/seeded-bugs.toml";
const FIRMWARE: &str = "firmware/seeded-bugs.toml";
/// The file with the bugs that the proofs about the receivers in C must find.
const OF_C: &str = "c/seeded-bugs.toml";
/// The folders and packages that are copied for the proofs.
const PROOFS_FOLDERS: &[&str] = &[
    "core",
    "proofs",
    "formats",
    "firmware/reception",
    "fuzz/oracles",
    "tools/prover",
    "c/headers",
    "c/proofs",
    // The engine that the proofs in c/proofs include.
    "host/generate/templates",
];
const PROOFS_MEMBERS: &[&str] = &[
    "core",
    "proofs",
    "tools/prover/stand-in",
    "tools/prover/stand-in/macros",
    "tools/prover/tests/harnesses",
    "formats",
    "firmware/reception",
    // Only tests of the core and of the formats depend on this package. These tests do not run here, but cargo needs
    // the package.
    "fuzz/oracles",
    "c/proofs",
];
/// The prover's own harnesses: some must hold, and the others must fail.
const CHECKED: &str = "framelock-checked-harnesses";

/// Put the seeded bugs into a copy of the sources, one at a time, and check that each is caught
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Engine that checks harnesses [default: Kani if it is set up, otherwise the offline prover]
    #[arg(long)]
    engine: Option<Engine>,

    /// Check only bugs whose mistake, file, harness or test contains one of these names. The name `checker` checks the
    /// engine itself, which must reject harnesses that have a fault. Without names, check all bugs and `checker`
    names: Vec<String>,
}

#[derive(Deserialize)]
struct Bugs {
    bug: Vec<Bug>,
}

/// A seeded bug: a mistake that someone might make.
#[derive(Deserialize)]
struct Bug {
    mistake: String,
    file: String,
    /// The text to be replaced, which occurs exactly once in the file.
    right: String,
    wrong: String,
    /// The harnesses that must fail.
    #[serde(default)]
    harnesses: Vec<String>,
    /// The harnesses that must still hold.
    #[serde(default)]
    unnoticed_by: Vec<String>,
    /// The firmware test that must fail.
    test: Option<String>,
}

fn read(root: &Path, file: &str) -> Result<Bugs> {
    let text = fs::read_to_string(root.join(file))?;
    toml::from_str(&text).with_context(|| file.to_owned())
}

impl Bug {
    /// Returns two versions of the file: without and with the mistake.
    fn texts(&self, root: &Path) -> Result<(String, String)> {
        let right = fs::read_to_string(root.join(&self.file))?;
        let places = right.matches(&self.right).count();
        let (file, mistake) = (&self.file, &self.mistake);
        ensure!(
            places == 1,
            "\"{mistake}\": its `right` occurs {places} times in {file}, not once"
        );
        let wrong = right.replace(&self.right, &self.wrong);
        Ok((right, wrong))
    }

    fn is_in_c(&self) -> bool {
        self.file.starts_with("c/") || self.file.starts_with("host/generate/")
    }

    fn is_wanted(&self, names: &[String]) -> bool {
        let mut says = [&self.mistake, &self.file]
            .into_iter()
            .chain(&self.harnesses)
            .chain(&self.test);
        if names.is_empty() {
            // Skip the bugs in machine code, which have a stage of their own.
            return self.test.as_deref() != Some(machine_code::NAME);
        }
        says.any(|says| names.iter().any(|name| says.contains(name.as_str())))
    }
}

/// Runs the stage of `verify --all`.
pub(crate) fn stage(workspace: &Workspace, _: &mut Report) -> Result<()> {
    run(workspace, None, &[])
}

pub(crate) fn bugs(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    run(workspace, arguments.engine, &arguments.names)
}

pub(crate) fn run(workspace: &Workspace, engine: Option<Engine>, names: &[String]) -> Result<()> {
    let root = &workspace.root;
    let mut prover = Prover::new(workspace, engine)?;
    prover.packages.push(CHECKED);
    let mut missed = Vec::new();
    let with_checker = names.is_empty() || names.iter().any(|name| name == "checker");
    if with_checker {
        let checked = ["fails::".to_owned(), "holds::".to_owned()];
        missed.extend(unexpected(&prover, &checked, true)?);
    }
    let bugs = read(root, PROOFS)?.bug.into_iter();
    let bugs = bugs.chain(read(root, FIRMWARE)?.bug);
    let mut bugs: Vec<_> = bugs.chain(read(root, OF_C)?.bug).collect();
    bugs.retain(|bug| bug.is_wanted(names));
    ensure!(
        with_checker || !bugs.is_empty(),
        "no bug has {} in its mistake, file, harness or test",
        names.join(" or ")
    );
    for bug in bugs {
        if prover.engine == Engine::Kani && bug.file.starts_with("tools/prover/") {
            continue;
        }
        let mut prover = if bug.is_in_c() {
            Prover::of_c(workspace)?
        } else {
            prover.clone()
        };
        println!("\n=== {} ===", bug.mistake);
        let copies = workspace.target_directory.join("bugs");
        let copy = copies.join(bug.test.as_ref().map_or("proofs", |_| "firmware"));
        match bug.test {
            Some(_) => firmware::copy(workspace, &copy)?,
            None => workspace.copy(&copy, PROOFS_FOLDERS, PROOFS_MEMBERS)?,
        }
        let (_, wrong) = bug.texts(root)?;
        fs::write(copy.join(&bug.file), wrong)?;
        prover.root.clone_from(&copy);
        prover.target = copy.join("target");
        let survived = match &bug.test {
            Some(test) => {
                let passes = match test.as_str() {
                    machine_code::NAME => machine_code::is_proved(workspace, &copy)?,
                    firmware::CONTRADICTIONS => {
                        firmware::accepted_contradictions(&copy)?.is_empty()
                    }
                    test => test_passes(workspace, &copy, test)?,
                };
                Vec::from_iter(passes.then(|| test.clone()))
            }
            None => unexpected(&prover, &bug.harnesses, false)?,
        };
        if !bug.unnoticed_by.is_empty() {
            let noticed = unexpected(&prover, &bug.unnoticed_by, true)?;
            ensure!(noticed.is_empty(), "{} noticed it, too", noticed.join(", "));
        }
        missed.extend(
            survived
                .iter()
                .map(|by| format!("\"{}\" by {by}", bug.mistake)),
        );
    }
    ensure!(missed.is_empty(), "not caught: {}", missed.join("; "));
    println!("All bugs were caught");
    Ok(())
}

/// Returns the harnesses with an unexpected outcome. In `sound` sources, the harnesses of the module `fails` must fail,
/// and all others must hold. In sources with a seeded bug, each harness must have the opposite outcome.
fn unexpected(prover: &Prover, harnesses: &[String], sound: bool) -> Result<Vec<String>> {
    let mut answers = prover.check(harnesses)?;
    for answer in &answers {
        println!(
            "{}: {} {:?}",
            answer.harness, answer.verdict, answer.failures
        );
    }
    answers.retain(|answer| {
        if answer.harness.starts_with("fails::") == sound {
            !answer.is_refuted()
        } else {
            !answer.is_proved()
        }
    });
    Ok(answers.into_iter().map(|answer| answer.harness).collect())
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;
    use crate::theorems::{is_called, theorems};

    /// The harnesses of the theorems, and those of the prover's own tests.
    static HARNESSES: LazyLock<(Vec<String>, Vec<String>)> = LazyLock::new(|| {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let mut prover = Prover::new(&workspace, Some(Engine::Offline))
            .expect("the offline prover is available");
        let theorems = prover.listed().expect("the harnesses compile");
        prover.packages = vec![CHECKED];
        let checked = prover.list().expect("the harnesses compile");
        for one in &theorems {
            let name = &one.name;
            assert!(
                one.ends_with_cover,
                "{name} does not end with a cover, so Kani would not notice if its end were unreachable"
            );
        }
        (theorems.into_iter().map(|one| one.name).collect(), checked)
    });

    #[test]
    fn every_seeded_bug_fits_the_sources_and_every_harness_is_broken_by_one() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let root = &workspace.root;
        let (theorems, checked) = &*HARNESSES;
        let proofs = read(root, PROOFS).expect("a list");
        let firmware = read(root, FIRMWARE).expect("a list");
        for bug in proofs.bug.iter().chain(&firmware.bug) {
            let (right, wrong) = bug.texts(root).expect("the text occurs once");
            assert_ne!(right, wrong, "{}", bug.mistake);
            assert_eq!(
                bug.test.is_some(),
                bug.harnesses.is_empty(),
                "{}",
                bug.mistake
            );
            for end in &bug.harnesses {
                let all = theorems.iter().chain(checked);
                assert_eq!(all.filter(|one| is_called(one, end)).count(), 1, "{end}");
            }
        }
        for harness in theorems {
            let mut broken = proofs.bug.iter().flat_map(|bug| &bug.harnesses);
            let is_broken = broken.any(|end| is_called(harness, end));
            assert!(is_broken, "{PROOFS} has no bug that {harness} catches");
        }
    }

    /// Returns the kind of a harness about C: the harness's name without modules and without `_int16`. Harnesses of one
    /// kind differ only in the header, the width of `int`, and the number of pending bytes.
    fn kind(harness: &str) -> &str {
        let name = harness.rsplit("::").next().unwrap_or(harness);
        name.trim_end_matches("_int16")
    }

    #[test]
    fn every_seeded_bug_in_c_fits_the_sources_and_every_kind_of_harness_is_broken_by_one() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let prover = Prover::of_c(&workspace).expect("the offline prover is available");
        let harnesses = prover.list().expect("the harnesses compile");
        let bugs = read(&workspace.root, OF_C).expect("a list").bug;
        for bug in &bugs {
            let (right, wrong) = bug.texts(&workspace.root).expect("the text occurs once");
            assert_ne!(right, wrong, "{}", bug.mistake);
            for end in bug.harnesses.iter().chain(&bug.unnoticed_by) {
                let named = harnesses.iter().filter(|one| is_called(one, end));
                assert_eq!(named.count(), 1, "{end}");
            }
        }
        let broken = bugs.iter().flat_map(|bug| &bug.harnesses);
        let broken: Vec<&str> = broken.map(|harness| kind(harness)).collect();
        for harness in &harnesses {
            let is_broken = broken.contains(&kind(harness));
            assert!(
                is_broken,
                "{OF_C} has no bug that breaks a harness like {harness}"
            );
        }
    }

    #[test]
    fn every_theorem_of_the_table_has_a_harness_and_every_harness_a_theorem() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let (harnesses, _) = &*HARNESSES;
        let theorems = theorems(&workspace.root).expect("a table");
        for theorem in &theorems {
            let is_shown = harnesses.iter().any(|one| theorem.is_shown_by(one));
            assert!(is_shown, "no harness: {}", theorem.title);
        }
        for harness in harnesses {
            let has_one = theorems.iter().any(|theorem| theorem.is_shown_by(harness));
            assert!(has_one, "no theorem names {harness}");
        }
    }
}
