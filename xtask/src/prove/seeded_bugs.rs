//! Puts one bug at a time into a copy of the sources, and demands that its theorem fails.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context as _, Result, bail, ensure};
use comfy_table::{Table, presets};
use serde::Deserialize;

use super::cbmc::Cbmc;
use super::outcome::Outcome;
use super::{Limits, PACKAGE, all_harnesses, each_in_parallel, model, symbol};
use crate::source_copy::copy_workspace;
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
    /// The harness that must fail.
    caught_by: String,
}

/// Prints which theorem catches which, on standard error beside JSON's results; an error if any is
/// not caught.
pub(crate) fn run(workspace: &Workspace, cbmc: &Cbmc, limits: &Limits) -> Result<()> {
    let text = fs::read_to_string(workspace.root.join(BUGS)).context(BUGS)?;
    let Bugs { bug: bugs } = toml::from_str(&text).context(BUGS)?;
    let target = model::target(workspace);
    let copy = target.join("seeded");
    copy_workspace(
        &workspace.root,
        &copy,
        &["core", "proofs"],
        &["core", "proofs"],
    )?;

    let harnesses = all_harnesses(workspace)?;
    let mut seeded = Vec::new();
    for bug in bugs {
        let harness = harnesses
            .iter()
            .find(|harness| harness.name == bug.caught_by);
        let harness =
            harness.with_context(|| format!("{BUGS}: there is no harness {}", bug.caught_by))?;
        let file = copy.join(&bug.file);
        let sound = fs::read_to_string(workspace.root.join(&bug.file))?;
        let places = sound.matches(&bug.right).count();
        ensure!(
            places == 1,
            "{BUGS}: what \"{}\" replaces stands {places} times in {}, not once",
            bug.mistake,
            bug.file.display()
        );
        fs::write(&file, sound.replace(&bug.right, &bug.wrong))?;
        let module = model::compile(&copy, &target, PACKAGE);
        fs::write(&file, &sound)?;
        let module = module
            .with_context(|| format!("{BUGS}: with \"{}\" it does not compile", bug.mistake))?;
        seeded.push((bug, module, harness));
    }
    let folder = target.join("seeded-harnesses");
    let outcomes = each_in_parallel(&seeded, limits.jobs, |(bug, module, harness)| {
        // A folder for each: several bugs may be for one harness.
        let folder = folder.join(bug.mistake.replace(|c: char| !c.is_alphanumeric(), "-"));
        let symbol = symbol(PACKAGE, harness);
        Outcome::timed(|| cbmc.check(module, &symbol, harness, &folder, limits.each))
    });

    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN).set_header([
        "seeded bug",
        "theorem",
        "caught by",
        "with",
    ]);
    let mut survivors = Vec::new();
    for ((bug, _, harness), outcome) in seeded.iter().zip(&outcomes) {
        // A harness that only took too long, or that could not be checked, has caught nothing.
        let caught = outcome.failures.first().filter(|_| outcome.properties > 0);
        if caught.is_none() {
            outcome.print_failures(&harness.name);
            survivors.push(bug.mistake.as_str());
        }
        let how = caught.map_or("NOTHING", |failure| &failure.what);
        table.add_row([&bug.mistake, &harness.theorem, &harness.name, how]);
    }
    eprintln!("{table}");
    if !survivors.is_empty() {
        bail!("not caught: {}", survivors.join("; "));
    }
    Ok(())
}
