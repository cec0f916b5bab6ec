//! `cargo xtask emulate`: the firmware on an emulated board.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode};

use anyhow::Result;
use clap::Args;

use crate::command;
use crate::firmware::firmware_elf;
use crate::workspace::Workspace;

const PACKAGE: &str = "framelock-emulator";
const PROGRAM: &str = "emulate";

/// Runs the firmware on an emulated board; see `cargo xtask emulate --help`.
#[derive(Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Arguments {
    /// What the emulator's own command line takes.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// Builds the emulator, and the firmware unless an ELF is named; and becomes the emulator.
pub(crate) fn emulate(arguments: &Arguments) -> Result<ExitCode> {
    let workspace = Workspace::load()?;
    let build = [
        "build",
        "--release",
        "--quiet",
        "--package",
        PACKAGE,
        "--bin",
        PROGRAM,
    ];
    command::run(command::cargo(&workspace).args(build))?;
    let program = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let program = workspace.target_directory.join("release").join(program);
    let mut command = Command::new(&program);
    command.args(&arguments.arguments);
    if let Some(features) = features_to_build(&arguments.arguments) {
        let elf = firmware_elf(&workspace, features)?;
        command.arg("--elf").arg(elf);
    }
    become_program(&mut command, &program)
}

/// The firmware's features for that command line; nothing if it names an ELF, or wants help only.
fn features_to_build(arguments: &[OsString]) -> Option<&'static [&'static str]> {
    let given: Vec<&str> = arguments.iter().filter_map(|a| a.to_str()).collect();
    let has = |name: &str| {
        let with_value = format!("{name}=");
        given
            .iter()
            .any(|a| *a == name || a.starts_with(&with_value))
    };
    if has("--elf") || has("--help") || has("-h") {
        return None;
    }
    let megabaud = given.contains(&"--baud=1000000")
        || given.windows(2).any(|pair| pair == ["--baud", "1000000"]);
    Some(if megabaud { &["megabaud"] } else { &[] })
}

/// Replaces this process, so that Ctrl-C is the emulator's alone.
#[cfg(unix)]
fn become_program(command: &mut Command, program: &Path) -> Result<ExitCode> {
    use std::os::unix::process::CommandExt;
    // It only returns if it fails.
    let error = command.exec();
    Err(anyhow::Error::new(error).context(format!("cannot start {}", program.display())))
}

#[cfg(not(unix))]
fn become_program(command: &mut Command, program: &Path) -> Result<ExitCode> {
    use anyhow::Context;
    let status = command
        .status()
        .with_context(|| format!("cannot start {}", program.display()))?;
    Ok(if status.success() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;

    use super::features_to_build;

    fn features(line: &str) -> Option<&'static [&'static str]> {
        let arguments: Vec<OsString> = line.split_whitespace().map(OsString::from).collect();
        features_to_build(&arguments)
    }

    #[test]
    fn the_firmware_is_built_unless_an_elf_is_named() {
        assert_eq!(features("--input pty"), Some(&[][..]));
        assert_eq!(features("--elf a.elf"), None);
        assert_eq!(features("--elf=a.elf --input -"), None);
        assert_eq!(features("--help"), None);
    }

    #[test]
    fn a_megabaud_needs_the_firmware_for_it() {
        assert_eq!(features("--baud 1000000"), Some(&["megabaud"][..]));
        assert_eq!(
            features("--baud=1000000 --seconds 1"),
            Some(&["megabaud"][..])
        );
        assert_eq!(features("--baud 115200"), Some(&[][..]));
    }
}
