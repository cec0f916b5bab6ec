//! Runs the firmware's ELF in the emulator, and shows what a board would do, as it happens.
//!
//! `cargo xtask emulate` builds the firmware and starts this.

mod arguments;
mod input;
mod report;
mod session;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let outcome = session::run(&arguments::Arguments::parse());
    outcome.map_or_else(
        |error| {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        },
        |()| ExitCode::SUCCESS,
    )
}
