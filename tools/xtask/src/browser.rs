//! The stage that tries the page in a browser.

use std::env;

use anyhow::{Context as _, Result};
use xshell::cmd;

use crate::install;
use crate::stage_report::{Report, run_tests};
use crate::web;
use crate::workspace::{CLIPPY, NO_WARNINGS, Workspace};

/// The package of these tests. Other stages leave it out, because its browser driver takes long to compile.
pub(crate) const TESTS: &str = "framelock-web-browser";

/// Where the README's pictures of the page go, if they are wanted.
const PICTURES: &str = "FRAMELOCK_PICTURES";

const BROWSERS: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// The page in a headless Chromium and in Firefox, compared with the command line.
pub(crate) fn stage(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let sh = workspace.shell()?;
    if !BROWSERS.iter().any(|browser| is_in_path(browser)) {
        install::from_debian(&sh, &["chromium"]).context(
            "there is no Chromium in PATH. On Debian, as root: apt-get install chromium, \
             which was tried too",
        )?;
    }
    if !["firefox-esr", "firefox"].iter().any(|it| is_in_path(it)) {
        install::from_debian(&sh, &["firefox-esr"]).context(
            "there is no Firefox in PATH. On Debian, as root: apt-get install firefox-esr, \
             which was tried too",
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
        // The tests run in a folder of their own.
        cargo.env(PICTURES, workspace.root.join(folder));
    }
    run_tests(&mut cargo, &mut report.tests)
}

fn is_in_path(program: &str) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&path).any(|folder| folder.join(program).exists())
}
