//! `cargo xtask emulate`: runs the firmware on an emulated board.

use std::os::unix::process::CommandExt as _;
use std::process::Command;

use anyhow::Result;

use crate::workspace::Workspace;

/// Run the firmware on an emulated board; see `cargo xtask emulate --help`
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub(crate) struct Arguments {
    /// Arguments for the emulator. Without `--elf`, build the firmware and run it
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// Builds the firmware, unless the arguments name an ELF or ask for help. Then runs the emulator.
pub(crate) fn emulate(workspace: &Workspace, Arguments { arguments }: &Arguments) -> Result<()> {
    let mut emulator = Command::new("cargo");
    emulator
        .args(["run", "--package", "nrf52840-emulator"])
        // Do not change the folder, because the user's file names are relative to the current folder.
        .arg("--manifest-path")
        .arg(workspace.root.join("Cargo.toml"))
        .args(["--", "--watch", "SETPOINT"])
        .args(arguments);
    let needs_no_image = ["--elf", "--help", "-h"];
    let has = |name: &&str| arguments.iter().any(|given| given.starts_with(name));
    if !needs_no_image.iter().any(has) {
        let images = workspace.images(&workspace.root, &["default"])?;
        emulator.arg("--elf").arg(images.join("default.elf"));
    }
    if arguments.iter().any(|one| one == "--help" || one == "-h") {
        println!(
            "Builds the firmware and gives the emulator its ELF, unless you choose one with --elf.\n"
        );
    }
    // Replace this process, so that only the emulator receives Ctrl-C.
    Err(emulator.exec().into())
}
