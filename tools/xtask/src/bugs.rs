//! `cargo xtask bugs`: puts each mistake alone into a copy of the workspace, and checks that it is noticed. For each
//! mistake, a file lists the harnesses or the test that must fail. A harness that no mistake breaks proves nothing.
//! Some mistakes make a sentence of the documentation false. If no check noticed such a mistake, nothing would ensure
//! that the sentence is true.
//!
//! A few copies are checked at the same time, so the outputs of the checks mix. Each check ends with a line that names
//! its mistake.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::sync::Mutex;
use std::thread;

use anyhow::{Context as _, Result, ensure};
use serde::Deserialize;

use crate::firmware;
use crate::planted::{LIMIT, Outcome, Test};
use crate::prove::{C_PROOFS, Engine, Prover};
use crate::theorems::{Answer, is_called};
use crate::workspace::Workspace;

const PROOFS: &str = "proofs/seeded-bugs.toml";
const FIRMWARE: &str = "firmware/seeded-bugs.toml";
/// The file with the bugs that the proofs about the receivers in C must find.
const OF_C: &str = "c/seeded-bugs.toml";
/// The file with mistakes that readers of the documentation planted. Each mistake contradicts a sentence.
const PLANTED: &str = "proofs/planted-mistakes.toml";
/// The package with harnesses that test the prover: some must hold, and the others must fail.
const CHECKED: &str = "framelock-checked-harnesses";
/// The most copies of the sources in which bugs are checked at the same time. Each copy has up to 2 GB of build
/// results, and the check of a harness takes up to 3 GB of memory.
const MOST_COPIES: usize = 4;
/// The value of `test` for the bugs that the proof of the machine code must find. As an argument, this name selects
/// these bugs.
const MACHINE_CODE: &str = "machine-code";

/// Put each seeded bug alone into a copy of the sources, and check that it is caught
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
    #[serde(alias = "mistake")]
    bug: Vec<Bug>,
}

