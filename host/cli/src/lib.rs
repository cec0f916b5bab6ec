//! The framelock command line, as a library so that tests can drive it without a process.

use std::io::Write;
use std::process::ExitCode;

use anyhow::{Result, anyhow};
use clap::builder::{Resettable, StyledStr};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use framelock_description::SHIPPED;

mod decode;
pub mod demo;
mod encode;
mod frame_option;
mod frame_writer;
mod generate;
mod hex;
mod input;
mod line_errors;
mod monitor;
mod options;
mod output;
mod ports;
mod process;
mod rows;
pub mod screen;
mod send;
mod serial;
pub mod simulate;
pub mod text_outputs;
mod trace;
mod view_parts;

/// Serial frames, received without ever going deaf: shown, decoded, watched, sent
#[derive(Parser)]
#[command(name = "framelock", version, after_help = include_str!("help/framelock.txt"))]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// A faulty line, and what two receivers make of it, live
    Demo(demo::Arguments),
    /// What the machine does with each byte: a row per byte
    Trace(trace::Arguments),
    /// Frames from a file, standard input or a serial port
    Decode(decode::Arguments),
    /// A live view of a line: state, values, rates, counters
    Monitor(monitor::Arguments),
    /// Frames to a board, on time: a profile, a motion or UDP
    Send(send::Arguments),
    /// Frames from rows of values, such as setpoints
    Encode(encode::Arguments),
    /// Rust or C that receives and makes a frame
    Generate(generate::Arguments),
    /// What a faulty line does to a receiver, counted
    Simulate(simulate::Arguments),
    /// The serial ports that are there
    Ports,
    /// A script that completes commands in a shell
    #[command(after_help = include_str!("help/completions.txt"))]
    Completions { shell: clap_complete::Shell },
    /// The manual page, of one command or of all
    Man { command: Option<String> },
}

/// Does what this process's arguments say.
#[must_use]
pub fn run() -> ExitCode {
    let mut command = CommandLine::command();
    // The short help is without examples. (Clap's own long help takes three lines for an option.)
    if std::env::args_os().any(|argument| argument == "-h") {
        command =
            command.mut_subcommands(|command| command.after_help(Resettable::<StyledStr>::Reset));
    }
    let arguments = CommandLine::from_arg_matches(&command.get_matches());
    let outcome = match arguments.unwrap_or_else(|error| error.exit()).command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::Decode(arguments) => decode::run(&arguments),
        Command::Monitor(arguments) => monitor::run(&arguments),
        Command::Send(arguments) => send::run(&arguments),
        Command::Encode(arguments) => encode::run(&arguments),
        Command::Generate(arguments) => generate::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Ports => ports::run(),
        Command::Completions { shell } => write_completions(shell),
        Command::Man { command } => write_manual(command.as_deref()),
    };
    ExitCode::from(output::exit_code(outcome))
}

fn write_completions(shell: clap_complete::Shell) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut CommandLine::command(), "framelock", &mut script);
    let mut script = String::from_utf8(script)?;
    // Behind --frame a file may come too. Clap offers either names or files; bash adds files by itself.
    let names: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
    if let (names, Some(last)) = (names.join(" "), names.last()) {
        let of_zsh = format!("{{compadd {names}; _files -g \"*.toml\"}}");
        let of_fish = format!("{last}\\t''\n(__fish_complete_suffix .toml)\"");
        script = script
            .replace(&format!("({names})"), &of_zsh)
            .replace(&format!("{last}\\t''\""), &of_fish);
    }
    Ok(output::Output::standard()?.write_all(script.as_bytes())?)
}

fn write_manual(name: Option<&str>) -> Result<()> {
    let mut command = CommandLine::command();
    command.build();
    if let Some(name) = name {
        let found = command.find_subcommand(name).cloned();
        command =
            found.ok_or_else(|| anyhow!("there is no command {name}: see framelock --help"))?;
    }
    let mut page = Vec::new();
    let source = concat!("framelock ", env!("CARGO_PKG_VERSION"));
    clap_mangen::Man::new(command)
        .source(source)
        .render(&mut page)?;
    // What is aligned by blanks stays as it is.
    let page = String::from_utf8_lossy(&page).replace(".SH EXTRA\n", ".SH EXAMPLES\n.nf\n");
    Ok(output::Output::standard()?.write_all(page.as_bytes())?)
}

#[cfg(test)]
mod tests {
    /// Then the documentation's test compiles it as it stands, and so does whoever pastes it into an empty program.
    #[test]
    fn the_readmes_rust_is_whole_programs() {
        let readme = include_str!("../../../README.md");
        let programs = readme.split("\n```rust\n").skip(1);
        assert_eq!(programs.clone().count(), 2);
        for program in programs {
            let (program, _) = program.split_once("\n```\n").unwrap_or_default();
            assert!(program.contains("\nfn main() {\n"), "{program}");
        }
    }
}
