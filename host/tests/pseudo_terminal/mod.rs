//! Serial lines for tests: pseudo-terminals.

use std::fs::File;

use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Both ends of a line, and the name of the near one.
///
/// The near end is to be held open: a pseudo-terminal that nobody has open counts as disconnected.
pub(crate) fn line() -> (File, File, String) {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let far_end = openpt(flags).unwrap();
    unlockpt(&far_end).unwrap();
    let name = ptsname(&far_end, Vec::new())
        .unwrap()
        .into_string()
        .unwrap();
    let near_end = File::open(&name).unwrap();
    // What is sent before the port is opened must not be altered either.
    let mut settings = tcgetattr(&near_end).unwrap();
    settings.make_raw();
    tcsetattr(&near_end, OptionalActions::Now, &settings).unwrap();
    (far_end.into(), near_end, name)
}
