//! Frames from rows of values.

use std::fs;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use crate::frame::Frame;
use crate::input::Input;
use crate::output::Output;
use crate::rows::{InputFormat, rows};

/// Frames from rows of values: setpoints, or what a description names.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/encode.txt"))]
pub(crate) struct Arguments {
    /// A file, or - for standard input
    #[arg(value_name = "FILE", default_value = "-")]
    input: PathBuf,
    /// The frames: a name, or a file that describes them [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = Frame::named)]
    frame: Frame,
    /// How the values are written
    #[arg(long, value_enum, default_value_t = InputFormat::Auto)]
    input_format: InputFormat,
    /// Where frames go, - being standard output even if that is a terminal; a file is replaced
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the subcommand: writes each frame before the next row is waited for.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let input = Input::open(&arguments.input, None)?;
    let mut output = open_output(arguments.output.as_deref(), &arguments.input)?;
    if output.is_file {
        input.show_progress();
    }
    for row in rows(input, arguments.input_format, &arguments.frame, false)? {
        output.write_all(&row?.frame)?;
    }
    Ok(())
}

fn open_output(argument: Option<&Path>, input: &Path) -> Result<Output> {
    let Some(path) = argument else {
        if std::io::stdout().is_terminal() {
            bail!(
                "standard output is a terminal, and frames are binary: redirect it, or name a file \
                 with --output, where - is the terminal all the same"
            );
        }
        return Output::standard();
    };
    // It would be emptied before it is read.
    if path.is_file() && fs::canonicalize(path).ok() == fs::canonicalize(input).ok() {
        let name = path.display();
        bail!("{name} is the input: give --output another name");
    }
    Output::create(path)
}
