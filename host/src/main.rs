//! The framelock command line: see `framelock --help`.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use framelock_host::{decode, demo, encode, monitor, send, simulate, trace};

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

fn main() -> ExitCode {
    let outcome = match CommandLine::parse().command {
        Command::Decode(arguments) => decode::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::Encode(arguments) => encode::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Send(arguments) => send::run(&arguments),
        Command::Monitor(arguments) => monitor::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("framelock: {error:#}");
            ExitCode::from(2)
        }
    }
}
