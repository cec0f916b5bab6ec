//! The stage that tests the page in browsers.

use std::env;

use anyhow::{Context as _, Result};
use xshell::cmd;

use crate::install;
use crate::stage_report::{Report, run_tests};
use crate::web;
use crate::workspace::{CLIPPY, NO_WARNINGS, Workspace};

/// The package with the tests in browsers. Other stages exclude it, because its browser driver
/// takes long to compile.
pub(crate) const TESTS: &str = "framelock-web-browser";

/// The environment variable that names the folder for the README's pictures of the page. Without
/// this variable, no pictures are taken.
const PICTURES: &str = "FRAMELOCK_PICTURES";

const BROWSERS: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// Tests the page in a headless Chromium and in Firefox, and compares the page's results with those of the command
/// line.
pub(crate) fn stage(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let sh = workspace.shell()?;
    if !BROWSERS.iter().any(|browser| is_in_path(browser)) {
        install::from_debian(&sh, &["chromium"]).context(
            "Chromium is not in PATH and could not be installed. On Debian, run as root: \
             apt-get install chromium",
        )?;
    }
    if !["firefox-esr", "firefox"].iter().any(|it| is_in_path(it)) {
        install::from_debian(&sh, &["firefox-esr"]).context(
            "Firefox is not in PATH and could not be installed. On Debian, run as root: \
             apt-get install firefox-esr",
        )?;
    }
    let page = web::page(workspace)?;
    cmd!(sh, "cargo build --package framelock-host").run()?;
    let target = &workspace.target_directory;
    let mut cargo = workspace.cargo();
    cargo.args(["test", "--package", TESTS]).args(CLIPPY);
    cargo.envs([NO_WARNINGS]).args(["--", "--show-output"]);
    cargo.env("FRAMELOCK_PAGE", page);
    cargo.env("FRAMELOCK", target.join("debug/framelock"));
    if let Some(folder) = env::var_os(PICTURES) {
        // The tests run in another folder, so make the path absolute.
        cargo.env(PICTURES, workspace.root.join(folder));
    }
    run_tests(&mut cargo, &mut report.tests)
}

fn is_in_path(program: &str) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&path).any(|folder| folder.join(program).exists())
}
