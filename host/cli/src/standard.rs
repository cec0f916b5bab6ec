//! Standard input and output as files: sizes can be asked for, and nothing is buffered twice.

use std::fs::File;
use std::io;

/// A standard stream as a file.
#[cfg(unix)]
pub(crate) fn file(stream: impl std::os::fd::AsFd) -> io::Result<File> {
    stream.as_fd().try_clone_to_owned().map(File::from)
}

/// A standard stream as a file.
#[cfg(windows)]
pub(crate) fn file(stream: impl std::os::windows::io::AsHandle) -> io::Result<File> {
    stream.as_handle().try_clone_to_owned().map(File::from)
}
