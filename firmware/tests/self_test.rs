//! Tests of the self-test. Its table must describe the emulated chip correctly, under every
//! assumption.

use std::fs;
use std::path::Path;

use nrf52840_emulator::{Assumptions, Board, LogTable, MILLISECOND, ResetCause};

use crate::figures::compiler;
use crate::firmware::{NVMC_CONFIG, UICR, image, image_file};

/// The pins that the wire connects: P1.01 and P1.02.
const WIRE: [u32; 2] = [33, 34];
/// How often the self-test repeats each of the shorter tests.
const TIMES: u32 = 16;

/// The results of the self-test.
struct Outcome {
    finished: u32,
    /// The rows of the self-test's answers.
    answers: [[u32; 3]; 12],
    /// How often the setpoint changed.
    commits: usize,
    log: Vec<String>,
}

/// The fewest and the most bytes that were stored in order in one repetition, and the cycles until the slowest waiting
/// byte was stored.
const WAITING: usize = 0;
/// How many bad stop bits ERRORSRC showed before the next byte was stored, and how many bad bytes were stored.
const BAD_STOP_BITS: usize = 1;
/// How many overruns ERRORSRC showed, how many bytes waited in the last repetition, and how often the oldest waiting
/// byte was lost.
const OVERRUNS: usize = 2;
/// How often ERROR came in a long break, and the causes that ERRORSRC showed after the break.
const LONG_BREAK: usize = 3;
/// The parser's cycles for a byte, with and without the cache.
const CYCLES: usize = 4;
/// How many frames were sent, how many were committed, and how many overruns there were.
const FRAMES: usize = 5;
/// Microseconds from SEQSTART to the period's end, and whether SEQSTART began a period.
const PERIOD: usize = 6;
/// The values of ERRORSRC after each of three writes.
const CLEARING: usize = 7;
/// How many transfers a second STARTRX ended, and how many bytes were stored in total after these tasks.
const SECOND_START: usize = 8;
/// Cycles until RXTO with and without an open transfer, and how often RXTO came without STOPRX.
const STOPPING: usize = 9;
/// The cycles of the worst handler.
const HANDLER: usize = 10;
/// The most units by which an output may move between two polls, the most by which one moved, and the lowest output.
const OUTPUTS: usize = 11;

fn self_test(image_name: &str, assumptions: Assumptions, is_wired: bool) -> Outcome {
    self_test_with(image_name, assumptions, is_wired, [("MILLISECONDS", 60)])
}

/// Runs the self-test with other values of these words.
fn self_test_with<const N: usize>(
    image_name: &str,
    assumptions: Assumptions,
    is_wired: bool,
    words: [(&str, u32); N],
) -> Outcome {
    let mut board = Board::new(image(image_name)).unwrap();
    board.assume(assumptions.with(|a| a.start_twice_is_ignored = true));
    board.wire_line_to(WIRE[1]);
    if is_wired {
        board.wire_loopback(WIRE[0]);
    }
    let setpoint = board.watch("SETPOINT").unwrap();
    board.run_for(MILLISECOND).unwrap();
    for (name, value) in words {
        let word = board.image().symbol(name).unwrap().address;
        board.patch(word, &value.to_le_bytes()).unwrap();
    }
    let mut log = Vec::new();
    let mut finished = 0;
    for _ in 0..500 {
        board.run_for(10 * MILLISECOND).unwrap();
        log.extend(board.take_rtt(0));
        if finished != 0 {
            break;
        }
        finished = board.word("FINISHED").unwrap();
    }
    let at = board.image().symbol("ANSWERS").unwrap().address;
    let word = |n: u32| board.memory().word(at + 4 * n).unwrap();
    let answers = std::array::from_fn(|row| {
        let first = 3 * u32::try_from(row).unwrap();
        [0, 1, 2].map(|n| word(first + n))
    });
    let table = LogTable::parse(&image_file(image_name)).unwrap();
    let changes = board.trace().changes.iter();
    Outcome {
        finished,
        answers,
        commits: changes.filter(|change| change.watch == setpoint).count(),
        log: table.decoder().lines(&log),
    }
}

/// Asserts the answers on which the emulated chip never deviates.
fn assert_answers_as_specified(Outcome { answers, .. }: &Outcome, what: &str) {
    assert_eq!(answers[WAITING][..2], [5, 5], "{what}");
    assert_eq!(answers[BAD_STOP_BITS][..2], [TIMES, 0], "{what}");
    assert_eq!(answers[SECOND_START][..2], [0, 2 * TIMES], "{what}");
    let [with, without, _] = answers[CYCLES];
    assert_eq!(with, without, "{what}");
}

