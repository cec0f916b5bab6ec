//! Runs a test in a copy of the workspace, in which a mistake has been planted.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use anyhow::Result;
use serde::Deserialize;

use crate::test_count::TestCount;
use crate::workspace::cargo_in;

/// The time limit of a test. A test that runs longer counts as hanging.
pub(crate) const LIMIT: Duration = Duration::from_secs(600);

/// A test that must fail.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Test {
    pub(crate) package: String,
    /// The target of the package that contains the test. Without a target, all targets are built.
    pub(crate) target: Option<String>,
    /// The test's name with all its modules, or without any.
    #[serde(rename = "test")]
    pub(crate) name: String,
}

/// A test's outcome.
#[derive(PartialEq, Eq, Debug)]
pub(crate) enum Outcome {
    Passed,
    Failed,
    Hangs,
    /// The tests do not compile, or the test's program ended without a result, or the name fits no test or several.
    NoResult,
}

impl Outcome {
    /// Reads the output of tests. Prints it indented, because otherwise `cargo xtask verify` would count its tests.
    pub(crate) fn of(output: &Output, expected: Option<usize>) -> Self {
        let mut count = TestCount::default();
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            println!("    {line}");
            count += TestCount::of_line(line);
        }
        match (output.status.code(), count.failed) {
            // The exit codes with which `timeout` reports that it has ended the command.
            (Some(124 | 137), _) => Self::Hangs,
            _ if count.ended() == 0 || expected.is_some_and(|it| it != count.ended()) => {
                Self::NoResult
            }
            (_, 0) => Self::Passed,
            _ => Self::Failed,
        }
    }
}

impl Test {
    /// Runs the test in the workspace at `root`. If the test needs the firmware's images, it uses those in the folder
    /// `images`.
    pub(crate) fn run(
        &self,
        root: &Path,
        limit: Duration,
        images: Option<&Path>,
    ) -> Result<Outcome> {
        let cargo_within = |limit: Duration| {
            let mut cargo = Command::new("timeout");
            cargo.arg("--kill-after=5").arg(limit.as_secs().to_string());
            cargo.arg(cargo_in(root).get_program()).current_dir(root);
            // With all features, as in `cargo xtask verify`. Some tests exist only with a feature.
            cargo.args(["test", "--all-features", "--package", &self.package]);
            cargo.args(self.target.iter().flat_map(|target| ["--test", target]));
            cargo.env("CARGO_TARGET_DIR", root.join("target"));
            cargo.envs(images.map(|folder| ("FRAMELOCK_IMAGES", folder)));
            cargo
        };
        if !cargo_within(3 * LIMIT).arg("--no-run").status()?.success() {
            return Ok(Outcome::NoResult);
        }
        let mut test = cargo_within(limit);
        test.args(["--", "--include-ignored", &self.name]);
        // A name with modules is complete. Without `--exact`, cargo would also run other tests whose names contain this
        // one.
        if self.name.contains("::") {
            test.arg("--exact");
        }
        let output = test.stderr(Stdio::inherit()).output()?;
        Ok(Outcome::of(&output, Some(1)))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::workspace::Workspace;

    const MANIFEST: &str = "[package]\nname = 'planted'\n[workspace]\n";
    const TESTS: &str = "
        #[test] fn passes() {}
        #[test] fn fails() { assert!(false); }
        #[test] fn hangs() { loop { std::thread::park(); } }
        #[test] fn ends_the_program() { std::process::exit(1); }
    ";

    #[test]
    fn only_a_test_that_runs_and_fails_has_failed() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let root = workspace.target.join("planted-tests");
        fs::create_dir_all(root.join("src")).expect("a folder");
        fs::write(root.join("Cargo.toml"), MANIFEST).expect("written");
        let outcome = |name: &str, tests: &str| {
            fs::write(root.join("src/lib.rs"), tests).expect("written");
            let test = Test {
                package: "planted".to_owned(),
                target: None,
                name: name.to_owned(),
            };
            let outcome = test.run(&root, Duration::from_secs(5), None);
            outcome.expect("cargo runs")
        };
        assert_eq!(outcome("passes", TESTS), Outcome::Passed);
        assert_eq!(outcome("fails", TESTS), Outcome::Failed);
        assert_eq!(outcome("hangs", TESTS), Outcome::Hangs);
        assert_eq!(outcome("ends_the_program", TESTS), Outcome::NoResult);
        assert_eq!(outcome("unknown", TESTS), Outcome::NoResult);
        assert_eq!(outcome("fails", "does not compile"), Outcome::NoResult);
    }
}
