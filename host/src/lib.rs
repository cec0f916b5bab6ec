//! The framelock command line, as a library so that tests can drive it without a process.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod decode;
mod demo;
mod encode;
mod frame;
mod hex;
mod input;
mod interrupt;
mod line;
mod line_errors;
mod monitor;
mod names;
mod numbers;
mod output;
mod rows;
pub mod screen;
mod send;
mod serial;
mod simulate;
mod standard;
mod trace;
mod view_parts;

/// A serial-frame receiver that never goes deaf: decode, trace, encode and demonstrate
/// 'A' 'B' reserved pitch roll yaw CR.
#[derive(Parser)]
#[command(name = "framelock", version)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Decode(decode::Arguments),
    Trace(trace::Arguments),
    Encode(encode::Arguments),
    Demo(demo::Arguments),
    Send(send::Arguments),
    Monitor(monitor::Arguments),
    Simulate(simulate::Arguments),
}

/// Does what this process's arguments say.
#[must_use]
pub fn run() -> ExitCode {
    ExitCode::from(output::exit_code(match CommandLine::parse().command {
        Command::Decode(arguments) => decode::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::Encode(arguments) => encode::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Send(arguments) => send::run(&arguments),
        Command::Monitor(arguments) => monitor::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
    }))
}
