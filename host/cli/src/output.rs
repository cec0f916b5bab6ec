//! Outputs: a file, standard output or a serial port. Also the messages on standard error, this process's exit code,
//! and its reaction to Ctrl-C.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Result, anyhow, bail};
use framelock_description::text::harmless;

/// An open output. Its errors name the output that could not be written. A broken pipe is passed on
/// unchanged, for [`exit_code`].
pub(crate) struct Output {
    /// The output's name in messages.
    pub(crate) name: String,
    writer: Box<dyn Write + Send>,
}

impl Output {
    /// Makes an output from any writer.
    pub(crate) fn new(name: &str, writer: impl Write + Send + 'static) -> Self {
        Self {
            name: name.to_owned(),
            writer: Box::new(writer),
        }
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
        Ok(Self::new(&name, file))
    }

    /// Creates the file `path`, and never replaces a file.
    pub(crate) fn create_new(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let file = File::create_new(path).map_err(|error| {
            anyhow!("cannot record in {name}: {error}; name a file that does not exist")
        })?;
        Ok(Self::new(&name, file))
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
        let file = standard_stream(io::stdout()).context("cannot open standard output")?;
        Ok(Self::new("standard output", file))
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

/// Locks a state, even if another thread panicked while it held the lock. The state must be valid at all times.
pub(crate) fn lock<T>(state: &Mutex<T>) -> MutexGuard<'_, T> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
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

/// Returns standard input or output as a file. Unlike `Stdin` and `Stdout`, a file can report its size and adds no
/// buffer of its own.
#[cfg(unix)]
pub(crate) fn standard_stream(stream: impl std::os::fd::AsFd) -> io::Result<File> {
    stream.as_fd().try_clone_to_owned().map(File::from)
}

/// Returns standard input or output as a file.
#[cfg(windows)]
pub(crate) fn standard_stream(stream: impl std::os::windows::io::AsHandle) -> io::Result<File> {
    stream.as_handle().try_clone_to_owned().map(File::from)
}

/// The exit code that a shell reports for a program that Ctrl-C ended.
const EXIT_CODE_INTERRUPTED: i32 = 130;

/// Calls `first` on a thread of its own at the first Ctrl-C, SIGTERM or SIGHUP. The second signal ends the process,
/// in case `first` takes long.
pub(crate) fn on_interrupt(first: impl FnOnce() + Send + 'static) -> Result<()> {
    let mut first = Some(first);
    ctrlc::set_handler(move || match first.take() {
        Some(first) => drop(std::thread::spawn(first)),
        None => std::process::exit(EXIT_CODE_INTERRUPTED),
    })
    .context("cannot watch for Ctrl-C")
}
