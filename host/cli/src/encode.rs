//! Makes frames from rows of values.

use std::fs;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use framelock_receiving::Protocol;

use crate::input::Input;
use crate::options::protocol;
use crate::output::{Output, note};
use crate::rows::rows;
use crate::serial::PortOptions;

/// Make frames from rows of values: setpoints, or the fields of a description
#[derive(clap::Args)]
#[command(after_help = include_str!("help/encode.txt"))]
pub(crate) struct Arguments {
    /// Read rows from a file, or from - for standard input
    #[arg(value_name = "FILE", default_value = "-")]
    input: PathBuf,
    /// Make these frames: a name, or a description file [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = protocol, hide_possible_values = true)]
    frame: Protocol,
    /// Write frames to FILE instead of standard output; - is standard output even if it is a terminal.
    /// FILE is replaced only if all rows are valid
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the subcommand.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let path = arguments.output.as_deref();
    if path.is_none() && std::io::stdout().is_terminal() {
        bail!(
            "standard output is a terminal, and frames are binary: redirect it, name a file with \
             --output, or write to the terminal with --output -"
        );
    }
    let input = Input::open(&arguments.input, &PortOptions::default())?;
    let Some(path) = path.filter(|path| becomes_a_file(path)) else {
        let output = path.map_or_else(Output::standard, Output::create)?;
        return arguments.encode(input, output);
    };
    Output::check_is_not(path, &arguments.input)?;
    // Write to a new file in the same directory. When all frames are written, the new file replaces `path`.
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let outcome = Output::create(Path::new(&partial))
        .and_then(|output| arguments.encode(input, output))
        .and_then(|()| {
            fs::rename(&partial, path)
                .with_context(|| format!("cannot write to {}", path.display()))
        });
    if outcome.is_err() {
        // Report only the first error, and ignore errors of the cleanup.
        let _ = fs::remove_file(&partial);
    }
    outcome
}

/// Returns whether writing to `path` replaces or creates a regular file. If `path` is a device, each frame is written
/// to it immediately.
fn becomes_a_file(path: &Path) -> bool {
    path.as_os_str() != "-" && fs::metadata(path).map_or(true, |metadata| metadata.is_file())
}

impl Arguments {
    /// Writes a frame for each row, before it waits for the next row.
    fn encode(&self, input: Input, mut output: Output) -> Result<()> {
        let name = input.name.clone();
        let mut count = 0_u64;
        for row in rows(input, &self.frame)? {
            output.write_all(&row?)?;
            count += 1;
        }
        if count == 0 {
            note(&format!("{name} has no rows, so no frames were written"));
        }
        Ok(())
    }
}
