//! `cargo xtask bugs`: puts one mistake at a time into a copy of the sources; what is named for it
//! must notice. What nothing can break proves nothing.

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
/// The folders of the copy for the proofs, and its packages.
const PROOFS_FOLDERS: &[&str] = &[
    "core",
    "proofs",
    "formats",
    "firmware/reception",
    "fuzz/oracles",
    "tools/prover",
];
const PROOFS_MEMBERS: &[&str] = &[
    "core",
    "proofs",
    "tools/prover/stand-in",
    "tools/prover/stand-in/macros",
    "tools/prover/tests/harnesses",
    "formats",
    "firmware/reception",
    // For the core's tests, which are not run.
    "fuzz/oracles",
];
/// The checker's own harnesses: those that must hold, and those that must fail.
const CHECKED: &str = "framelock-checked-harnesses";

/// Put the seeded bugs into a copy of the sources, one at a time: each must be caught.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// What checks harnesses; by default Kani where it is set up, and else the offline prover.
    #[arg(long)]
    engine: Option<Engine>,

    /// Only the bugs whose mistake, file, harness or test contains this. With `checker`, also whether the
    /// engine finds what must fail; without names, that and all bugs.
    names: Vec<String>,
}

#[derive(Deserialize)]
struct Bugs {
    /// Harnesses that show something that no mistake in the sources can break.
    #[cfg(test)]
    #[serde(default)]
    unbreakable: Vec<String>,
    bug: Vec<Bug>,
}

/// A mistake that someone might make.
#[derive(Deserialize)]
struct Bug {
    mistake: String,
    file: String,
    /// Stands once in the file, and is replaced.
    right: String,
    wrong: String,
    /// The harnesses that must fail.
    #[serde(default)]
    harnesses: Vec<String>,
    /// The test of the firmware that must fail.
    test: Option<String>,
}

fn read(root: &Path, file: &str) -> Result<Bugs> {
    let text = fs::read_to_string(root.join(file))?;
    toml::from_str(&text).with_context(|| file.to_owned())
}

impl Bug {
    /// The file's text without and with the mistake.
    fn texts(&self, root: &Path) -> Result<(String, String)> {
        let right = fs::read_to_string(root.join(&self.file))?;
        let places = right.matches(&self.right).count();
        let (file, mistake) = (&self.file, &self.mistake);
        ensure!(
            places == 1,
            "\"{mistake}\": its `right` stands {places} times in {file}"
        );
        let wrong = right.replace(&self.right, &self.wrong);
        Ok((right, wrong))
    }

    fn is_wanted(&self, names: &[String]) -> bool {
        let mut says = [&self.mistake, &self.file]
            .into_iter()
            .chain(&self.harnesses)
            .chain(&self.test);
        if names.is_empty() {
            // Those have a stage of their own.
            return self.test.as_deref() != Some(machine_code::NAME);
        }
        says.any(|says| names.iter().any(|name| says.contains(name.as_str())))
    }
}

/// The stage of `verify --all`.
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
        missed.extend(judged(&prover, &checked, true)?);
    }
    let bugs = read(root, PROOFS)?.bug.into_iter();
    let mut bugs: Vec<_> = bugs.chain(read(root, FIRMWARE)?.bug).collect();
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
                    test => test_passes(workspace, &copy, test)?,
                };
                Vec::from_iter(passes.then(|| test.clone()))
            }
            None => judged(&prover, &bug.harnesses, false)?,
        };
        missed.extend(
            survived
                .iter()
                .map(|by| format!("\"{}\" by {by}", bug.mistake)),
        );
    }
    ensure!(missed.is_empty(), "not caught: {}", missed.join("; "));
    println!("All were caught");
    Ok(())
}

/// The harnesses that do not come out as they must; or with a bug, those that come out as if there
/// were none. One in `fails` must fail, every other must hold.
fn judged(prover: &Prover, harnesses: &[String], sound: bool) -> Result<Vec<String>> {
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
    use super::*;
    use crate::theorems::{is_called, theorems};

    /// The harnesses of the theorems, and of the checker.
    fn harnesses(workspace: &Workspace) -> (Vec<String>, Vec<String>) {
        let mut prover = Prover::new(workspace, Some(Engine::Offline)).expect("it is there");
        let theorems = prover.listed().expect("they compile");
        prover.packages = vec![CHECKED];
        let checked = prover.list().expect("they compile");
        for one in &theorems {
            let name = &one.name;
            assert!(
                one.ends_with_cover,
                "Kani would not see that {name} has an end"
            );
        }
        (theorems.into_iter().map(|one| one.name).collect(), checked)
    }

    #[test]
    fn every_mistake_fits_the_sources_and_every_harness_is_broken_by_one() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let root = &workspace.root;
        let (theorems, checked) = harnesses(&workspace);
        let proofs = read(root, PROOFS).expect("a list");
        let firmware = read(root, FIRMWARE).expect("a list");
        for bug in proofs.bug.iter().chain(&firmware.bug) {
            let (right, wrong) = bug.texts(root).expect("it stands there once");
            assert_ne!(right, wrong, "{}", bug.mistake);
            assert_eq!(
                bug.test.is_some(),
                bug.harnesses.is_empty(),
                "{}",
                bug.mistake
            );
            for end in &bug.harnesses {
                let all = theorems.iter().chain(&checked);
                assert_eq!(all.filter(|one| is_called(one, end)).count(), 1, "{end}");
            }
        }
        let broken = proofs.bug.iter().flat_map(|bug| &bug.harnesses);
        let broken: Vec<&String> = broken.chain(&proofs.unbreakable).collect();
        for harness in &theorems {
            let is_broken = broken.iter().any(|end| is_called(harness, end));
            assert!(is_broken, "{PROOFS} has no mistake that {harness} catches");
        }
    }

    #[test]
    fn every_theorem_of_the_table_has_a_harness_and_every_harness_a_theorem() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let (harnesses, _) = harnesses(&workspace);
        let theorems = theorems(&workspace.root).expect("a table");
        for theorem in &theorems {
            let is_shown = harnesses.iter().any(|one| theorem.is_shown_by(one));
            assert!(is_shown, "no harness: {}", theorem.title);
        }
        for harness in &harnesses {
            let has_one = theorems.iter().any(|theorem| theorem.is_shown_by(harness));
            assert!(has_one, "no theorem names {harness}");
        }
    }
}
