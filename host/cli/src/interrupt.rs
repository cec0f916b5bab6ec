//! Ctrl-C, and its relatives SIGTERM and SIGHUP.

use anyhow::{Context, Result};

/// What the shell reports for a program that Ctrl-C ended.
const EXIT_CODE_INTERRUPTED: i32 = 130;

/// Calls `first` at the first one, on a thread of its own. A second one ends the process, for when
/// the end itself has to wait.
pub(crate) fn watch(first: impl FnOnce() + Send + 'static) -> Result<()> {
    let mut first = Some(first);
    ctrlc::set_handler(move || match first.take() {
        Some(first) => drop(std::thread::spawn(first)),
        None => std::process::exit(EXIT_CODE_INTERRUPTED),
    })
    .context("cannot watch for Ctrl-C")
}
