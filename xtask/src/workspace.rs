//! The facts about this workspace that the stages need, as cargo tells them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Deserialize;

use crate::command;

/// The package that microcontrollers use, in the folder `core`.
pub(crate) const CORE: &str = "framelock";

/// The part of `cargo metadata` that the stages use.
#[derive(Deserialize)]
pub(crate) struct Workspace {
    #[serde(rename = "workspace_root")]
    pub(crate) root: PathBuf,
    pub(crate) target_directory: PathBuf,
    pub(crate) packages: Vec<Package>,
}

#[derive(Deserialize)]
pub(crate) struct Package {
    pub(crate) name: String,
    /// Each feature, with what it switches on.
    pub(crate) features: BTreeMap<String, Vec<String>>,
    pub(crate) targets: Vec<Target>,
}

#[derive(Deserialize)]
pub(crate) struct Target {
    pub(crate) name: String,
    pub(crate) kind: Vec<String>,
}

impl Workspace {
    /// Asks cargo.
    pub(crate) fn load() -> Result<Self> {
        // As `cargo xtask` says it now, not as it was when this program was compiled: a program
        // that cargo kept from a copy of the workspace would check that copy instead.
        let here = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| ".".into());
        let answer = command::output(command::cargo_in(Path::new(&here)).args([
            "metadata",
            "--no-deps",
            "--format-version=1",
        ]))?;
        serde_json::from_str(&answer).context("cargo metadata answered in an unexpected form")
    }

    /// The package of that name.
    pub(crate) fn package(&self, name: &str) -> Result<&Package> {
        self.packages
            .iter()
            .find(|package| package.name == name)
            .with_context(|| format!("the workspace has no package `{name}`"))
    }
}

impl Package {
    /// The optional features, without `default`, which is only a choice among them.
    pub(crate) fn optional_features(&self) -> Vec<&str> {
        self.features
            .keys()
            .map(String::as_str)
            .filter(|feature| *feature != "default")
            .collect()
    }

    /// The names of the benchmarks.
    pub(crate) fn benchmarks(&self) -> impl Iterator<Item = &str> {
        self.targets
            .iter()
            .filter(|target| target.kind.iter().any(|kind| kind == "bench"))
            .map(|target| target.name.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_features_and_benchmarks_out_of_what_cargo_answers() {
        let answer = r#"{
            "workspace_root": "/w", "target_directory": "/w/target", "version": 1,
            "packages": [{
                "name": "framelock",
                "features": {"default": ["serde"], "serde": ["dep:serde"], "defmt": []},
                "targets": [
                    {"name": "framelock", "kind": ["lib"]},
                    {"name": "throughput", "kind": ["bench"]}
                ]
            }]
        }"#;
        let workspace: Workspace = serde_json::from_str(answer).expect("the form cargo uses");
        let core = workspace.package(CORE).expect("it is listed");
        assert_eq!(core.optional_features(), ["defmt", "serde"]);
        assert_eq!(core.benchmarks().collect::<Vec<_>>(), ["throughput"]);
        assert!(workspace.package("absent").is_err());
    }

    #[test]
    fn this_workspace_has_the_core() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        assert!(workspace.package(CORE).is_ok());
    }
}
