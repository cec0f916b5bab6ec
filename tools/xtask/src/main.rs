//! The project's own tasks. `cargo xtask verify` runs the checks, and `cargo xtask prove` checks only the theorems.

mod board;
mod bugs;
mod emulate;
mod firmware;
mod interface;
mod kani;
mod planted;
mod prove;
mod slow_proofs;
mod test_count;
#[cfg(test)]
mod tests;
mod theorems;
mod verify;
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
    Firmware(firmware::Arguments),
    /// Make framelock-c.zip and framelock-arduino.zip, the archives for C and Arduino, in target/archives
    Archives,
    /// Make a package with a format of your own and its theorems in FOLDER, which must not exist
    OwnProof {
        /// The new folder
        folder: std::path::PathBuf,
    },
    Emulate(emulate::Arguments),
    /// Build the page that shows the machines in a browser, target/web/index.html
    Web {
        /// Show the page in the browser
        #[arg(long)]
        open: bool,
    },
    Board(board::Arguments),
    #[command(hide = true)]
    Interface(interface::Arguments),
    /// Check that contradictory settings of the firmware do not compile
    #[command(hide = true)]
    Contradictions,
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
        Task::Firmware(arguments) => firmware::build(workspace, arguments)?,
        Task::Archives => workspace::run(&mut workspace.script(&["archives"]))?,
        Task::OwnProof { folder } => {
            let folder = std::path::absolute(folder)?;
            workspace::run(workspace.script(&["own_proof"]).arg(folder))?;
        }
        Task::Emulate(arguments) => emulate::emulate(workspace, arguments)?,
        Task::Web { open } => {
            workspace::run(workspace.script(&["page"]).args(open.then_some("--open")))?;
        }
        Task::Board(arguments) => return board::board(workspace, arguments),
        Task::Interface(arguments) => interface::interface(arguments)?,
        Task::Contradictions => firmware::contradictions(workspace)?,
    }
    Ok(true)
}
