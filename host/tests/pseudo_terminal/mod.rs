//! Serial lines for tests: pseudo-terminals.

use std::fs::File;

use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, Winsize, tcgetattr, tcsetattr, tcsetwinsize};

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

/// A terminal of so many columns and rows: its user's end, and the end for programs.
#[allow(dead_code, reason = "not every test needs one")]
pub(crate) fn terminal(columns: u16, rows: u16) -> (File, File) {
    let (user, _raw, name) = line();
    let near_end = File::options().read(true).write(true).open(name).unwrap();
    let size = Winsize {
        ws_row: rows,
        ws_col: columns,
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    tcsetwinsize(&near_end, size).unwrap();
    (user, near_end)
}