/// A seeded bug: a mistake that someone might make.
#[derive(Deserialize)]
struct Bug {
    /// The mistake, or the sentence that it contradicts.
    #[serde(alias = "sentence")]
    mistake: String,
    file: String,
    /// The text to be replaced, which occurs exactly once in the file.
    right: String,
    wrong: String,
    /// The harnesses that must fail.
    #[serde(default)]
    harnesses: Vec<String>,
    /// True if the mistake makes a loop run too long. Then a harness may notice it by a loop's bound, and a test by a
    /// time limit.
    #[serde(default, alias = "endless")]
    is_endless: bool,
    /// The harnesses that must still hold.
    #[serde(default)]
    unnoticed_by: Vec<String>,
    /// The firmware's test that must fail. The names `contradictions` and `machine-code` stand for checks of their own.
    test: Option<String>,
    /// For a planted mistake: the check that must fail.
    check: Option<Check>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Check {
    Test(Test),
    Harness { harness: String },
}

fn read(root: &Path, file: &str) -> Result<Vec<Bug>> {
    let text = fs::read_to_string(root.join(file))?;
    let mut bugs: Bugs = toml::from_str(&text).with_context(|| file.to_owned())?;
    for bug in &mut bugs.bug {
        if let Some(Check::Harness { harness }) = &bug.check {
            bug.harnesses.push(harness.clone());
        }
    }
    Ok(bugs.bug)
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

    /// Returns the test that must fail.
    fn test(&self) -> Option<Test> {
        match (&self.test, &self.check) {
            (Some(test), _) => Some(Test {
                package: firmware::TESTS.to_owned(),
                target: Some("firmware".to_owned()),
                name: test.clone(),
            }),
            (None, Some(Check::Test(test))) => Some(test.clone()),
            (None, _) => None,
        }
    }

    /// Returns whether a test with this outcome has noticed the mistake.
    fn is_caught(&self, outcome: &Outcome) -> bool {
        match outcome {
            Outcome::Failed => true,
            Outcome::Hangs => self.is_endless,
            Outcome::Passed | Outcome::NoResult => false,
        }
    }

    /// Returns whether a harness has noticed the bug. A failed assertion, a panic, an overflow or an invalid access
    /// counts. A cover that is not satisfied does not count. An exceeded loop bound counts only if the bug makes a loop
    /// run too long.
    fn is_noticed(&self, answer: &Answer) -> bool {
        match answer.verdict.as_str() {
            // The harnesses of the module `fails` have faults. A bug in the prover is noticed if it hides a fault.
            _ if answer.harness.starts_with("fails::") => answer.is_proved(),
            _ if answer.harness.starts_with("holds::") => answer.is_refuted(),
            "failed" => true,
            "unwinding_too_small" => self.is_endless,
            _ => false,
        }
    }

    fn is_in_c(&self) -> bool {
        self.file.starts_with("c/") || self.file.starts_with("host/generate/")
    }

    fn is_wanted(&self, names: &[String]) -> bool {
        if names.is_empty() {
            // Skip the bugs in machine code, which have a stage of their own.
            return self.test.as_deref() != Some(MACHINE_CODE);
        }
        let mut says = vec![self.mistake.clone(), self.file.clone()];
        says.extend(self.harnesses.iter().cloned());
        says.extend(self.test().map(|test| test.name));
        let mut says = says.iter();
        says.any(|says| names.iter().any(|name| says.contains(name.as_str())))
    }

    /// Returns the packages that contain the bug's harnesses.
    fn packages(&self, of_packages: &[(&'static str, Vec<String>)]) -> Vec<&'static str> {
        let ends = || self.harnesses.iter().chain(&self.unnoticed_by);
        let contains = |harnesses: &[String]| {
            harnesses
                .iter()
                .any(|one| ends().any(|end| is_called(one, end)))
        };
        let containing = of_packages
            .iter()
            .filter(|(_, harnesses)| contains(harnesses));
        containing.map(|(package, _)| *package).collect()
    }

    /// Puts the bug into the prover's copy of the sources, and runs the bug's check. Returns a line for each harness or
    /// test that has not noticed the bug.
    fn check_in(&self, workspace: &Workspace, mut prover: Prover) -> Result<Vec<String>> {
        let mistake = &self.mistake;
        println!("\n=== {mistake} ===");
        if self.is_in_c() {
            prover.engine = Engine::Offline;
            prover.packages = vec![C_PROOFS];
        }
        workspace.copy(&prover.root)?;
        let (_, wrong) = self.texts(&workspace.root)?;
        fs::write(prover.root.join(&self.file), wrong)?;
        let survives = self.survives(workspace, &prover)?;
        if !self.unnoticed_by.is_empty() {
            let noticed = unexpected(&prover, &self.unnoticed_by)?;
            ensure!(noticed.is_empty(), "{} noticed it, too", noticed.join(", "));
        }
        let missed: Vec<_> = survives
            .iter()
            .map(|by| format!("\"{mistake}\" by {by}"))
            .collect();
        let word = if missed.is_empty() {
            "Caught"
        } else {
            "NOT CAUGHT"
        };
        println!("{word}: {mistake}");
        Ok(missed)
    }

    /// Runs the check in a copy of the sources that contains the bug. Returns the names of the harnesses or the test
    /// that have not noticed the bug.
    fn survives(&self, workspace: &Workspace, prover: &Prover) -> Result<Vec<String>> {
        let copy = &prover.root;
        let Some(test) = self.test() else {
            return unnoticed(prover, self);
        };
        let outcome = match self.test.as_deref() {
            Some(MACHINE_CODE) => {
                let (sources, built) = (copy.to_string_lossy(), copy.join("target"));
                let function = ["machine_code_of", &sources, &built.to_string_lossy()];
                let mut proof =
                    workspace.script(&[&function[..], &["default", "lecture"]].concat());
                Outcome::of(&proof.stderr(Stdio::inherit()).output()?, None)
            }
            Some(firmware::CONTRADICTIONS) => {
                let accepted = firmware::accepted_contradictions(workspace, copy)?;
                if accepted.is_empty() {
                    Outcome::Passed
                } else {
                    Outcome::Failed
                }
            }
            Some(_) => test.run(copy, LIMIT, Some(&workspace.images(copy, &[])?))?,
            None => test.run(copy, LIMIT, None)?,
        };
        println!("{}: {outcome:?}", test.name);
        let survives = (!self.is_caught(&outcome)).then(|| format!("{} ({outcome:?})", test.name));
        Ok(survives.into_iter().collect())
    }
}

/// Seeds the bugs that the arguments choose, each alone in a copy of the sources.
pub(crate) fn bugs(workspace: &Workspace, Arguments { engine, names }: &Arguments) -> Result<()> {
    let root = &workspace.root;
    let mut prover = Prover::new(workspace, *engine);
    prover.packages.push(CHECKED);
    let mut missed = Vec::new();
    let with_checker = names.is_empty() || names.iter().any(|name| name == "checker");
    if with_checker {
        let checked = ["fails::".to_owned(), "holds::".to_owned()];
        missed.extend(unexpected(&prover, &checked)?);
    }
    let mut bugs = Vec::new();
    for file in [PROOFS, FIRMWARE, OF_C, PLANTED] {
        bugs.extend(read(root, file)?);
    }
    bugs.retain(|bug| bug.is_wanted(names));
    ensure!(
        with_checker || !bugs.is_empty(),
        "no bug has {} in its mistake, file, harness or test",
        names.join(" or ")
    );
    // A bug in the offline prover has no effect on Kani.
    bugs.retain(|bug| prover.engine != Engine::Kani || !bug.file.starts_with("tools/prover/"));
    missed.extend(check_in_copies(workspace, &prover, bugs)?);
    ensure!(missed.is_empty(), "not caught: {}", missed.join("; "));
    println!("All bugs were caught");
    Ok(())
}

/// Checks the bugs in a few copies of the sources at the same time. Returns a line for each harness or test that has
/// not noticed a bug, and for each check that failed.
fn check_in_copies(workspace: &Workspace, prover: &Prover, bugs: Vec<Bug>) -> Result<Vec<String>> {
    let mut of_packages = Vec::new();
    if bugs.iter().any(|bug| !bug.harnesses.is_empty()) {
        for package in &prover.packages {
            let mut one = prover.clone();
            one.packages = vec![*package];
            of_packages.push((*package, one.list()?));
        }
    }
    let copies = thread::available_parallelism().map_or(1, usize::from);
    let copies = copies.min(MOST_COPIES).min(bugs.len());
    let remaining = Mutex::new(bugs.into_iter());
    let next = || remaining.lock().expect("no thread panics here").next();
    let check_in_copy = |number: usize| {
        let mut missed = Vec::new();
        while let Some(bug) = next() {
            let mut prover = prover.clone();
            prover.root = workspace.target.join(format!("bugs/copy-{number}"));
            prover.target = prover.root.join("target");
            prover.packages = bug.packages(&of_packages);
            // Check the other bugs even if this check fails, for example because the copy does not compile.
            missed.extend(bug.check_in(workspace, prover).unwrap_or_else(|error| {
                println!("NOT CAUGHT: {}: {error:#}", bug.mistake);
                vec![format!("\"{}\" ({error:#})", bug.mistake)]
            }));
        }
        missed
    };
    let missed = thread::scope(|scope| {
        let start = |number| scope.spawn(move || check_in_copy(number));
        let threads: Vec<_> = (0..copies).map(start).collect();
        let results = threads.into_iter().map(thread::ScopedJoinHandle::join);
        let results = results.map(|result| result.expect("no check panics"));
        results.collect::<Vec<_>>()
    });
    Ok(missed.concat())
}

/// Returns the bug's harnesses that have not noticed it.
fn unnoticed(prover: &Prover, bug: &Bug) -> Result<Vec<String>> {
    let mut answers = checked(prover, &bug.harnesses)?;
    answers.retain(|answer| !bug.is_noticed(answer));
    let names = answers
        .into_iter()
        .map(|one| format!("{} ({})", one.harness, one.verdict));
    Ok(names.collect())
}

/// Returns the harnesses whose outcome is not the one that they have without a mistake: the harnesses of the module
/// `fails` must fail, and all others must hold.
fn unexpected(prover: &Prover, harnesses: &[String]) -> Result<Vec<String>> {
    let mut answers = checked(prover, harnesses)?;
    answers.retain(|answer| {
        if answer.harness.starts_with("fails::") {
            !answer.is_refuted()
        } else {
            !answer.is_proved()
        }
    });
    Ok(answers.into_iter().map(|answer| answer.harness).collect())
}

/// Checks the harnesses, and prints the answers.
fn checked(prover: &Prover, harnesses: &[String]) -> Result<Vec<Answer>> {
    let answers = prover.check(harnesses)?;
    for answer in &answers {
        println!(
            "{}: {} {:?}",
            answer.harness, answer.verdict, answer.failures
        );
    }
    Ok(answers)
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;
    use crate::theorems::{Harness, is_named, quoted, theorems};
    use crate::workspace::files;

    /// The harnesses of the theorems, and those of the prover's own tests.
    static HARNESSES: LazyLock<(Vec<String>, Vec<String>)> = LazyLock::new(|| {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let mut prover = Prover::new(&workspace, Some(Engine::Offline));
        let theorems: Vec<Harness> = prover.offline("list", &[]).expect("the harnesses compile");
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

    /// Returns the bugs in a file. Asserts that each bug fits the sources.
    fn fitting(root: &Path, file: &str) -> Vec<Bug> {
        let bugs = read(root, file).expect("a list");
        for bug in &bugs {
            let (right, wrong) = bug.texts(root).expect("the text occurs once");
            assert_ne!(right, wrong, "{}", bug.mistake);
        }
        bugs
    }

    /// Checks that exactly one harness has this name.
    fn assert_one<'a>(harnesses: impl IntoIterator<Item = &'a String>, end: &str) {
        let named = harnesses.into_iter().filter(|one| is_called(one, end));
        assert_eq!(named.count(), 1, "{end}");
    }

    fn bug(more: &str) -> Bug {
        let fields = ["mistake", "file", "right", "wrong"].map(|key| format!("{key} = ''\n"));
        toml::from_str(&(fields.concat() + more)).expect("a bug")
    }

    #[test]
    fn only_a_test_that_fails_or_hangs_in_an_endless_loop_has_caught_a_mistake() {
        let (usual, endless) = (bug(""), bug("endless = true"));
        for (outcome, by_usual, by_endless) in [
            (Outcome::Failed, true, true),
            (Outcome::Hangs, false, true),
            (Outcome::Passed, false, false),
            (Outcome::NoResult, false, false),
        ] {
            assert_eq!(usual.is_caught(&outcome), by_usual, "{outcome:?}");
            assert_eq!(endless.is_caught(&outcome), by_endless, "{outcome:?}");
        }
    }

    #[test]
    fn only_a_failed_assertion_or_the_bound_of_an_endless_loop_notices_a_bug() {
        let (usual, endless) = (bug(""), bug("endless = true"));
        for (verdict, by_usual, by_endless) in [
            ("failed", true, true),
            ("unwinding_too_small", false, true),
            ("proved", false, false),
            ("cover_unsatisfied", false, false),
            ("vacuous", false, false),
            ("no_answer_in_time", false, false),
            ("error", false, false),
        ] {
            let answer = Answer {
                harness: "module::harness".to_owned(),
                verdict: verdict.to_owned(),
                ..Answer::default()
            };
            let has_no_answer = ["proved", "no_answer_in_time", "error"].contains(&verdict);
            assert_eq!(answer.is_refuted(), !has_no_answer, "{verdict}");
            assert_eq!(usual.is_noticed(&answer), by_usual, "{verdict}");
            assert_eq!(endless.is_noticed(&answer), by_endless, "{verdict}");
        }
    }

    #[test]
    fn every_seeded_bug_fits_the_sources_and_every_harness_is_broken_by_one() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let root = &workspace.root;
        let (theorems, checked) = &*HARNESSES;
        let (proofs, firmware) = (fitting(root, PROOFS), fitting(root, FIRMWARE));
        for bug in proofs.iter().chain(&firmware) {
            assert_eq!(
                bug.test.is_some(),
                bug.harnesses.is_empty(),
                "{}",
                bug.mistake
            );
            for end in &bug.harnesses {
                assert_one(theorems.iter().chain(checked), end);
            }
        }
        for harness in theorems {
            let mut broken = proofs.iter().flat_map(|bug| &bug.harnesses);
            let is_broken = broken.any(|end| is_called(harness, end));
            assert!(is_broken, "{PROOFS} has no bug that {harness} catches");
        }
    }

    #[test]
    fn every_planted_mistake_fits_the_sources_and_its_check_exists() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let root = &workspace.root;
        for mistake in fitting(root, PLANTED) {
            let is_there = |folder: &Path, name: &str| {
                let files = files(folder).expect("files");
                files.iter().any(|path| {
                    fs::read_to_string(path).is_ok_and(|text| text.contains(&format!("fn {name}(")))
                })
            };
            let Some(test) = mistake.test() else {
                let [harness] = &*mistake.harnesses else {
                    panic!("no check: {}", mistake.mistake);
                };
                assert_one(&HARNESSES.0, harness);
                continue;
            };
            let name = test.name.rsplit("::").next().expect("a name");
            let package = workspace
                .packages
                .iter()
                .find(|one| *one.name == test.package);
            let package = package.unwrap_or_else(|| panic!("no package {}", test.package));
            let folder = package.manifest_path.parent().expect("a folder");
            assert!(
                is_there(folder.as_std_path(), name),
                "no test {name} in {}",
                test.package
            );
        }
    }

    /// Returns the kind of a harness about C: the file that states it, and its name without `_int16`. Harnesses of one
    /// kind differ only in the header, the width of `int`, and the number of pending bytes.
    fn kind<'a>(folder: &Path, harness: &'a str) -> (&'a str, &'a str) {
        let mut path = harness.rsplit("::");
        let name = path.next().unwrap_or(harness);
        let header = path.next().expect("the name of a C file");
        let file = folder.join(header).with_extension("c");
        let file = fs::read_to_string(file).expect("the C file of a harness");
        let shared = ["window.h", "buffered.h", "packets.h", "failsafe.h"];
        let shared = shared
            .into_iter()
            .find(|shared| file.contains(&format!("#include \"{shared}\"")));
        (shared.unwrap_or(header), name.trim_end_matches("_int16"))
    }

    #[test]
    fn every_seeded_bug_in_c_fits_the_sources_and_every_kind_of_harness_is_broken_by_one() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let prover = Prover::of_c(&workspace);
        let harnesses = prover.list().expect("the harnesses compile");
        let bugs = fitting(&workspace.root, OF_C);
        for end in bugs
            .iter()
            .flat_map(|bug| bug.harnesses.iter().chain(&bug.unnoticed_by))
        {
            assert_one(&harnesses, end);
        }
        let broken = bugs.iter().flat_map(|bug| &bug.harnesses);
        let folder = workspace.root.join("c/proofs");
        let broken: Vec<_> = broken.map(|harness| kind(&folder, harness)).collect();
        for harness in &harnesses {
            let is_broken = broken.contains(&kind(&folder, harness));
            assert!(
                is_broken,
                "{OF_C} has no bug that breaks a harness like {harness}"
            );
        }
    }

    #[test]
    fn every_name_in_the_table_of_theorems_exists_and_every_harness_has_a_theorem() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let root = &workspace.root;
        let (harnesses, _) = &*HARNESSES;
        let theorems = theorems(root).expect("a table");
        let protocol = fs::read_to_string(root.join("docs/protocol.md")).expect("a page");
        let folders = ["core", "formats", "firmware", "proofs"];
        let folders = folders.map(|folder| files(&root.join(folder)).expect("files"));
        for theorem in &theorems {
            let title = theorem.title();
            assert!(theorem.names().next().is_some(), "no harness: {title}");
            for name in theorem.names() {
                let is_known = harnesses.iter().any(|harness| is_named(harness, name));
                assert!(is_known, "no harness or module is called {name}: {title}");
            }
            let [_, _, clauses, _, tests, oracles] = &theorem.0;
            for clause in clauses.split(", ").filter(|&clause| clause != "none") {
                assert!(
                    protocol.contains(&format!("**{clause}")),
                    "no clause {clause}: {title}"
                );
            }
            assert!(quoted(tests).next().is_some(), "no test: {title}");
            for test in quoted(tests) {
                let (file, name) = test.split_once("::").unwrap_or((test, ""));
                let mut files = folders.iter().flatten().filter(|path| path.ends_with(file));
                let is_known = files.any(|path| {
                    let text = fs::read_to_string(path).expect("text");
                    text.contains("#[test]") && text.contains(&format!("    fn {name}()"))
                        || text.contains(&format!("#[test]\nfn {name}"))
                });
                assert!(is_known, "no test {test}: {title}");
            }
            for oracle in quoted(oracles) {
                let target = root.join(format!("fuzz/fuzz_targets/{oracle}.rs"));
                assert!(target.exists(), "no fuzz target {oracle}: {title}");
            }
        }
        for harness in harnesses {
            let has_one = theorems.iter().any(|theorem| theorem.is_shown_by(harness));
            assert!(has_one, "no theorem names {harness}");
        }
    }
}