/// Returns whether the log has a line with this text and this result.
fn says(outcome: &Outcome, part: &str, verdict: &str) -> bool {
    let mut lines = outcome.log.iter();
    lines.any(|line| line.contains(part) && line.ends_with(&format!("| {verdict}")))
}

#[test]
fn as_the_specification_has_it_all_is_fine_at_both_rates() {
    for (image, sent) in [("self-test", 80), ("self-test-megabaud", 800)] {
        let outcome = self_test(image, Assumptions::default(), true);
        assert_eq!(outcome.finished, 1, "{:#?}", outcome.log);
        assert_answers_as_specified(&outcome, image);
        let answers = &outcome.answers;
        assert_eq!(answers[OVERRUNS], [TIMES, 6, 0]);
        // The value 12 means framing and break.
        assert_eq!(answers[LONG_BREAK][..2], [2, 12]);
        assert_eq!(answers[PERIOD][1], 0);
        assert_eq!(answers[CLEARING], [12, 8, 0]);
        let [open, ended, without] = answers[STOPPING];
        // 3200 cycles are the duration of five bytes at 1 Mbaud.
        assert!(open.abs_diff(3_200) < 100 && ended.abs_diff(3_200) < 100);
        assert_eq!(without, 0);
        assert!((10..=30).contains(&answers[CYCLES][0]));
        assert_eq!(answers[FRAMES], [sent, sent, 0]);
        assert!((250..=300).contains(&answers[HANDLER][0]));
        // In the first second, an output moves at most half a unit between two polls, rounded up.
        assert_eq!(answers[OUTPUTS][..2], [6, 1]);
        assert_eq!(outcome.commits, sent as usize);
        for (number, parts) in [
            ("9", format!("{} with the cache", answers[CYCLES][0])),
            ("3", "5 to 5, within".to_owned()),
            ("4", "16 shown, 0 stored".to_owned()),
            ("5", "16 shown, 6 wait, the oldest lost 0 times".to_owned()),
            ("6", "2; ERRORSRC 12".to_owned()),
            ("10", format!("{} us, 0", answers[PERIOD][0])),
            ("13", "12, 8, 0".to_owned()),
            ("14", "0 end it, 32 stored".to_owned()),
            ("15", format!("{open} open, {ended} ended, 0 with ENDRX")),
            ("2", format!("{sent} sent, {sent} committed, 0 overruns")),
            ("16", format!("| {} ", answers[HANDLER][0])),
            ("17", format!("1, between {} and ", answers[OUTPUTS][2])),
        ] {
            assert!(
                says(&outcome, &parts, "fine"),
                "{number}: {:#?}",
                outcome.log
            );
        }
    }
}

#[test]
#[ignore = "takes half a minute"]
fn under_each_assumption_it_says_what_this_chip_does() {
    for (name, assumptions) in Assumptions::each() {
        let outcome = self_test("self-test-megabaud", assumptions, true);
        let log = &outcome.log;
        // The first byte, which checks the wire, loses its ENDRX.
        if name == "lost_end" {
            assert_eq!(outcome.finished, 2, "{name}: {log:#?}");
            continue;
        }
        assert_eq!(outcome.finished, 1, "{name}: {log:#?}");
        assert_answers_as_specified(&outcome, name);
        let answers = &outcome.answers;
        let oldest = TIMES * u32::from(assumptions.overrun_drops_oldest);
        let waiting = u32::try_from(assumptions.fifo).unwrap();
        assert_eq!(answers[OVERRUNS], [TIMES, waiting, oldest], "{name}");
        assert_eq!(answers[PERIOD][1], u32::from(assumptions.start_cuts_period));
        let left = if assumptions.any_write_clears {
            [0; 3]
        } else {
            [12, 8, 0]
        };
        assert_eq!(answers[CLEARING], left, "{name}");
        let without = TIMES * u32::from(assumptions.causeless_timeout);
        assert_eq!(answers[STOPPING][2], without, "{name}");
        assert!((answers[CYCLES][0] > 30) == (assumptions.slowness > 120));
        let [sent, commits, overruns] = answers[FRAMES];
        assert_eq!(outcome.commits, commits as usize, "{name}");
        let part = format!("{sent} sent, {commits} committed, {overruns} overruns");
        let is_fine = commits == sent && overruns == 0;
        let verdict = if is_fine { "fine" } else { "NOT FINE" };
        assert!(says(&outcome, &part, verdict), "{name}: {log:#?}");
        assert!(is_fine, "{name}: {log:#?}");
    }
}

