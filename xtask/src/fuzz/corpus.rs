//! The corpora: those committed, those found here; how small they can be, and what they reach.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, ensure};

use super::session::files;
use super::setup::Fuzzer;
use super::{Target, replay};
use crate::command::{cargo, output, run, run_quietly};
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

/// Replays the committed corpora on a build that counts, and shows which regions of the core they
/// reach. Not the firmware's: it is not this machine's code, so there are no counters in it.
pub(crate) fn coverage(workspace: &Workspace) -> Result<()> {
    let folder = workspace.target_directory.join("fuzz-coverage");
    let profiles = folder.join("profiles");
    if profiles.exists() {
        fs::remove_dir_all(&profiles)?;
    }
    let tools = llvm_tools()?;
    let mut replay = cargo(workspace);
    replay
        .args(["test", "--package", replay::PACKAGE, "--test", "replay"])
        .arg("--target-dir")
        .arg(&folder)
        .env("RUSTFLAGS", "-Cinstrument-coverage")
        .env("LLVM_PROFILE_FILE", profiles.join("%p-%m.profraw"));
    run(&mut replay)?;
    let answer = output(replay.args(["--no-run", "--message-format=json"]))?;
    let program = executable(&answer).context("cargo does not say what it has built")?;

    let merged = folder.join("all.profdata");
    let mut merge = Command::new(tools.join("llvm-profdata"));
    merge.args(["merge", "--sparse", "--output"]).arg(&merged);
    run_quietly(merge.args(files(&profiles)?))?;
    for (what, file) in [("report", "regions.txt"), ("show", "lines.txt")] {
        let mut command = Command::new(tools.join("llvm-cov"));
        command
            .arg(what)
            .arg(&program)
            .arg(format!("--instr-profile={}", merged.display()))
            .arg(workspace.root.join("core/src"));
        let text = output(&mut command)?;
        if what == "report" {
            println!("{text}");
        }
        fs::write(folder.join(file), text)?;
    }
    println!("Line by line: {}", folder.join("lines.txt").display());
    Ok(())
}

/// The program of the tests, out of what cargo says about its build.
fn executable(answer: &str) -> Option<PathBuf> {
    let messages = answer
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let mut programs =
        messages.filter_map(|message| message.get("executable")?.as_str().map(PathBuf::from));
    programs.next_back()
}

/// LLVM's tools of the compiler that runs this: no others read what it writes.
fn llvm_tools() -> Result<PathBuf> {
    let libraries = output(Command::new("rustc").args(["--print", "target-libdir"]))?;
    let folder = Path::new(&libraries)
        .parent()
        .context("the compiler has libraries")?
        .join("bin");
    if !folder.join("llvm-cov").exists() {
        run(Command::new("rustup").args(["component", "add", "llvm-tools"]))
            .context("coverage needs LLVM's tools: rustup component add llvm-tools")?;
    }
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_is_found_in_what_cargo_says() {
        let answer = r#"{"reason": "compiler-artifact", "executable": null}
{"reason": "compiler-artifact", "executable": "/t/replay-1"}
{"reason": "build-finished"}"#;
        assert_eq!(executable(answer), Some("/t/replay-1".into()));
    }

    #[test]
    fn inputs_that_have_a_name_are_told_from_those_the_fuzzer_named() {
        assert!(is_hash(Path::new(
            "a/da39a3ee5e6b4b0d3255bfef95601890afd80709"
        )));
        assert!(!is_hash(Path::new("a/deaf-lecture-machine")));
    }
}
