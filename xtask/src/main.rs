//! The project's checks, as one command: `cargo xtask verify`.

mod benches;
mod command;
mod debian;
mod feature_subsets;
mod lints;
mod no_std;
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
}

fn main() -> ExitCode {
    let outcome = match Task::parse() {
        Task::Verify(arguments) => verify::verify(&arguments),
    };
    outcome.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}
