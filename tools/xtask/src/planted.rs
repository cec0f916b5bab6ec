//! Runs a test in a copy of the whole workspace, in which a mistake has been planted.

use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use framelock_limited::Process;
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use serde::Deserialize;
use xshell::cmd;

use crate::stage_report::TestCount;
use crate::workspace::{Workspace, cargo_in, copy_file};

/// The time limit of a test. A test that runs longer hangs.
pub(crate) const LIMIT: Duration = Duration::from_secs(600);

/// A test that must fail.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Test {
    pub(crate) package: String,
    /// The target of the package that contains the test. Without a target, all targets are built.
    target: Option<String>,
    /// The test's name with its modules.
    #[serde(rename = "test")]
    pub(crate) name: String,
}

/// A test's outcome.
#[derive(PartialEq, Eq, Debug)]
pub(crate) enum Outcome {
    Passed,
    Failed,
    Hangs,
    /// The tests do not compile, or the test's program ended without a result, or the name is not the name of exactly
    /// one test.
    NoResult,
}

/// Copies all files of the workspace, except files that git ignores.
pub(crate) fn copy(workspace: &Workspace, to: &Path) -> Result<()> {
    let sh = workspace.shell()?;
    let listed = cmd!(sh, "git ls-files --cached --others --exclude-standard").read()?;
    for file in listed.lines() {
        let (from, to) = (workspace.root.join(file), to.join(file));
        if let Ok(target) = fs::read_link(&from) {
            if !to.is_symlink() {
                fs::create_dir_all(to.parent().context("a file is in a folder")?)?;
                symlink(target, to)?;
            }
        } else if from.exists() {
            copy_file(&from, &to)?;
        }
    }
    Ok(())
}

impl Test {
    /// Runs the test in the workspace at `root`.
    pub(crate) fn run(&self, root: &Path, limit: Duration) -> Result<Outcome> {
        let tests = || {
            let mut cargo = cargo_in(root);
            cargo.env("CARGO_TARGET_DIR", root.join("target"));
            cargo.args(["test", "--package", &self.package]);
            cargo.args(self.target.iter().flat_map(|target| ["--test", target]));
            cargo
        };
        if !Process::start_within(3 * LIMIT, tests().arg("--no-run"))?
            .wait()?
            .success()
        {
            return Ok(Outcome::NoResult);
        }
        let printed = root.join("target/printed");
        let mut cargo = tests();
        cargo.args(["--", "--include-ignored", "--exact", &self.name]);
        cargo.stdout(File::create(&printed)?).process_group(0);
        let (mut child, start) = (cargo.spawn()?, Instant::now());
        while child.try_wait()?.is_none() {
            if start.elapsed() > limit {
                killpg(Pid::from_raw(child.id().try_into()?), Signal::SIGKILL)?;
                child.wait()?;
                return Ok(Outcome::Hangs);
            }
            sleep(Duration::from_millis(100));
        }
        let mut count = TestCount::default();
        for line in fs::read_to_string(&printed)?.lines() {
            count += TestCount::of_line(line);
        }
        Ok(match (count.passed, count.failed) {
            (1, 0) => Outcome::Passed,
            (0, 1) => Outcome::Failed,
            _ => Outcome::NoResult,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MANIFEST: &str = "[package]\nname = 'planted'\n[workspace]\n";
    const TESTS: &str = "
        #[test] fn passes() {}
        #[test] fn fails() { assert!(false); }
        #[test] fn hangs() { loop { std::thread::yield_now(); } }
        #[test] fn ends_the_program() { std::process::exit(1); }
    ";

    #[test]
    fn only_a_test_that_runs_and_fails_has_failed() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let root = workspace.target_directory.join("planted-tests");
        fs::create_dir_all(root.join("src")).expect("a folder");
        fs::write(root.join("Cargo.toml"), MANIFEST).expect("written");
        let outcome = |name: &str, tests: &str| {
            fs::write(root.join("src/lib.rs"), tests).expect("written");
            let test = Test {
                package: "planted".to_owned(),
                target: None,
                name: name.to_owned(),
            };
            test.run(&root, Duration::from_secs(5)).expect("cargo runs")
        };
        assert_eq!(outcome("passes", TESTS), Outcome::Passed);
        assert_eq!(outcome("fails", TESTS), Outcome::Failed);
        assert_eq!(outcome("hangs", TESTS), Outcome::Hangs);
        assert_eq!(outcome("ends_the_program", TESTS), Outcome::NoResult);
        assert_eq!(outcome("unknown", TESTS), Outcome::NoResult);
        assert_eq!(outcome("fails", "does not compile"), Outcome::NoResult);
    }
}
