//! Serial lines for tests, made of pseudo-terminals.

use std::fs::File;
use std::io::Read;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::retry_on_intr;
use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, Winsize, tcgetattr, tcsetattr, tcsetwinsize};

/// Opens a serial line. Returns its far end, its near end, and the name of the near end.
///
/// The caller must hold the near end open, because otherwise the pseudo-terminal counts as disconnected.
pub(crate) fn line() -> (File, File, String) {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let far_end = openpt(flags).unwrap();
    unlockpt(&far_end).unwrap();
    let name = ptsname(&far_end, Vec::new())
        .unwrap()
        .into_string()
        .unwrap();
    let near_end = File::open(&name).unwrap();
    // Bytes that are sent before the port is opened must not be altered either.
    let mut settings = tcgetattr(&near_end).unwrap();
    settings.make_raw();
    tcsetattr(&near_end, OptionalActions::Now, &settings).unwrap();
    (far_end.into(), near_end, name)
}

/// Waits at most a minute. Returns whether a byte can be read.
pub(crate) fn is_ready(end: &File) -> bool {
    let limit = Timespec {
        tv_sec: 60,
        tv_nsec: 0,
    };
    let mut ends = [PollFd::new(end, PollFlags::IN)];
    retry_on_intr(|| poll(&mut ends, Some(&limit))).unwrap() == 1
}

/// Fills `bytes` from the line.
///
/// Waits at most a minute for the next byte. The test holds the line open, so the line stays open when the sender ends.
pub(crate) fn read_exactly(far_end: &mut File, bytes: &mut [u8]) {
    let mut missing = bytes;
    while !missing.is_empty() {
        assert!(is_ready(far_end), "{} bytes are missing", missing.len());
        let count = far_end.read(missing).unwrap();
        missing = missing.split_at_mut(count).1;
    }
}

/// Opens a terminal of this many columns and rows. Returns the user's end and the end for programs.
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
