//! Runs the unchanged examples for Embassy and RTIC in the emulator. Each passes the same tests.
//!
//! `cargo xtask verify --only examples` builds them, and sets the variable `FRAMELOCK_EXAMPLES` to
//! their folder. Without this variable the tests fail; they are never skipped.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use std::path::PathBuf;

use nrf52840_emulator::{Board, Image, LineSymbol, MILLISECOND};

const SETPOINT: &[u8] = b"AB\0\x76\x77\x78\r";
const AXES: &str = "axes: [118, 119, 120]";
const LIVE: &str = "axes: [118, 119, 120], phase: Live";

/// An example's log.
#[derive(Debug)]
struct Log(Vec<String>);

impl Log {
    fn phases(&self) -> Vec<&str> {
        let outputs = self.0.iter().filter(|line| line.starts_with("INFO"));
        let phases = outputs.filter_map(|line| line.split_once("phase: ")?.1.split(' ').next());
        let mut phases: Vec<&str> = phases.collect();
        phases.dedup();
        phases
    }

    /// Asserts that the output went live at the setpoint, and has not moved since.
    fn assert_stays_live(&self) {
        let phases = self.phases();
        assert!(
            phases.starts_with(&["Parked", "Approach", "Live"]),
            "{phases:?}"
        );
        let outputs = self.0.iter().filter(|line| line.starts_with("INFO"));
        let mut since = outputs.skip_while(|line| !line.contains("phase: Live"));
        assert!(since.all(|line| line.contains(AXES)), "{self:?}");
    }

    fn says(&self, text: &str) -> bool {
        self.0.iter().any(|line| line.contains(text))
    }
}

/// Runs each example. `test` sends to the booted board, which then runs for `milliseconds`. `check`
/// gets the log.
fn each(milliseconds: u64, test: impl Fn(&str, &mut Board), check: impl Fn(&Log)) {
    let Some(folder) = std::env::var_os("FRAMELOCK_EXAMPLES").map(PathBuf::from) else {
        panic!("FRAMELOCK_EXAMPLES is not set; run `cargo xtask verify --only examples`");
    };
    for example in ["framelock-embassy", "framelock-rtic"] {
        let elf = std::fs::read(folder.join(example)).unwrap();
        let mut board = Board::new(Image::parse(&elf).unwrap()).unwrap();
        board.run_for(10 * MILLISECOND).unwrap();
        test(example, &mut board);
        let mut log = Vec::new();
        for _ in 0..milliseconds {
            board.run_for(MILLISECOND).unwrap();
            log.extend(board.log());
        }
        println!("{example}:\n{}", log.join("\n"));
        check(&Log(log));
    }
}

#[test]
fn setpoints_come_out_and_the_failsafe_takes_over_when_they_stop() {
    // 1.2 s, because an approach takes a second.
    let frames = SETPOINT.repeat(2_000);
    each(
        2_000,
        |_, board| {
            board.send(&frames);
        },
        |log| {
            assert!(log.says(LIVE));
            assert_eq!(
                log.phases(),
                ["Parked", "Approach", "Live", "Hold", "Ramp", "Parked"]
            );
        },
    );
}

/// Sends setpoints until the output is live, and then 10 ms of silence. From then on, a wrong frame would move the
/// output. Returns the end of the silence.
fn go_live(board: &mut Board) -> u64 {
    // 1.2 s.
    board.send(&SETPOINT.repeat(2_000));
    board.send_symbols(&[LineSymbol::Idle(1152)])
}

/// Sends 30 ms of silence, in which a wrong frame would move the output, and a setpoint.
fn stay_live(board: &mut Board) {
    board.send_symbols(&[LineSymbol::Idle(3456)]);
    board.send(SETPOINT);
    board.send_symbols(&[LineSymbol::Idle(1152)]);
}

/// If only the corrupted byte and the bytes dropped after it were missing, the rest of the stream would contain a
/// frame.
#[test]
fn bytes_around_a_framing_error_are_no_frame() {
    each(
        1_900,
        |_, board| {
            let start = go_live(board);
            // The error is noticed late, when all these bytes are in the driver's buffer.
            board.send(&[b'.'; 70]);
            board.send(b"AB\0de");
            let late = board.send_symbols(&[LineSymbol::BadStop(b'f')]);
            board.hold_off(start, late - start);
            board.send_symbols(&[LineSymbol::Idle(300)]);
            board.send(b"f\r");
            stay_live(board);
            for dropped in 0..10 {
                board.send(b"AB\0de");
                board.send_symbols(&[LineSymbol::BadStop(b'f')]);
                board.send(&b".........."[..dropped]);
                board.send(b"f\r");
                stay_live(board);
            }
        },
        |log| {
            log.assert_stays_live();
            assert!(log.says("WARN  Framing"));
        },
    );
}

