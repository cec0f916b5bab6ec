//! This process: its standard streams, and its reaction to Ctrl-C.

use std::fs::File;
use std::io;

use anyhow::{Context, Result};

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
