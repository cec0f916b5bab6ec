//! Standard input and output as files: sizes can be asked for, and nothing is buffered twice.

use std::fs::File;
use std::io;
#[cfg(unix)]
use std::os::fd::{AsFd, OwnedFd as Owned};
#[cfg(windows)]
use std::os::windows::io::{AsHandle, OwnedHandle as Owned};

#[cfg(unix)]
fn own(stream: &impl AsFd) -> io::Result<Owned> {
    stream.as_fd().try_clone_to_owned()
}

#[cfg(windows)]
fn own(stream: &impl AsHandle) -> io::Result<Owned> {
    stream.as_handle().try_clone_to_owned()
}

/// Standard input.
///
/// # Errors
/// No further file may be open.
pub fn input() -> io::Result<File> {
    own(&io::stdin()).map(File::from)
}

/// Standard output.
///
/// # Errors
/// No further file may be open.
pub fn output() -> io::Result<File> {
    own(&io::stdout()).map(File::from)
}

/// Whether `file` is the terminal that the user types at, and not a further one on a serial line.
#[cfg(unix)]
#[must_use]
pub fn is_users_terminal(file: &File) -> bool {
    use std::io::IsTerminal;
    use std::os::unix::fs::MetadataExt;

    let device = |file: &File| file.metadata().map(|metadata| metadata.rdev());
    let Ok(asked) = device(file) else {
        return false;
    };
    let error = own(&io::stderr()).map(File::from);
    // Whoever opens it by its general name means it too.
    let general = File::open("/dev/tty");
    [input(), output(), error, general]
        .into_iter()
        .flatten()
        .any(|user| user.is_terminal() && device(&user).is_ok_and(|device| device == asked))
}
