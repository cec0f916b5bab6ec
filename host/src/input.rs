//! What a stream is read from: a file, standard input or a serial port.

mod read_ahead;

use std::fs::{File, Metadata};
use std::io::{self, BufRead, IsTerminal, Read, Seek};
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use indicatif::{ProgressBar, ProgressStyle};

use crate::interrupt;
use crate::line_errors::Marking;
use crate::serial::{self, Device};
use crate::standard;
use read_ahead::ReadAhead;

/// An open input.
pub struct Input {
    /// What to call it in messages.
    pub name: String,
    reader: Box<dyn Read + Send>,
    /// Bytes still to be read, if it is a regular file.
    size: Option<u64>,
    /// If it is a serial port.
    port: Option<Device>,
}

impl Input {
    /// Opens `argument`: `-` is standard input, a terminal device a serial port, which `baud` is
    /// for, and anything else a file.
    ///
    /// # Errors
    /// It is not there, must not be opened, is a directory, or is no serial port although a `baud`
    /// is given.
    pub fn open(argument: &Path, baud: Option<u32>) -> anyhow::Result<Self> {
        let is_standard = argument.as_os_str() == "-";
        let name = if is_standard {
            "standard input".to_owned()
        } else {
            argument.display().to_string()
        };
        if !is_standard && let Some(port) = serial::open_if_port(argument, &name, baud)? {
            return Ok(Self {
                name,
                port: Some(port.device()),
                reader: Box::new(port),
                size: None,
            });
        }
        let file = if is_standard {
            standard::input().context("cannot open standard input")?
        } else {
            open_file(argument, &name)?
        };
        if baud.is_some() {
            bail!("--baud is for serial ports, and {name} is none: leave it out, or name a port");
        }
        if file.is_terminal() {
            eprintln!(
                "framelock: reading what is typed (Ctrl-D ends it); see --help for files and ports"
            );
        }
        let size = remaining(&file);
        Ok(Self {
            name,
            reader: Box::new(file),
            size,
            port: None,
        })
    }

    pub(crate) fn is_port(&self) -> bool {
        self.port.is_some()
    }

    /// From now on line errors are marked in the bytes read, as long as what this gives lives; none
    /// if the input is no serial port, or if the operating system cannot.
    pub(crate) fn mark_line_errors(&self) -> Option<Marking> {
        Marking::begin(self.port.clone()?)
    }

    /// Shows how far the input has been read, if it has a size and standard error is a terminal.
    /// To be cleared before anything else is shown.
    ///
    /// Not unless there is no output meanwhile or it goes to a file: what goes elsewhere may end on
    /// the same terminal, and be torn.
    pub fn show_progress(&mut self, output: Option<&File>) -> ProgressBar {
        let is_elsewhere = output.is_none_or(|output| remaining(output).is_some());
        let Some(size) = self.size.filter(|_| is_elsewhere) else {
            return ProgressBar::hidden();
        };
        let style = ProgressStyle::with_template("{bar:40} {bytes}/{total_bytes} {bytes_per_sec}");
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        let progress = ProgressBar::new(size).with_style(style);
        let reader = std::mem::replace(&mut self.reader, Box::new(io::empty()));
        self.reader = Box::new(progress.wrap_read(reader));
        progress
    }

    /// The input to be read.
    #[must_use]
    pub fn into_reader(self) -> impl BufRead {
        ReadAhead::new(self.reader).0
    }

    /// The input to be read, with Ctrl-C an end like any other.
    ///
    /// # Errors
    /// The operating system does not let Ctrl-C be watched for.
    pub fn into_reader_until_ctrl_c(self) -> anyhow::Result<impl BufRead> {
        let (reader, end) = ReadAhead::new(self.reader);
        interrupt::watch(move || {
            // Nobody listens any more if the stream has just ended by itself.
            let _ = end.send(read_ahead::Event::End);
        })
        .context("cannot watch for Ctrl-C")?;
        Ok(reader)
    }
}

fn open_file(path: &Path, name: &str) -> anyhow::Result<File> {
    const INSTEAD: &str = "name a file, a serial port, or - for standard input";
    let file =
        File::open(path).map_err(|error| anyhow!("cannot open {name}: {error}; {INSTEAD}"))?;
    if file.metadata().is_ok_and(|metadata| metadata.is_dir()) {
        bail!("{name} is a directory; {INSTEAD}");
    }
    Ok(file)
}

/// Bytes from where `file` stands to its end, if it is a regular one.
fn remaining(mut file: &File) -> Option<u64> {
    let metadata = file.metadata().ok().filter(Metadata::is_file)?;
    Some(metadata.len().saturating_sub(file.stream_position().ok()?))
}