/// The self-test finds out how the chip behaves where the specification is silent.
#[test]
fn what_an_overrun_drops_and_what_seqstart_does_it_says() {
    for open in [false, true] {
        let assumptions = Assumptions::default().with(|a| {
            a.overrun_drops_oldest = open;
            a.start_cuts_period = open;
        });
        let outcome = self_test("self-test-megabaud", assumptions, true);
        let oldest = TIMES * u32::from(open);
        assert_eq!(outcome.answers[OVERRUNS], [TIMES, 6, oldest]);
        let [started, at_once, _] = outcome.answers[PERIOD];
        let expected = if open { 20_000 } else { 10_000 };
        assert!(started.abs_diff(expected) < 100, "{started}");
        assert_eq!(at_once, u32::from(open));
    }
}

/// If the chip violates one of the firmware's assumptions, the self-test reports it.
#[test]
fn a_chip_that_does_less_is_not_fine() {
    let usual = Assumptions::default();
    for (assumptions, parts) in [
        (usual.with(|a| a.start_lag = 300), &["3 of 5 bytes"][..]),
        (
            usual.with(|a| a.fifo = 3),
            &["3 of 5 bytes", "5 of 16 overruns"],
        ),
        (
            usual.with(|a| a.slowness = 1_300),
            &["9 cycles of the parser", "2 frames sent"],
        ),
        (
            usual.with(|a| a.lost_timeout = 1),
            &["15 cycles from STOPRX"],
        ),
    ] {
        let outcome = self_test("self-test-megabaud", assumptions, true);
        for part in parts {
            assert!(says(&outcome, part, "NOT FINE"), "{:#?}", outcome.log);
        }
    }
}

/// The self-test starts with a running watchdog, as if it had been flashed over the firmware. UICR allows it to open
/// the debug port.
#[test]
fn it_keeps_the_debug_port_open_and_sees_the_firmwares_watchdog_off() {
    let mut board = Board::new(image("self-test")).unwrap();
    board.set_register(NVMC_CONFIG, 1).unwrap();
    for (word, value) in UICR {
        board.set_register(word, value).unwrap();
    }
    board.set_register(NVMC_CONFIG, 0).unwrap();
    let (start, reload_value, running) = (0x4001_0000, 0x4001_0504, 0x4001_0400);
    board.set_register(reload_value, 8_192).unwrap();
    board.set_register(start, 1).unwrap();
    board.run_for(400 * MILLISECOND).unwrap();
    assert_eq!(board.register(running).unwrap(), 0);
    let resets: Vec<_> = board.trace().resets.iter().map(|it| it.cause).collect();
    assert_eq!(resets, [ResetCause::Watchdog]);
    assert!(board.debug_port_is_open());
    // The state 2 means that the wire is missing.
    assert_eq!(board.word("FINISHED").unwrap(), 2);
}

#[test]
fn without_a_wire_it_says_so() {
    let outcome = self_test("self-test", Assumptions::default(), false);
    assert_eq!(outcome.finished, 2);
    let last = outcome.log.last().unwrap();
    assert!(last.contains("is P1.01 wired to P1.02?"), "{last}");
}

/// The report in a log, without the prefix of each line.
fn report(log: &[String]) -> String {
    let prefix = log[0].find("---").unwrap();
    let lines: Vec<&str> = log.iter().map(|line| &line[prefix..]).collect();
    lines.join("\n")
}

/// `FRAMELOCK_WRITE_FIGURES=1 cargo xtask verify --only emulated` rewrites the report in the guide. Another compiler than
/// that of the figures may give other numbers.
#[test]
fn the_guide_shows_the_emulators_report() {
    let outcome = self_test("self-test", Assumptions::default(), true);
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

/// The outputs approach the demands for a second. Then they follow jumps from one end to the other at full speed.
#[test]
#[ignore = "takes ten seconds"]
fn outputs_that_follow_jumps_keep_their_bound() {
    let words = [("MILLISECONDS", 2_000)];
    let outcome = self_test_with("self-test", Assumptions::default(), true, words);
    let [bound, step, lowest] = outcome.answers[OUTPUTS];
    assert!(
        step > 1 && step <= bound && lowest < 20,
        "{:#?}",
        outcome.log
    );
    assert!(says(&outcome, "17 units that an output moves", "fine"));
}

#[test]
fn an_output_that_exceeds_its_bound_is_not_fine() {
    let words = [("MILLISECONDS", 60), ("BOUND", 0)];
    let outcome = self_test_with("self-test", Assumptions::default(), true, words);
    assert_eq!(outcome.answers[OUTPUTS][..2], [0, 1]);
    assert!(says(&outcome, "17 units that an output moves", "NOT FINE"));
}
