//! Tests of `framelock demo` at a terminal. `tests/cases/demo.md` shows its output without a terminal.

use std::io::Read as _;

use framelock_limited::Process;

use crate::process;
use crate::pseudo_terminal::{is_ready, terminal};

#[test]
fn at_a_terminal_it_runs_live_and_a_signal_restores_the_terminal() {
    for (rows, is_live) in [(23, true), (22, false)] {
        let (mut user, near_end) = terminal(80, rows);
        let mut command = process::framelock(&["demo"]);
        command.env("TERM", "xterm-256color").stdout(near_end);
        let mut child = Process::start(&mut command).unwrap();
        drop(command);
        let mut seen = String::new();
        let mut read_until = |text: &str| {
            while !seen.contains(text) {
                let mut bytes = [0; 4096];
                assert!(is_ready(&user), "{text:?} does not appear in {seen:?}");
                let length = user.read(&mut bytes).unwrap();
                seen += &String::from_utf8_lossy(&bytes[..length]);
            }
            seen.clone()
        };
        if is_live {
            let begun = read_until("Ctrl-C ends");
            assert!(begun.starts_with("\x1B[?1049h\x1B[?25l"), "{begun:?}");
            process::signal(&mut child, "-INT");
        }
        let all = read_until("framelock             missed ");
        let restored = all.rsplit_once("\x1B[?25h\x1B[?1049l");
        assert_eq!(restored.is_some(), is_live, "{all:?}");
        let after = restored.map_or(&*all, |(_, after)| after);
        assert!(after.contains("the lecture's machine missed") && !after.contains('\x1B'));
        assert_eq!(after.contains("ended early"), is_live);
        assert_eq!(child.wait().unwrap().code(), Some(0));
    }
}
