//! The stage that runs the firmware's images in the emulator.

use std::path::Path;

use anyhow::Result;

use crate::bare_metal::Source;
use crate::command::{cargo, run_and_read, version};
use crate::firmware::{BUILDS, TARGET, build_image, build_parser_steps, images};
use crate::stage::Report;
use crate::test_count::TestCount;
use crate::workspace::Workspace;

/// The package with the tests.
pub(crate) const PACKAGE: &str = "framelock-firmware-tests";

/// Where the tests look for the images.
pub(crate) const IMAGES: &str = "FRAMELOCK_IMAGES";

/// The stage: the release images do what they should, in the emulator.
pub(crate) fn in_the_emulator(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let source = Source::of(&[TARGET])?;
    for build in &BUILDS {
        build_image(workspace, &workspace.root, &source, build)?;
    }
    build_parser_steps(workspace, &source)?;
    report.engine = format!("{}, rsemu", version(&mut cargo(workspace))?);
    let outcome = run_tests(
        workspace,
        &images(workspace, &workspace.root),
        &[],
        &mut report.tests,
    );
    report.extent = report.tests.to_string();
    outcome
}

/// Runs the tests on the images in that folder.
pub(crate) fn run_tests(
    workspace: &Workspace,
    images: &Path,
    filter: &[&str],
    count: &mut TestCount,
) -> Result<()> {
    run_and_read(
        cargo(workspace)
            .args(["test", "--package", PACKAGE, "--no-fail-fast", "--"])
            .args(filter)
            .env(IMAGES, images),
        |line| *count += TestCount::from_line(line),
    )
}
