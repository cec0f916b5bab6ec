//! Tests of the self-test. Its report must describe the emulated chip correctly, under every
//! assumption.

use std::fs;
use std::path::Path;

use nrf52840_emulator::{Assumptions, MILLISECOND, ResetCause};

use crate::figures::compiler;
use crate::firmware::{Firmware, image_file, sample};

/// The pins that the wire connects: P1.01 and P1.02.
const WIRE: [u32; 2] = [33, 34];

/// The results of the self-test.
struct Outcome {
    finished: u32,
    /// How often the setpoint changed.
    commits: usize,
    log: Vec<String>,
}

/// Runs the self-test after setting each variable in `words` to the given value.
fn self_test(
    image: &str,
    assumptions: Assumptions,
    is_wired: bool,
    words: &[(&str, u32)],
) -> Outcome {
    let mut firmware = Firmware::at_power_on(image)
        .assuming(assumptions.with(|a| a.start_twice_is_ignored = true));
    let board = &mut firmware.board;
    board.wire_line_to(WIRE[1]);
    if is_wired {
        board.wire_loopback(WIRE[0]);
    }
    board.run_for(MILLISECOND).unwrap();
    for (name, value) in words {
        let word = board.image().symbol(name).unwrap().address;
        board.patch(word, &value.to_le_bytes()).unwrap();
    }
    let mut log = Vec::new();
    let mut finished = 0;
    for _ in 0..500 {
        board.run_for(10 * MILLISECOND).unwrap();
        log.extend(board.log());
        if finished != 0 {
            break;
        }
        finished = board.word("FINISHED").unwrap();
    }
    Outcome {
        finished,
        commits: firmware.commits().len(),
        log,
    }
}

/// Returns whether the log has a line with this text and this result.
fn says(outcome: &Outcome, part: &str, verdict: &str) -> bool {
    let mut lines = outcome.log.iter();
    lines.any(|line| line.contains(part) && line.ends_with(&format!("| {verdict}")))
}

/// At each commit, a [`sample`]: an overrun that drops the oldest byte, a SEQSTART that begins a period, and a small FIFO.
#[test]
fn under_each_assumption_it_says_what_this_chip_does() {
    let each = Assumptions::each();
    let count = each.len();
    for (name, chip) in sample(each.into_iter().cycle().skip(5).take(count), 6) {
        let outcome = self_test("self-test-megabaud", chip, true, &[("MILLISECONDS", 60)]);
        let log = &outcome.log;
        // The first byte, which checks the wire, loses its ENDRX.
        if name == "lost_end" {
            assert_eq!(outcome.finished, 2, "{name}: {log:#?}");
            continue;
        }
        assert_eq!(outcome.finished, 1, "{name}: {log:#?}");
        assert!(
            !log.iter().any(|line| line.contains("NOT FINE")),
            "{log:#?}"
        );
        let yes = |is_so: bool, value: u32| value * u32::from(is_so);
        let sent = outcome.commits;
        for part in [
            "5 to 5, within ".to_owned(),
            "16 shown, 0 stored".to_owned(),
            format!("16 shown, {} wait, ", chip.fifo),
            format!(
                "the oldest lost {} times",
                yes(chip.overrun_drops_oldest, 16)
            ),
            "2; ERRORSRC 12".to_owned(),
            format!(" us, {} ", yes(chip.start_cuts_period, 1)),
            (if chip.any_write_clears {
                "| 0, 0, 0 |"
            } else {
                "| 12, 8, 0 |"
            })
            .to_owned(),
            "0 end it, 32 stored".to_owned(),
            format!(" ended, {} with ENDRX", yes(chip.causeless_timeout, 16)),
            format!("{sent} sent, {sent} committed, 0 overruns"),
        ] {
            assert!(says(&outcome, &part, "fine"), "{name}: {part}: {log:#?}");
        }
        assert!(sent > 700, "{name}");
    }
}

