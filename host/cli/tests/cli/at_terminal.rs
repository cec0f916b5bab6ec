//! Runs a program on a pseudo-terminal, whose screen the test reads.

use std::fs::{self, File};
use std::io::{Read, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};

use framelock_limited::{Process, RunToEnd as _};
use rustix::termios::{Termios, tcgetattr};

use crate::pseudo_terminal::{is_ready, terminal};

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_framelock");

/// The escape sequences that enter the view, leave the view and show the cursor.
pub(crate) const ENTER: &str = "\x1b[?1049h";
const LEAVE: &str = "\x1b[?1049l";
const SHOW_CURSOR: &str = "\x1b[?25h";

/// The options with which `setsid` makes a terminal the controlling terminal.
pub(crate) const CONTROLLING: [&str; 2] = ["--ctty", "--wait"];

/// A program on a terminal of 80 columns and 24 rows.
pub(crate) struct AtTerminal {
    /// The user's end of the terminal.
    user: File,
    near_end: File,
    settings: Termios,
    child: Process,
    seen: String,
}

/// The settings of a terminal that a view changes.
fn modes(settings: &Termios) -> String {
    format!(
        "{:?} {:?} {:?} {:?}",
        settings.input_modes, settings.output_modes, settings.local_modes, settings.control_modes
    )
}

impl AtTerminal {
    /// Runs a command with the terminal as its standard streams, except for streams that the shell redirects.
    pub(crate) fn start(
        setsid: &[&str],
        command: &[&str],
        redirected: &str,
        directory: &Path,
    ) -> Self {
        let (user, near_end) = terminal(80, 24);
        let stream = || Stdio::from(near_end.try_clone().unwrap());
        let mut command_with_terminal = Command::new("setsid");
        command_with_terminal
            .args(setsid)
            .args(["sh", "-c", &format!("exec \"$0\" \"$@\" {redirected}")])
            .args(command)
            .current_dir(directory)
            .env("TERM", "xterm-256color")
            .stdin(stream())
            .stdout(stream())
            .stderr(stream());
        let child = Process::start(&mut command_with_terminal);
        Self {
            user,
            settings: tcgetattr(&near_end).unwrap(),
            near_end,
            child: child.unwrap(),
            seen: String::new(),
        }
    }

    pub(crate) fn monitor(arguments: &[&str], redirected: &str, directory: &Path) -> Self {
        let command = [&[PROGRAM, "monitor"], arguments].concat();
        Self::start(&CONTROLLING, &command, redirected, directory)
    }

    /// Reads the screen until the text appears. Returns all output so far. Fails if no output comes for a minute: the
    /// test holds the terminal open, so the end of the program does not end the output.
    pub(crate) fn wait_for(&mut self, text: &str) -> String {
        while !self.seen.contains(text) {
            let mut bytes = [0; 4096];
            let is_ready = is_ready(&self.user);
            assert!(is_ready, "{text:?} does not appear in {:?}", self.seen);
            let length = self.user.read(&mut bytes).unwrap();
            assert_ne!(length, 0);
            self.seen += &String::from_utf8_lossy(&bytes[..length]);
        }
        std::mem::take(&mut self.seen)
    }

    pub(crate) fn type_key(&mut self, key: &str) {
        self.user.write_all(key.as_bytes()).unwrap();
    }

    /// Waits for the end, and checks that the terminal's settings are restored. Returns all output and the exit code.
    pub(crate) fn finish(mut self) -> (String, Option<i32>) {
        let status = self.child.wait().unwrap();
        let settings = tcgetattr(&self.near_end).unwrap();
        assert_eq!(modes(&settings), modes(&self.settings));
        self.near_end.write_all(b"END").unwrap();
        (self.wait_for("END"), status.code())
    }

    /// Waits for the end of a view. Returns the output after the view, and the exit code.
    pub(crate) fn end(self) -> (String, Option<i32>) {
        let (all, code) = self.finish();
        let (view, behind) = all.rsplit_once(LEAVE).expect("the view is left");
        assert!(!behind.contains(ENTER));
        assert!(view.contains(SHOW_CURSOR) || behind.contains(SHOW_CURSOR));
        (behind.to_owned(), code)
    }

    /// Sends a signal to the program itself, not to `setsid`. If `setsid` leads a process group, it forks, and the
    /// program is then a child of `setsid`.
    pub(crate) fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let children = format!("/proc/{id}/task/{id}/children");
        let children = fs::read_to_string(children).unwrap_or_default();
        let program = children.split_whitespace().next().unwrap_or(&id);
        let kill = Command::new("kill").args([name, program]).run_to_end(b"");
        assert!(kill.unwrap().status.success());
    }
}
