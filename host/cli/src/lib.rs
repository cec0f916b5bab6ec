//! The framelock command line, as a library so that tests can drive it without a process.
#![allow(
    clippy::indexing_slicing,
    reason = "an index out of range is a bug of this program"
)]

use std::process::ExitCode;

use clap::builder::{Resettable, StyledStr};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

mod decode;
mod demo;
mod encode;
mod frame_writer;
mod generate;
mod input;
mod monitor;
mod options;
mod output;
mod rows;
mod send;
mod serial;
mod simulate;
mod trace;

/// Decode, watch, send and simulate serial frames
#[derive(Parser)]
#[command(name = "framelock", version, after_help = include_str!("help/framelock.txt"))]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Show live what a faulty line does to two receivers
    Demo(demo::Arguments),
    /// Show what a receiver does with each byte
    Trace(trace::Arguments),
    /// Decode frames from a file, standard input or a serial port
    Decode(decode::Arguments),
    /// Watch a line: its state, rates and last frame, each second
    Monitor(monitor::Arguments),
    /// Send frames to a board on time: a profile, a motion or UDP
    Send(send::Arguments),
    /// Make frames from rows of values, such as setpoints
    Encode(encode::Arguments),
    /// Generate Rust or C code that receives and makes a frame
    Generate(generate::Arguments),
    /// Simulate a faulty line and count what receivers lose
    Simulate(simulate::Arguments),
    /// List the serial ports of this computer
    Ports,
}

/// Runs the command that this process's arguments name, and returns the exit code.
#[must_use]
pub fn run() -> ExitCode {
    let mut command = CommandLine::command();
    // `-h` shows a subcommand's help without its examples. Clap's own short and long help is not used, because the long
    // help needs three lines for each option.
    if std::env::args_os().any(|argument| argument == "-h") {
        command =
            command.mut_subcommands(|command| command.after_help(Resettable::<StyledStr>::Reset));
    }
    let arguments = CommandLine::from_arg_matches(&command.get_matches());
    let outcome = match arguments.unwrap_or_else(|error| error.exit()).command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::Decode(arguments) => decode::run(arguments),
        Command::Monitor(arguments) => monitor::run(&arguments),
        Command::Send(arguments) => send::run(&arguments),
        Command::Encode(arguments) => encode::run(&arguments),
        Command::Generate(arguments) => generate::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Ports => serial::list(),
    };
    ExitCode::from(output::exit_code(outcome))
}

#[cfg(test)]
mod tests {
    /// The README's Rust program has its own `main`, so that it compiles unchanged as a documentation test and as a
    /// user's program.
    #[test]
    fn the_readmes_rust_is_whole_programs() {
        let readme = include_str!("../../../README.md");
        let programs = readme.split("\n```rust\n").skip(1);
        assert_eq!(programs.clone().count(), 1);
        for program in programs {
            let (program, _) = program.split_once("\n```\n").expect("the block ends");
            assert!(program.contains("\nfn main() {\n"), "{program}");
        }
    }
}
