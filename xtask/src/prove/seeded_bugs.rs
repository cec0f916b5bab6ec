//! Puts one bug at a time into a copy of the sources, and demands that its theorem fails; or, for a
//! bug in what stands in for Kani's library, that the checker's own check does.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail, ensure};
use serde::Deserialize;

use super::cbmc::Cbmc;
use super::harness::Harness;
use super::outcome::Outcome;
use super::{Limits, PACKAGE, all_harnesses, each_in_parallel, model, self_check, symbol};
use crate::source_copy::copy_workspace;
use crate::table::with_header;
use crate::workspace::Workspace;

const BUGS: &str = "proofs/seeded-bugs.toml";

#[derive(Deserialize)]
struct Bugs {
    bug: Vec<Bug>,
}

/// A mistake that someone might make.
#[derive(Deserialize)]
struct Bug {
    /// What is wrong, in a few words.
    mistake: String,
    file: PathBuf,
    /// Stands once in the file, and is replaced.
    right: String,
    wrong: String,
    /// The harnesses that must fail, all of one package.
    caught_by: Vec<String>,
}

/// No mistake in the sources can break it: it shows something of the format itself.
const OF_THE_FORMAT: &str = "checksum::four_wrong_bits_can_go_unnoticed";

impl Bug {
    /// The file's text with the mistake.
    fn put_into(&self, sound: &str) -> Result<String> {
        let places = sound.matches(&self.right).count();
        ensure!(
            places == 1,
            "{BUGS}: what \"{}\" replaces stands {places} times in {}, not once",
            self.mistake,
            self.file.display()
        );
        Ok(sound.replace(&self.right, &self.wrong))
    }
}

fn read(root: &Path) -> Result<Vec<Bug>> {
    let text = fs::read_to_string(root.join(BUGS)).context(BUGS)?;
    let Bugs { bug } = toml::from_str(&text).context(BUGS)?;
    Ok(bug)
}

/// Prints which theorem catches which, on standard error beside JSON's results; an error if any is
/// not caught.
pub(crate) fn run(workspace: &Workspace, cbmc: &Cbmc, limits: &Limits) -> Result<()> {
    let bugs = read(&workspace.root)?;
    let target = model::target(workspace);
    let copy = target.join("seeded");
    copy_workspace(
        &workspace.root,
        &copy,
        &["core", "proofs"],
        &["core", "proofs", "proofs/self-check"],
    )?;

    let packages = packages(workspace)?;
    let [(_, harnesses), _] = &packages;
    every_harness_catches_one(harnesses, &bugs)?;
    let mut seeded = Vec::new();
    for bug in &bugs {
        let (package, harnesses) = catching(&packages, bug)?;
        let file = copy.join(&bug.file);
        let sound = fs::read_to_string(workspace.root.join(&bug.file))?;
        fs::write(&file, bug.put_into(&sound)?)?;
        let module = model::compile(&copy, &target, package);
        fs::write(&file, &sound)?;
        let module = module
            .with_context(|| format!("{BUGS}: with \"{}\" it does not compile", bug.mistake))?;
        seeded.push((bug, module, package, harnesses));
    }
    let tries: Vec<_> = seeded
        .iter()
        .flat_map(|(bug, module, package, harnesses)| {
            let with = move |harness| (bug, module, *package, harness);
            harnesses.iter().map(with)
        })
        .collect();
    let folder = target.join("seeded-harnesses");
    let outcomes = each_in_parallel(&tries, limits.jobs, |(bug, module, package, harness)| {
        // A folder for each: several bugs may be for one harness.
        let folder = folder.join(bug.mistake.replace(|c: char| !c.is_alphanumeric(), "-"));
        let symbol = symbol(package, harness);
        Outcome::timed(|| cbmc.check(module, &symbol, harness, &folder, limits.each))
    });

    let mut table = with_header(["seeded bug", "theorem", "caught by", "with"]);
    let mut survivors = Vec::new();
    for ((bug, _, package, harness), outcome) in tries.iter().zip(&outcomes) {
        let caught = how_caught(package, harness, outcome)?;
        if caught.is_none() {
            outcome.print_failures(&harness.name);
            survivors.push(format!("{} by {}", bug.mistake, harness.name));
        }
        let how = caught.as_deref().unwrap_or("NOTHING");
        table.add_row([&bug.mistake, &harness.theorem, &harness.name, how]);
    }
    eprintln!("{table}");
    if !survivors.is_empty() {
        bail!("not caught: {}", survivors.join("; "));
    }
    Ok(())
}

/// The theorems' harnesses, and those that check the checker.
fn packages(workspace: &Workspace) -> Result<[(&'static str, Vec<Harness>); 2]> {
    Ok([
        (PACKAGE, all_harnesses(workspace)?),
        (self_check::PACKAGE, self_check::harnesses(workspace)?),
    ])
}

/// The harnesses that must fail with that bug, and their package.
fn catching<'a>(
    packages: &'a [(&'static str, Vec<Harness>)],
    bug: &Bug,
) -> Result<(&'static str, Vec<&'a Harness>)> {
    for (package, all) in packages {
        let found: Vec<&Harness> = all
            .iter()
            .filter(|harness| bug.caught_by.contains(&harness.name))
            .collect();
        if !found.is_empty() && found.len() == bug.caught_by.len() {
            return Ok((package, found));
        }
    }
    bail!(
        "{BUGS}: \"{}\": no package has all of the harnesses {}",
        bug.mistake,
        bug.caught_by.join(", ")
    )
}

/// A harness that no bug is known to break may be one that cannot fail.
fn every_harness_catches_one(harnesses: &[Harness], bugs: &[Bug]) -> Result<()> {
    let catches = |harness: &&Harness| bugs.iter().any(|bug| bug.caught_by.contains(&harness.name));
    let idle: Vec<&str> = harnesses
        .iter()
        .filter(|harness| !catches(harness) && harness.name != OF_THE_FORMAT)
        .map(|harness| harness.name.as_str())
        .collect();
    ensure!(
        idle.is_empty(),
        "{BUGS} has no mistake for {}",
        idle.join(", ")
    );
    Ok(())
}

/// By which failure; `None` if the bug makes no difference.
fn how_caught(package: &str, harness: &Harness, outcome: &Outcome) -> Result<Option<String>> {
    // A harness that only took too long, or that could not be checked, has caught nothing.
    if outcome.properties + outcome.covers == 0 {
        return Ok(None);
    }
    if package == self_check::PACKAGE {
        let expected = self_check::expected(harness)?;
        let caught = !self_check::is_as_expected(expected, outcome);
        return Ok(caught.then(|| format!("not what must come of it: {expected}")));
    }
    let failure = outcome.failures.first();
    Ok(failure.map(|failure| failure.what.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mistake_fits_the_sources_and_names_harnesses() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let packages = packages(&workspace).expect("the harnesses");
        for bug in read(&workspace.root).expect("the list") {
            catching(&packages, &bug).expect("there are such harnesses");
            let sound = fs::read_to_string(workspace.root.join(&bug.file)).expect("its file");
            let wrong = bug.put_into(&sound).expect("stands there once");
            assert_ne!(wrong, sound, "{}", bug.mistake);
            assert!(bug.put_into(&wrong.replace(&bug.right, "")).is_err());
        }
    }

    #[test]
    fn every_harness_is_broken_by_some_mistake() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let harnesses = all_harnesses(&workspace).expect("the harnesses");
        let bugs = read(&workspace.root).expect("the list");
        every_harness_catches_one(&harnesses, &bugs).expect("none that catches nothing");
        assert!(every_harness_catches_one(&harnesses, &[]).is_err());
    }
}
