//! Where a stream goes: a file, standard output or a serial port.

use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, Result, anyhow};

use crate::standard;

/// An open output. Its errors say what could not be written; that its reader has gone is left as it
/// is, for [`exit_code`].
pub(crate) struct Output {
    /// What to call it in messages.
    pub(crate) name: String,
    writer: Box<dyn Write + Send>,
    /// What is written to a terminal, or a pipe to one, is torn by what is shown meanwhile.
    pub(crate) is_file: bool,
}

impl Output {
    /// Any writer.
    pub(crate) fn new(name: &str, writer: impl Write + Send + 'static) -> Self {
        Self {
            name: name.to_owned(),
            writer: Box::new(writer),
            is_file: false,
        }
    }

    pub(crate) fn file(name: &str, file: File) -> Self {
        Self {
            is_file: file.metadata().is_ok_and(|metadata| metadata.is_file()),
            ..Self::new(name, file)
        }
    }

    /// Creates `path`, where `-` is standard output; a file is replaced.
    pub(crate) fn create(path: &Path) -> Result<Self> {
        if path.as_os_str() == "-" {
            return Self::standard();
        }
        let name = path.display().to_string();
        let file = File::create(path)
            .map_err(|error| anyhow!("cannot write to {name}: {error}; name a file to write"))?;
        Ok(Self::file(&name, file))
    }

    pub(crate) fn standard() -> Result<Self> {
        let file = standard::file(io::stdout()).context("cannot open standard output")?;
        Ok(Self::file("standard output", file))
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer
            .write(bytes)
            .map_err(|error| failure(error, &self.name))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer
            .flush()
            .map_err(|error| failure(error, &self.name))
    }
}

fn failure(error: io::Error, name: &str) -> io::Error {
    let remedy = match error.kind() {
        ErrorKind::BrokenPipe | ErrorKind::Interrupted => return error,
        ErrorKind::StorageFull => "; make room there or write elsewhere",
        _ => "",
    };
    let told = format!("cannot write to {name}: {error}{remedy}");
    io::Error::new(error.kind(), told)
}

/// Says something on standard error, which may be closed.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr(), "framelock: {text}");
}

/// Says on standard error what went wrong, if something did. It is nothing wrong if the reader of
/// standard output has gone, as `head` does.
pub(crate) fn exit_code(outcome: Result<()>) -> u8 {
    let Err(error) = outcome else { return 0 };
    let io_error = error.downcast_ref::<io::Error>();
    if io_error.is_some_and(|error| error.kind() == ErrorKind::BrokenPipe) {
        return 0;
    }
    note(&format!("{error:#}"));
    2
}
