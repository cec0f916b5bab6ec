//! Frames from rows of values.

use std::fs;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use framelock_receiving::Protocol;

use crate::frame_option::ProtocolParser;
use crate::input::Input;
use crate::output::{Output, note};
use crate::rows::{InputFormat, rows};
use crate::serial::PortOptions;

/// Frames from rows of values: setpoints, or what a description names
#[derive(clap::Args)]
#[command(after_help = include_str!("help/encode.txt"))]
pub(crate) struct Arguments {
    /// A file, or - for standard input
    #[arg(value_name = "FILE", default_value = "-")]
    input: PathBuf,
    /// The frames: a name, or a file that describes them [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = ProtocolParser, hide_possible_values = true)]
    frame: Protocol,
    /// How the values are written: csv, jsonl (JSON: an object per line, or an array of them), or
    /// auto, which tells them apart
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = InputFormat::Auto, hide_possible_values = true)]
    input_format: InputFormat,
    /// Where frames go, - being standard output even if that is a terminal; a file is replaced when
    /// all rows are right, and left as it is otherwise
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let path = arguments.output.as_deref();
    if path.is_none() && std::io::stdout().is_terminal() {
        bail!(
            "standard output is a terminal, and frames are binary: redirect it, or name a file \
             with --output, where - is the terminal all the same"
        );
    }
    let input = Input::open(&arguments.input, &PortOptions::default())?;
    let Some(path) = path.filter(|path| becomes_a_file(path)) else {
        let output = path.map_or_else(Output::standard, Output::create)?;
        return arguments.encode(input, output);
    };
    Output::check_is_not(path, &arguments.input)?;
    // Beside it, so that it can take its place.
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let outcome = Output::create(Path::new(&partial))
        .and_then(|output| arguments.encode(input, output))
        .and_then(|()| {
            fs::rename(&partial, path)
                .with_context(|| format!("cannot write to {}", path.display()))
        });
    if outcome.is_err() {
        // What went wrong is said already.
        let _ = fs::remove_file(&partial);
    }
    outcome
}

/// Whether frames for `path` are to be a file; a device takes them as they come.
fn becomes_a_file(path: &Path) -> bool {
    path.as_os_str() != "-" && fs::metadata(path).map_or(true, |metadata| metadata.is_file())
}

impl Arguments {
    /// Writes each frame before the next row is waited for.
    fn encode(&self, input: Input, mut output: Output) -> Result<()> {
        if output.is_file {
            input.show_progress();
        }
        let name = input.name.clone();
        let mut count = 0_u64;
        for row in rows(input, self.input_format, &self.frame, false)? {
            output.write_all(&row?.frame)?;
            count += 1;
        }
        if count == 0 {
            note(&format!("{name} has no rows, so there are no frames"));
        }
        Ok(())
    }
}
