//! The committed corpora as ordinary tests.

use anyhow::Result;

use crate::bare_metal::Source;
use crate::command::{cargo, run_and_read};
use crate::firmware::{BUILDS, TARGET, build_image, images};
use crate::firmware_tests::IMAGES;
use crate::stage::Report;
use crate::test_count::TestCount;
use crate::workspace::Workspace;

/// The package of the targets that need nothing but this machine.
pub(crate) const PACKAGE: &str = "framelock-fuzz-oracles";

/// The package whose tests need the firmware's images, and so are left to this stage.
pub(crate) const NEEDS_IMAGES: &str = "framelock-fuzz-firmware";

/// Replays all, on the compiler that runs this.
pub(crate) fn all(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let source = Source::of(&[TARGET])?;
    for build in &BUILDS {
        build_image(workspace, &workspace.root, &source, build)?;
    }
    run_and_read(
        cargo(workspace)
            .args(["test", "--no-fail-fast"])
            .args(["--package", PACKAGE, "--package", NEEDS_IMAGES])
            .args(["--test", "replay"])
            .env(IMAGES, images(workspace, &workspace.root)),
        |line| report.tests += TestCount::from_line(line),
    )
}
