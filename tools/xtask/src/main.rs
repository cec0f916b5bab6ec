//! The project's checks: `cargo xtask verify` for all, `cargo xtask prove` for the theorems.

mod answer;
mod bare_metal;
mod browser;
mod bugs;
mod checks;
mod debian;
mod emulate;
mod firmware;
mod fuzz;
mod kani;
mod machine_code;
mod mutants;
mod mutated_firmware;
mod prove;
mod report;
mod theorems;
mod verify;
mod web;
mod workspace;

use std::process::ExitCode;

use clap::Parser;

/// The project's own tasks.
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
    let outcome = match Task::parse() {
        Task::Verify(arguments) => verify::verify(&arguments),
        Task::Prove(arguments) => prove::prove(&arguments),
        Task::Bugs(arguments) => bugs::bugs(&arguments),
        Task::Mutants(arguments) => mutants::mutants(&arguments),
        Task::Firmware(arguments) => firmware::build(&arguments),
        Task::Emulate(arguments) => emulate::emulate(&arguments),
        Task::Fuzz(arguments) => fuzz::fuzz(&arguments),
        Task::Web(arguments) => web::web(&arguments),
    };
    outcome.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}
