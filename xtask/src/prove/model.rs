//! Compiles harnesses with the stand-in for Kani's library, and reads what the compiler writes.

use std::fs;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

use super::llvm::Module;
use crate::command::{cargo_in, output, run_quietly};
use crate::workspace::Workspace;

/// What the compiler does between reading Rust and writing its intermediate representation: calls
/// become what they call, and memory that needs no address becomes values. Loops stay as they are
/// written, so that their counters stay plain numbers to the model checker.
const PASSES: &str = "function(sroa,early-cse,simplifycfg,instcombine<no-verify-fixpoint>),\
    cgscc(inline,function(sroa,early-cse,simplifycfg,instcombine<no-verify-fixpoint>)),\
    function(sroa,early-cse,simplifycfg,instcombine<no-verify-fixpoint>),globaldce";

/// Compiles the package in `root`, a workspace like this one, and reads all that its harnesses
/// reach. `target` is the folder for what is built.
pub(crate) fn compile(root: &Path, target: &Path, package: &str) -> Result<Module> {
    let compiler = output(Command::new("rustc").arg("-vV"))?;
    let host = compiler
        .lines()
        .find_map(|line| line.strip_prefix("host: "))
        .context("rustc does not say what machine this is")?;
    let flags = [
        "--cfg=kani",
        "--cfg=kani_stand_in",
        "-Cdebug-assertions=on",
        "-Coverflow-checks=on",
        "-Cpanic=abort",
        "-Ccodegen-units=1",
        "-Crelocation-model=static",
        "-Cllvm-args=-inline-threshold=100000",
        "-Cno-prepopulate-passes",
        "--emit=llvm-ir,metadata,link",
        &format!("-Cpasses={PASSES}"),
    ];
    // A folder for each workspace, compiler and choice of flags. With other flags the files have
    // other names, and stale ones would be read with them. In a copy of the workspace they have the
    // same names, and Cargo takes the copy's for its own wherever they are newer than the sources.
    let mut hasher = DefaultHasher::new();
    (root, &compiler, flags, package).hash(&mut hasher);
    let target = target.join(format!("{:016x}", hasher.finish()));
    run_quietly(
        cargo_in(root)
            // Flags for this target only, not for the procedural macros that run here.
            .args(["build", "--release", "--lib", "--target", host])
            .args(["--package", package])
            .env("CARGO_TARGET_DIR", &target)
            .env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"))
            .env("CARGO_PROFILE_RELEASE_LTO", "off")
            .env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "2"),
    )?;
    let built = target.join(host).join("release/deps");
    let mut module = Module::default();
    let files = intermediate(&built)?;
    ensure!(
        !files.is_empty(),
        "the compiler wrote nothing to {}",
        built.display()
    );
    for file in files {
        let text = fs::read_to_string(&file)?;
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        module.add(&text, &name)?;
    }
    Ok(module)
}

/// The files of intermediate representation in a folder.
fn intermediate(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "ll") {
            files.push(path);
        }
    }
    Ok(files)
}

/// Where what belongs to the proofs is built.
pub(crate) fn target(workspace: &Workspace) -> PathBuf {
    workspace.target_directory.join("prove")
}