/// If the chip violates one of the firmware's assumptions, the self-test reports it.
#[test]
fn a_chip_that_does_less_is_not_fine() {
    type Change = fn(&mut Assumptions);
    let cases: [(Change, (&str, u32), &[&str]); 5] = [
        (
            |a| a.start_lag = 300,
            ("MILLISECONDS", 60),
            &["3 of 5 bytes"],
        ),
        (
            |a| a.fifo = 3,
            ("MILLISECONDS", 60),
            &["3 of 5 bytes", "5 of 16 overruns"],
        ),
        (
            |a| a.slowness = 1_300,
            ("MILLISECONDS", 60),
            &["9 cycles of the", "2 frames sent"],
        ),
        (
            |a| a.lost_timeout = 1,
            ("MILLISECONDS", 60),
            &["15 cycles from STOPRX"],
        ),
        (|_| {}, ("BOUND", 0), &["17 units that an output moves"]),
    ];
    for (change, word, parts) in cases {
        let chip = Assumptions::default().with(change);
        let words = [("MILLISECONDS", 60), word];
        let outcome = self_test("self-test-megabaud", chip, true, &words);
        for part in parts {
            assert!(says(&outcome, part, "NOT FINE"), "{:#?}", outcome.log);
        }
    }
}

/// The self-test starts with a running watchdog, as if it had been flashed over the firmware. UICR allows it to open
/// the debug port.
#[test]
fn it_keeps_the_debug_port_open_and_sees_the_firmwares_watchdog_off() {
    let mut firmware = Firmware::at_power_on("self-test");
    let (start, reload_value, running) = (0x4001_0000, 0x4001_0504, 0x4001_0400);
    for (register, value) in [(reload_value, 8_192), (start, 1)] {
        firmware.board.set_register(register, value).unwrap();
    }
    firmware.run_for(400 * MILLISECOND);
    assert_eq!(firmware.board.register(running).unwrap(), 0);
    assert_eq!(firmware.resets(), [ResetCause::Watchdog]);
    assert!(firmware.board.debug_port_is_open());
    // The state 2 means that the wire is missing.
    assert_eq!(firmware.board.word("FINISHED").unwrap(), 2);
    let log = firmware.board.log();
    assert!(
        log.last().unwrap().contains("is P1.01 wired to P1.02?"),
        "{log:#?}"
    );
}

/// Returns the report in a log, without the prefix of each line.
fn report(log: &[String]) -> String {
    let prefix = log[0].find("---").unwrap();
    let lines: Vec<&str> = log.iter().map(|line| &line[prefix..]).collect();
    lines.join("\n")
}

/// `FRAMELOCK_WRITE_FIGURES=1 cargo xtask verify --only emulated` rewrites the report in the guide. Another compiler than
/// that of the figures may give other numbers.
#[test]
fn the_guide_shows_the_emulators_report() {
    let chip = Assumptions::default();
    let outcome = self_test("self-test", chip, true, &[("MILLISECONDS", 60)]);
    assert_eq!(outcome.commits, 80, "{:#?}", outcome.log);
    let report = report(&outcome.log);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let guide = root.join("docs/board.md");
    let page = fs::read_to_string(&guide).unwrap();
    let start = page.find("--- framelock board report ---").unwrap();
    let end = start + page[start..].find("\n```").unwrap();
    if std::env::var_os("FRAMELOCK_WRITE_FIGURES").is_some() {
        fs::write(&guide, [&page[..start], &report, &page[end..]].concat()).unwrap();
        return;
    }
    let figures = fs::read_to_string(root.join("firmware/FIGURES.txt")).unwrap();
    if figures.contains(&compiler(&image_file("self-test"))) {
        assert_eq!(report, page[start..end]);
    } else {
        let text = |report: &str| report.replace(char::is_numeric, "");
        assert_eq!(text(&report), text(&page[start..end]));
    }
}
