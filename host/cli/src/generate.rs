//! Generates source code that receives and makes a frame.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::ValueEnum;
use framelock_generate::{CrcTable, c, rust};
use framelock_receiving::Protocol;

use crate::options::protocol;
use crate::output::Output;

/// Generate source code that receives and makes a frame: its layout, a struct of its fields, decode and encode
#[derive(clap::Args)]
#[command(after_help = include_str!("help/generate.txt"))]
pub(crate) struct Arguments {
    /// Generate code for these frames: a name, or a description file
    #[arg(long, value_name = "NAME|FILE", value_parser = protocol, hide_possible_values = true)]
    frame: Protocol,
    /// Generate Rust without std, or C99 that is also valid C++17
    #[arg(long, value_enum, value_name = "LANGUAGE")]
    language: Language,
    /// Use a CRC table of 256 entries instead of 16: faster, but more flash (with --language c)
    #[arg(long)]
    byte_table: bool,
    /// Write the code to FILE, replacing it, instead of standard output
    #[arg(long, short, value_name = "FILE", default_value = "-")]
    output: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum Language {
    Rust,
    C,
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let (frame, language) = (&arguments.frame, arguments.language);
    let path = Path::new(&frame.name);
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let value = language.to_possible_value().expect("no language is hidden");
    let language_name = value.get_name();
    let (table, option) = if arguments.byte_table {
        (CrcTable::Bytes, " --byte-table")
    } else {
        (CrcTable::Nibbles, "")
    };
    let command = format!("framelock generate --frame {frame} --language {language_name}{option}");
    let code = match language {
        Language::Rust => rust(&frame.description, &name, &command),
        Language::C => c(&frame.description, &name, &command, table),
    };
    Ok(Output::create(&arguments.output)?.write_all(code.as_bytes())?)
}
