//! Tests of `framelock demo` as a process, without a terminal.

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
