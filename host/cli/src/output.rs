//! Outputs: a file, standard output or a serial port. Also the messages on standard error.

use std::fs::{self, File};
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use framelock_description::text::harmless;
use ratatui::crossterm::terminal::size;
use unicode_truncate::UnicodeTruncateStr;

use crate::process;

/// An open output. Its errors name the output that could not be written. A broken pipe is passed on
/// unchanged, for [`exit_code`].
pub(crate) struct Output {
    /// The output's name in messages.
    pub(crate) name: String,
    writer: Box<dyn Write + Send>,
    /// Whether the output is a file. A progress bar is shown only with a file, because the bar would disturb rows on a
    /// terminal.
    pub(crate) is_file: bool,
    is_terminal: bool,
}

impl Output {
    /// Makes an output from any writer.
    pub(crate) fn new(name: &str, writer: impl Write + Send + 'static) -> Self {
        Self {
            name: name.to_owned(),
            writer: Box::new(writer),
            is_file: false,
            is_terminal: false,
        }
    }

    pub(crate) fn file(name: &str, file: File) -> Self {
        Self {
            is_file: file.metadata().is_ok_and(|metadata| metadata.is_file()),
            is_terminal: file.is_terminal(),
            ..Self::new(name, file)
        }
    }

    /// Makes this an output for rows of text. On a terminal, rows are cut to the terminal's width.
    pub(crate) fn of_rows(mut self) -> Self {
        if self.is_terminal {
            let (terminal, row) = (self.writer, Vec::new());
            self.writer = Box::new(Rows { terminal, row });
        }
        self
    }

    /// Creates the file `path`, or replaces it. `-` is standard output.
    pub(crate) fn create(path: &Path) -> Result<Self> {
        if path.as_os_str() == "-" {
            return Self::standard();
        }
        let name = path.display().to_string();
        let file = File::create(path).map_err(|error| {
            anyhow!("cannot write to {name}: {error}; name a file that can be written")
        })?;
        Ok(Self::file(&name, file))
    }

    /// Creates the file `path`, and never replaces a file.
    pub(crate) fn create_new(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let file = File::create_new(path).map_err(|error| {
            anyhow!("cannot record in {name}: {error}; name a file that does not exist")
        })?;
        Ok(Self::file(&name, file))
    }

    /// Checks that the file to be written is not the input.
    pub(crate) fn check_is_not(path: &Path, input: &Path) -> Result<()> {
        if path.exists() && fs::canonicalize(path).ok() == fs::canonicalize(input).ok() {
            let name = path.display();
            bail!("{name} is the input too: give --output another name");
        }
        Ok(())
    }

    pub(crate) fn standard() -> Result<Self> {
        let file = process::standard_stream(io::stdout()).context("cannot open standard output")?;
        Ok(Self::file("standard output", file))
    }
}

/// Cuts rows to the width of a terminal.
struct Rows {
    terminal: Box<dyn Write + Send>,
    /// The beginning of a row whose end has not been written yet.
    row: Vec<u8>,
}

impl Write for Rows {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let columns = size().map_or(0, |(columns, _)| usize::from(columns));
        let mut rows = String::new();
        for piece in bytes.split_inclusive(|&byte| byte == b'\n') {
            self.row.extend(piece);
            if let Some(row) = self.row.strip_suffix(b"\n") {
                rows += &cut(&String::from_utf8_lossy(row), columns);
                rows.push('\n');
                self.row.clear();
            }
        }
        self.terminal.write_all(rows.as_bytes())?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.terminal.flush()
    }
}

/// Cuts a row to a number of columns; `>` marks a row that was cut. With 0 columns, the width is unknown and
/// the row is not cut.
fn cut(row: &str, columns: usize) -> String {
    let (beginning, _) = row.unicode_truncate(columns.saturating_sub(1));
    match row.unicode_truncate(columns).0 {
        whole if columns == 0 || whole.len() == row.len() => row.to_owned(),
        _ => format!("{beginning}>"),
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
        ErrorKind::StorageFull => "; free some space there, or write to another disk",
        _ => "",
    };
    let message = format!("cannot write to {name}: {error}{remedy}");
    io::Error::new(error.kind(), message)
}

/// Writes a message to standard error. Ignores errors, because standard error may be closed.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr(), "{}", message(text));
}

pub(crate) fn message(text: &str) -> String {
    format!("framelock: {}", harmless(text))
}

/// Returns the exit code, and writes the error, if any, to standard error. It is not an error if the program that reads
/// standard output, such as `head`, has ended.
pub(crate) fn exit_code(outcome: Result<()>) -> u8 {
    let Err(error) = outcome else { return 0 };
    let io_error = error.downcast_ref::<io::Error>();
    if io_error.is_some_and(|error| error.kind() == ErrorKind::BrokenPipe) {
        return 0;
    }
    note(&format!("{error:#}"));
    2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_cut_to_the_columns_that_they_take() {
        for (row, columns, expected) in [
            ("payload 0102", 12, "payload 0102"),
            ("payload 0102", 11, "payload 01>"),
            ("payload 0102", 0, "payload 0102"),
            ("µ°ééé", 4, "µ°é>"),
            // Each of these characters is two columns wide.
            ("速度速度", 8, "速度速度"),
            ("速度速度", 6, "速度>"),
            ("payload", 1, ">"),
        ] {
            assert_eq!(cut(row, columns), expected);
        }
    }
}
