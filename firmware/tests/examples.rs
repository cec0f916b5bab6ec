//! Runs the unchanged examples for Embassy and RTIC in the emulator. Both examples pass the same tests.
//!
//! `cargo xtask verify --only examples` builds them, and sets the variable `FRAMELOCK_EXAMPLES` to
//! their folder. Without this variable the tests fail; they are never skipped.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use std::path::PathBuf;

use nrf52840_emulator::{Board, Image, MILLISECOND};

mod symbols;

use symbols::symbols;

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

/// Runs each example. `test` puts symbols on the line of the booted board. Then the board runs for `milliseconds`.
/// `check` gets the log.
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

/// Puts symbols on the line, and returns the end of the last one.
fn send(board: &mut Board, words: &str) -> u64 {
    board.send_symbols(&symbols(words))
}

/// 1.2 s of setpoints. An approach takes a second, so the output is then live.
const GO_LIVE: &str = "frame:118,119,120*2000";

#[test]
fn setpoints_come_out_and_the_failsafe_takes_over_when_they_stop() {
    each(
        2_000,
        |_, board| {
            send(board, GO_LIVE);
        },
        |log| {
            assert!(log.says(LIVE));
            let phases = ["Parked", "Approach", "Live", "Hold", "Ramp", "Parked"];
            assert_eq!(log.phases(), phases);
        },
    );
}

/// The bytes before a disturbance and those after it would together be a frame, which would move the output.
#[test]
fn bytes_around_a_disturbance_are_no_frame() {
    // 30 ms of silence, then a frame with the setpoint. If the receiver delivered a wrong frame before the silence, the
    // output would move during the silence.
    let stays = "idle:3456 frame:118,119,120 idle:1152";
    // If only the corrupted byte and the bytes dropped after it were missing, the rest would contain a frame.
    let errors = (0..10).map(|dropped| {
        let dropped = "2E ".repeat(dropped);
        format!("41 42 00 64 65 bad:66 {dropped} 66 0D {stays} ")
    });
    let errors = format!("idle:300 66 0D {stays} {}", errors.collect::<String>());
    let (late, kept) = ("2E*70 41 42 00 64 65 bad:66", "KEPT 41 42 00 64 65 2E*70");
    for (milliseconds, held, after, warning) in [
        // The handlers are held off until all these symbols have arrived, so the driver notices the error late.
        (1_900, late, &*errors, "WARN  Framing"),
        // The last 70 bytes do not fit into the driver's buffer. A pause of 2.6 ms follows, which is long enough to
        // parse all kept bytes, and too short to count as an idle line.
        (1_400, kept, "idle:300 66 0D", "WARN  Overrun"),
        // 10 ms of silence end the incomplete frame.
        (1_400, "41 42 00 64 65", "idle:1152 66 0D", ""),
    ] {
        each(
            milliseconds,
            |example, board| {
                let start = send(board, &format!("{GO_LIVE} idle:1152"));
                // The UARTE's FIFO and the driver's buffer keep 7 bytes with RTIC, and 256 + 6 bytes with Embassy.
                let is_rtic = example == "framelock-rtic";
                let kept = if is_rtic { "2E*2" } else { "2E*257" };
                let end = send(board, &held.replace("KEPT", kept));
                board.hold_off(start, end - start);
                send(board, &format!("{after} {stays}"));
            },
            |log| {
                log.assert_stays_live();
                assert!(log.says(warning), "{warning}");
            },
        );
    }
}

/// After an overrun, and after a bad byte, frames are received even without a pause.
#[test]
fn frames_behind_an_error_come_out() {
    each(
        1_300,
        |_, board| {
            let lost = send(board, "2E*400");
            board.hold_off(board.now(), lost - board.now());
            send(board, &format!("frame:118,119,120 bad:41 {GO_LIVE}"));
        },
        |log| assert!(log.says(LIVE) && log.says("WARN  Framing")),
    );
}

/// The payload of the frame `41 42 00 0D 41 42 0D` looks like the end of a frame and the beginning of another one. If
/// the first byte of a stream of such frames is lost, the receiver finds frames at the wrong place until a pause.
#[test]
fn an_ambiguous_payload_is_right_after_one_pause() {
    each(
        1_400,
        |_, board| {
            // 143 frames without the first byte, then 10 ms of silence.
            send(board, "42 00 0D 41 42 0D frame:13,65,66*142 idle:1152");
            send(board, "frame:13,65,66*2000");
        },
        |log| {
            assert!(log.says("axes: [13, 65, 66], phase: Live"));
            // Only the wrong frames have a demand of 0 on the third axis.
            let mut live = log.0.iter().filter(|line| line.contains("phase: Live"));
            assert!(live.all(|line| line.contains("[13, 65, 66]")), "{log:?}");
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
