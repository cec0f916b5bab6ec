//! The corpora: those committed, those found here; how small they can be, and what they reach.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

use super::Target;
use super::setup::{Fuzzer, rustup_run};
use crate::command::{output, run, run_quietly};
use crate::firmware::images;
use crate::firmware_tests::IMAGES;
use crate::workspace::Workspace;

/// The committed one.
pub(crate) fn committed(workspace: &Workspace, target: Target) -> PathBuf {
    workspace.root.join("fuzz/corpus").join(target.name())
}

/// Inputs that were found on this machine.
pub(crate) fn found_here(workspace: &Workspace, target: Target) -> PathBuf {
    let folder = workspace.target_directory.join("fuzz-corpus");
    folder.join(target.name())
}

/// Adds to the committed corpus the fewest and smallest inputs found here that reach what it does
/// not. What is committed stays: the inputs with names are there for what they are.
pub(crate) fn minimise(workspace: &Workspace, fuzzer: &Fuzzer, target: Target) -> Result<()> {
    let found = found_here(workspace, target);
    ensure!(
        found.exists(),
        "nothing has been found here yet: fuzz first"
    );
    let committed = committed(workspace, target);
    for entry in fs::read_dir(&committed)? {
        let path = entry?.path();
        // What the fuzzer has named, by the input's hash, is what it may choose again.
        if is_hash(&path) {
            fs::copy(&path, found.join(path.file_name().unwrap_or_default()))?;
            fs::remove_file(&path)?;
        }
    }
    run(fuzzer
        .command("run")?
        .arg(target.name())
        .args([&committed, &found])
        .args(["--", "-merge=1"])
        .arg(format!("-max_len={}", target.longest_input()))
        .env(IMAGES, images(workspace, &workspace.root)))
}

fn is_hash(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.is_some_and(|name| name.len() == 40 && name.bytes().all(|byte| byte.is_ascii_hexdigit()))
}

/// Runs the committed corpora with the compiler's own coverage, and shows which regions of the core
/// they reach.
pub(crate) fn coverage(workspace: &Workspace, fuzzer: &Fuzzer, targets: &[Target]) -> Result<()> {
    let folder = workspace.target_directory.join("fuzz-coverage");
    fs::create_dir_all(&folder)?;
    let tools = llvm_tools()?;
    let mut profiles = Vec::new();
    let mut programs = Vec::new();
    // The firmware is not this machine's code, so there are no counters in it.
    for target in targets.iter().filter(|target| **target != Target::Firmware) {
        run_quietly(
            fuzzer
                .command("coverage")?
                .arg(target.name())
                .arg(committed(workspace, *target)),
        )?;
        let name = target.name();
        profiles.push(
            workspace
                .root
                .join(format!("fuzz/coverage/{name}/coverage.profdata")),
        );
        programs.push(program(workspace, name)?);
    }
    let (first, others) = programs
        .split_first()
        .context("the firmware has no coverage")?;
    let merged = folder.join("all.profdata");
    run_quietly(
        Command::new(tools.join("llvm-profdata"))
            .args(["merge", "--sparse", "--output"])
            .arg(&merged)
            .args(&profiles),
    )?;
    for (what, file) in [("report", "regions.txt"), ("show", "lines.txt")] {
        let mut command = Command::new(tools.join("llvm-cov"));
        command
            .arg(what)
            .arg(first)
            .args(
                others
                    .iter()
                    .flat_map(|other| ["--object".as_ref(), other.as_os_str()]),
            )
            .arg(format!("--instr-profile={}", merged.display()))
            .arg(workspace.root.join("core/src"));
        if what == "show" {
            command.arg("--show-regions");
        }
        let text = output(&mut command)?;
        if what == "report" {
            println!("{text}");
        }
        fs::write(folder.join(file), text)?;
    }
    println!("Line by line: {}", folder.join("lines.txt").display());
    Ok(())
}

/// The program that `cargo fuzz coverage` has built.
fn program(workspace: &Workspace, name: &str) -> Result<PathBuf> {
    let answer = output(rustup_run().args(["rustc", "--version", "--verbose"]))?;
    let host = answer.lines().find_map(|line| line.strip_prefix("host: "));
    let host = host.context("rustc does not say for which machine it compiles")?;
    let folder = workspace.target_directory.join("fuzz").join(host);
    let program = folder
        .join("coverage")
        .join(host)
        .join("release")
        .join(name);
    let candidates = [program, folder.join("release").join(name)];
    let found = candidates.iter().find(|path| path.exists());
    Ok(found
        .context("cargo fuzz coverage built no program")?
        .clone())
}

/// LLVM's tools of the nightly compiler: no others read what it writes.
fn llvm_tools() -> Result<PathBuf> {
    let libraries = output(rustup_run().args(["rustc", "--print", "target-libdir"]))?;
    let folder = Path::new(&libraries)
        .parent()
        .context("the compiler has libraries")?
        .join("bin");
    if !folder.join("llvm-cov").exists() {
        run(Command::new("rustup").args([
            "component",
            "add",
            "llvm-tools",
            "--toolchain",
            "nightly",
        ]))
        .context(
            "coverage needs LLVM's tools: rustup component add llvm-tools --toolchain nightly",
        )?;
    }
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_that_have_a_name_are_told_from_those_the_fuzzer_named() {
        assert!(is_hash(Path::new(
            "a/da39a3ee5e6b4b0d3255bfef95601890afd80709"
        )));
        assert!(!is_hash(Path::new("a/deaf-lecture-machine")));
    }
}
