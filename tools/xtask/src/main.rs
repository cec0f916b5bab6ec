//! The project's checks: `cargo xtask verify` runs all of them, `cargo xtask prove` checks the
//! theorems.

mod bare_metal;
mod browser;
mod bugs;
mod checks;
mod emulate;
mod firmware;
mod fuzz;
mod install;
mod kani;
mod machine_code;
mod mutants;
mod planted;
mod prove;
mod published;
mod release;
mod stage_report;
mod theorems;
mod verify;
mod web;
mod workspace;

use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;

use workspace::Workspace;

/// The project's own tasks
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
enum Task {
    Verify(verify::Arguments),
    Prove(prove::Arguments),
    Bugs(bugs::Arguments),
    Mutants(mutants::Arguments),
    Firmware(firmware::Arguments),
    Emulate(emulate::Arguments),
    Fuzz(fuzz::Arguments),
    Web(web::Arguments),
}

fn main() -> ExitCode {
    match run(&Task::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the task. Returns whether all its checks passed.
fn run(task: &Task) -> Result<bool> {
    let workspace = &Workspace::load()?;
    match task {
        Task::Verify(arguments) => return Ok(verify::verify(workspace, arguments)),
        Task::Prove(arguments) => return prove::prove(workspace, arguments),
        Task::Bugs(arguments) => bugs::bugs(workspace, arguments)?,
        Task::Mutants(arguments) => mutants::mutants(workspace, arguments)?,
        Task::Firmware(arguments) => firmware::build(workspace, arguments)?,
        Task::Emulate(arguments) => emulate::emulate(workspace, arguments)?,
        Task::Fuzz(arguments) => fuzz::fuzz(workspace, arguments)?,
        Task::Web(arguments) => web::web(workspace, arguments)?,
    }
    Ok(true)
}
