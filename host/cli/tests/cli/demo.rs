//! Tests of `framelock demo` as a process, without a terminal and at a terminal.

use crate::process;

#[test]
fn the_demo_shows_the_difference() {
    let text = process::shown(&["demo"], "");
    for expected in [
        "\nONE LOST BYTE ",
        "\nthe lecture's machine   DEAF for 5.9 s                         failsafe PARKED\n",
        "\n● 20 delivered  ○ 59 missed though whole  × 1 broken by the line  ! 0 wrong\n",
        "\nframelock               LISTENING                                failsafe LIVE\n",
        "\n● 79 delivered  ○ 0 missed though whole  × 1 broken by the line  ! 0 wrong\n",
        "\nSILENCE ",
        "\nthe lecture's machine missed ",
        "\nframelock             missed 0 whole frames, and was deaf for at most 0.0 s\n",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    assert!(
        text.lines().all(|line| line.chars().count() <= 78),
        "{text}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn at_a_terminal_it_runs_live_and_a_signal_restores_the_terminal() {
    use std::io::Read as _;

    use framelock_limited::Process;

    use crate::pseudo_terminal::{is_ready, terminal};

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
