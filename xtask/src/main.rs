//! The project's checks: `cargo xtask verify` for all, `cargo xtask prove` for the theorems.

mod bare_metal;
mod benches;
mod cargo_tool;
mod command;
mod debian;
mod emulate;
mod feature_subsets;
mod firmware;
mod firmware_seeded_bugs;
mod firmware_tests;
mod fuzz;
mod lints;
mod mutants;
mod no_std;
mod prove;
mod source_copy;
mod stage;
mod table;
mod test_count;
mod test_runs;
mod verify;
mod workspace;

use std::process::ExitCode;

use clap::Parser;

/// The project's own tasks.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
enum Task {
    Verify(verify::Arguments),
    Prove(prove::Arguments),
    Firmware(firmware::Arguments),
    Emulate(emulate::Arguments),
    Fuzz(fuzz::Arguments),
    Mutants(mutants::Arguments),
}

fn main() -> ExitCode {
    let outcome = match Task::parse() {
        Task::Verify(arguments) => verify::verify(&arguments),
        Task::Prove(arguments) => prove::prove(&arguments),
        Task::Firmware(arguments) => firmware::build_and_tell(&arguments),
        Task::Emulate(arguments) => emulate::emulate(&arguments),
        Task::Fuzz(arguments) => fuzz::fuzz(&arguments),
        Task::Mutants(arguments) => mutants::mutants(&arguments),
    };
    outcome.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}
