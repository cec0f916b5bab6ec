//! `cargo xtask firmware`: builds the firmware's images, as ELF for probe-rs and as Intel HEX for other programs. This
//! file also contains the check that contradictory settings do not compile.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use serde::Deserialize;

use crate::workspace::{Workspace, run};

/// The package that tests the images.
pub(crate) const TESTS: &str = "framelock-firmware-tests";

/// Build the firmware for the nRF52840 as ELF and Intel HEX, in target/firmware/images, and print its size
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Build every image that is tested, not only the one that `cargo run --release` in firmware/ flashes
    #[arg(long)]
    all: bool,
}

impl Workspace {
    /// Builds the images with these names, or all if there is no name, from the sources at `root`. Returns the images'
    /// folder. A copy of the sources has its own build folder, because cargo would otherwise mistake the copy's
    /// packages for those of the workspace.
    pub(crate) fn images(&self, root: &Path, names: &[&str]) -> Result<PathBuf> {
        let of_copy = (root != self.root).then(|| root.join("target"));
        let built = of_copy.unwrap_or_else(|| self.target.join("firmware"));
        run(self.script(&["images"]).arg(root).arg(&built).args(names))?;
        Ok(built.join("images"))
    }
}

/// Runs `cargo xtask firmware`.
pub(crate) fn build(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let names: &[&str] = if arguments.all { &[] } else { &["default"] };
    run(workspace.script(&["hex_images"]).args(names))
}

/// Checks that settings which contradict each other do not compile.
pub(crate) fn contradictions(workspace: &Workspace) -> Result<()> {
    let sources = workspace.target.join("contradictions");
    workspace.copy(&sources)?;
    let accepted = accepted_contradictions(workspace, &sources)?;
    ensure!(
        accepted.is_empty(),
        "these settings must not compile, and the error must state the reason: {accepted:#?}"
    );
    Ok(())
}

/// The name by which a seeded bug refers to [`accepted_contradictions`].
pub(crate) const CONTRADICTIONS: &str = "contradictions";

/// The content of `firmware/contradictions.toml`.
#[derive(Deserialize)]
struct Contradictions {
    contradiction: Vec<Contradiction>,
}

/// A replacement in the settings, and the error that it must cause.
#[derive(Deserialize)]
struct Contradiction {
    right: String,
    wrong: String,
    message: String,
}

/// Puts each contradiction of `firmware/contradictions.toml` into a copy of the sources. Returns those that the
/// compiler does not report with the right message.
pub(crate) fn accepted_contradictions(workspace: &Workspace, copy: &Path) -> Result<Vec<String>> {
    let mut check = workspace.script(&["build_settings"]);
    check.arg(copy);
    run(&mut check)?;
    let folder = copy.join("firmware");
    let list = fs::read_to_string(folder.join("contradictions.toml"))?;
    let list: Contradictions = toml::from_str(&list)?;
    let file = folder.join("src/settings.rs");
    let settings = fs::read_to_string(&file)?;
    let mut accepted = Vec::new();
    for one in list.contradiction {
        let places = settings.matches(&one.right).count();
        ensure!(
            places == 1,
            "\"{}\" occurs {places} times, not once",
            one.right
        );
        fs::write(&file, settings.replace(&one.right, &one.wrong))?;
        let output = check.output()?;
        let errors = String::from_utf8_lossy(&output.stderr);
        if output.status.success() || !says(&errors, &one.message) {
            accepted.push(one.wrong);
        }
    }
    fs::write(&file, settings)?;
    Ok(accepted)
}

/// Returns whether the compiler reports a constant that panics with this message. An assertion without a message of its
/// own panics with its source text, so `message` may be a part of this text. The lines that quote the source do not
/// count.
fn says(errors: &str, message: &str) -> bool {
    errors
        .lines()
        .any(|line| line.starts_with("error[E0080]: ") && line.contains(message))
}
