//! The stage that proves the receiver's step in the machine code of the images. See
//! `proofs/machine-code`.

use std::path::Path;
use std::process::Command;

use anyhow::{Result, ensure};
use xshell::cmd;

use crate::bare_metal::Compiler;
use crate::stage_report::{Report, TestCount, run_tests};
use crate::workspace::Workspace;
use crate::{bugs, firmware, install};

/// The name of the stage and of its folder. A seeded bug for this stage has this name as its
/// `test`.
pub(crate) const NAME: &str = "machine-code";

/// Runs the stage: checks the flashed images, and then the seeded bugs.
pub(crate) fn stage(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let images = ["default", "megabaud", "lecture", "small"];
    let mut prover = prover(workspace, &workspace.root, &images)?;
    run_tests(&mut prover, &mut report.tests)?;
    bugs::run(workspace, None, &[NAME.to_owned()])
}

/// Returns whether the theorems hold for the firmware images that are built from the sources at `root`. If a seeded bug
/// does not change the images, the theorems still hold, and this function returns true.
pub(crate) fn is_proved(workspace: &Workspace, root: &Path) -> Result<bool> {
    let mut count = TestCount::default();
    let mut prover = prover(workspace, root, &["default", "lecture"])?;
    let outcome = run_tests(&mut prover, &mut count);
    ensure!(
        outcome.is_ok() || count.failed > 0,
        "no theorem was checked"
    );
    Ok(outcome.is_ok())
}

/// Builds the images and sets up the prover's Python environment. Returns the command that checks
/// the images.
fn prover(workspace: &Workspace, root: &Path, images: &[&str]) -> Result<Command> {
    let sh = workspace.shell()?;
    let folder = workspace.root.join("proofs").join(NAME);
    let requirements = folder.join("requirements.txt");
    let environment = workspace.target_directory.join(NAME);
    let (python, installed) = (
        environment.join("bin/python"),
        environment.join("installed"),
    );
    if sh.read_file(&installed).ok() != Some(sh.read_file(&requirements)?) {
        if cmd!(sh, "python3 -c 'import ensurepip'").run().is_err() {
            install::from_debian(&sh, &["python3-venv"])?;
        }
        cmd!(sh, "python3 -m venv --clear {environment}").run()?;
        cmd!(
            sh,
            "{python} -m pip install --quiet --requirement {requirements}"
        )
        .run()?;
        sh.copy_file(&requirements, &installed)?;
    }
    let compiler = Compiler::of(&[firmware::TARGET])?;
    let mut prover = Command::new(python);
    prover.arg("-B").arg(folder.join("prove.py"));
    let builds = firmware::BUILDS.iter();
    for build in builds.filter(|(name, ..)| images.contains(name)) {
        prover.arg(firmware::build_image(workspace, root, &compiler, build)?);
    }
    Ok(prover)
}
