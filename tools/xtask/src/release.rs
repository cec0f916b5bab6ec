//! The stages that check the Python package and the licences of dependencies.

use std::fs;

use anyhow::{Context as _, Result, ensure};
use xshell::cmd;

use crate::stage_report::Report;
use crate::workspace::Workspace;

/// Three BIN frames.
const FRAMES: [[u8; 7]; 3] = [
    *b"AB\x00\x01\x02\x03\r",
    *b"AB\x00\x04\x05\x06\r",
    *b"AB\x00\x07\x08\x09\r",
];

/// Builds the Python package, installs it into a new environment, and runs the command line from there.
pub(crate) fn wheel(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let sh = workspace.shell()?;
    let python = workspace.python_with(&["maturin==1.16.0"])?;
    let folder = workspace.target_directory.join("wheel");
    sh.remove_path(&folder)?;
    cmd!(
        sh,
        "{python} -m maturin build --release --locked --manifest-path host/cli/Cargo.toml --out {folder}"
    )
    .run()?;
    let mut wheels = sh.read_dir(&folder)?;
    let wheel = wheels.pop().context("maturin has built no wheel")?;
    ensure!(wheels.is_empty(), "more than one wheel: {wheels:?}");

    let environment = folder.join("environment");
    cmd!(sh, "python3 -m venv {environment}").run()?;
    let pip = environment.join("bin/pip");
    cmd!(sh, "{pip} install --quiet --no-index {wheel}").run()?;
    let framelock = environment.join("bin/framelock");

    let version = cmd!(sh, "{framelock} --version").read()?;
    let expected = format!("framelock {}", workspace.version);
    ensure!(version == expected, "--version prints {version}");
    let arduino = sh.read_file("c/arduino/library.properties")?;
    let line = format!("version={}", workspace.version);
    ensure!(
        arduino.lines().any(|it| it == line),
        "c/arduino/library.properties has another version than Cargo.toml: write {line}"
    );

    // Decode from a file to a file, and from a pipe to a pipe. Two bytes of noise follow each frame.
    let stream = FRAMES.map(|frame| [&frame[..], b"??"].concat()).concat();
    let (recording, table) = (folder.join("recording.bin"), folder.join("table.csv"));
    fs::write(&recording, &stream)?;
    cmd!(
        sh,
        "{framelock} decode {recording} --format csv --output {table}"
    )
    .run()?;
    let piped = cmd!(sh, "{framelock} decode --format csv")
        .stdin(&stream)
        .read()?;
    let written = fs::read_to_string(&table)?;
    ensure!(
        written.trim_end() == piped,
        "decoding the file gives a different table than decoding the pipe:\n{written}\n{piped}"
    );
    ensure!(
        piped.lines().count() == 4,
        "three frames give this table:\n{piped}"
    );
    let encoded = cmd!(sh, "{framelock} encode").stdin(piped).output()?;
    ensure!(
        encoded.stdout == FRAMES.concat(),
        "encode does not reproduce the frames"
    );

    let kib = fs::metadata(&wheel)?.len() / 1024;
    report.says = format!("{expected}, {kib} KiB");
    Ok(())
}

/// Checks the licences, duplicates and sources of all dependencies by the rules in `deny.toml`. The hosted workflow
/// also checks for security advisories, which change without a commit.
pub(crate) fn licences(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let sh = workspace.shell_with("cargo-deny", "0.20.2")?;
    for manifest in ["Cargo.toml", "firmware/Cargo.toml", "fuzz/Cargo.toml"] {
        cmd!(
            sh,
            "cargo deny --manifest-path {manifest} --all-features --config deny.toml check licenses bans sources"
        )
        .run()?;
    }
    Ok(())
}