/// The bytes just before the lost bytes and the bytes just after them would together be a frame.
#[test]
fn bytes_around_an_overrun_are_no_frame() {
    each(
        1_400,
        |example, board| {
            let start = go_live(board);
            // The number of bytes that the UARTE's FIFO and the driver's buffer keep. The rest is
            // lost.
            let kept = if example == "framelock-rtic" {
                7
            } else {
                256 + 6
            };
            board.send(&vec![b'.'; kept - 5]);
            board.send(b"AB\0de");
            let lost = board.send(&[b'.'; 70]);
            board.hold_off(start, lost - start);
            // 2.6 ms: long enough to parse all kept bytes, too short to count as an idle line.
            board.send_symbols(&[LineSymbol::Idle(300)]);
            board.send(b"f\r");
            stay_live(board);
        },
        |log| {
            log.assert_stays_live();
            assert!(log.says("WARN  Overrun"));
        },
    );
}

#[test]
fn bytes_around_a_pause_are_no_frame() {
    each(
        1_400,
        |_, board| {
            go_live(board);
            board.send(b"AB\0de");
            // 10 ms.
            board.send_symbols(&[LineSymbol::Idle(1152)]);
            board.send(b"f\r");
            stay_live(board);
        },
        Log::assert_stays_live,
    );
}

/// After an overrun, and after a bad byte, frames are received even without a pause.
#[test]
fn frames_behind_an_error_come_out() {
    each(
        1_300,
        |_, board| {
            let lost = board.send(&[b'.'; 400]);
            board.hold_off(board.now(), lost - board.now());
            board.send(SETPOINT);
            board.send_symbols(&[LineSymbol::BadStop(b'A')]);
            board.send(&SETPOINT.repeat(2_000));
        },
        |log| assert!(log.says(LIVE) && log.says("WARN  Framing")),
    );
}

/// A frame that contains the end of a frame and the beginning of another one. Without its first byte, the receiver
/// finds frames at the wrong place until a pause.
#[test]
fn an_ambiguous_payload_is_right_after_one_pause() {
    each(
        1_400,
        |_, board| {
            let frames = b"AB\0\rAB\r".repeat(2_000);
            // 143 frames, without the first byte.
            board.send(&frames[1..1_001]);
            // 10 ms.
            board.send_symbols(&[LineSymbol::Idle(1152)]);
            board.send(&frames);
        },
        |log| {
            assert!(log.says("axes: [13, 65, 66], phase: Live"));
            // Only the wrong frames have a demand of 0 on the third axis.
            let live = log.0.iter().filter(|line| line.contains("phase: Live"));
            assert!(
                live.clone().all(|line| line.contains("[13, 65, 66]")),
                "{log:?}"
            );
        },
    );
}

const GUIDE: &str = include_str!("../../docs/frameworks.md");

/// Returns the guide's code blocks in this language.
fn blocks(language: &str) -> Vec<&'static str> {
    let fence = format!("\n```{language}\n");
    let parts = GUIDE.split(&fence).skip(1);
    parts
        .map(|part| part.split_once("```").unwrap().0)
        .collect()
}

/// Returns the lines without their indentation.
fn unindented(text: &str) -> String {
    text.lines()
        .map(|line| line.trim().to_owned() + "\n")
        .collect()
}

#[test]
fn the_guides_rust_is_the_examples() {
    let sources = [
        include_str!("../examples/embassy/src/main.rs"),
        include_str!("../examples/handlers/src/embassy.rs"),
        include_str!("../examples/rtic/src/main.rs"),
        include_str!("../../core/examples/dma.rs"),
        include_str!("../../core/examples/line_events_and_counters.rs"),
        include_str!("../../core/examples/mailbox.rs"),
        include_str!("../../core/examples/push_in_a_loop.rs"),
    ]
    .map(unindented);
    assert!(!blocks("rust").is_empty());
    for block in blocks("rust").into_iter().map(unindented) {
        assert!(
            sources.iter().any(|source| source.contains(&block)),
            "{block}"
        );
    }
}

#[test]
#[cfg(unix)]
fn the_guides_commands_show_a_setpoint() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    for commands in blocks("sh") {
        let mut shell = std::process::Command::new("sh");
        shell.args(["-e", "-c", commands]).current_dir(root);
        // The commands compile an example first.
        let output =
            framelock_limited::run_within(std::time::Duration::from_mins(20), &mut shell, b"");
        let output = output.unwrap();
        assert!(output.status.success(), "{commands}: {output:?}");
        let shown = String::from_utf8(output.stdout).unwrap();
        assert!(shown.contains(LIVE), "{shown}");
    }
}
