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
    /// Number of changes of the setpoint.
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

/// Returns the numbers in the last but one column of the report's row with this text: the measured values.
fn answer(outcome: &Outcome, question: &str) -> Vec<u32> {
    let mut lines = outcome.log.iter();
    let line = lines.find(|line| line.contains(question)).unwrap();
    let answer = line.rsplit(" | ").nth(1).unwrap();
    let numbers = answer.split(|letter: char| !letter.is_ascii_digit());
    numbers.filter_map(|number| number.parse().ok()).collect()
}

/// Returns whether the report says NOT FINE in a row with this text.
fn is_not_fine(outcome: &Outcome, part: &str) -> bool {
    let mut lines = outcome.log.iter();
    lines.any(|line| line.contains(part) && line.ends_with("| NOT FINE"))
}

/// On each commit, the test runs on one chip that combines many deviations. The nightly stage also runs it on chips
/// with a single deviation.
#[test]
fn under_each_assumption_it_says_what_this_chip_does() {
    let together = Assumptions {
        end_lag: 60,
        fifo: 5,
        overrun_drops_oldest: true,
        overrun_at_start_bit: true,
        any_write_clears: true,
        causeless_timeout: true,
        bits_to_timeout: 100,
        timeout_counts_parity: true,
        flush_is_silent: true,
        start_cuts_period: true,
        ..Assumptions::default()
    };
    let all = [("together", together)]
        .into_iter()
        .chain(Assumptions::each());
    for (name, chip) in sample(all, usize::MAX) {
        let outcome = self_test("self-test-megabaud", chip, true, &[("MILLISECONDS", 60)]);
        let log = &outcome.log;
        // The first byte, which checks the wire, loses its ENDRX.
        if name == "lost_end" {
            assert_eq!(outcome.finished, 2, "{name}: {log:#?}");
            continue;
        }
        assert_eq!(outcome.finished, 1, "{name}: {log:#?}");
        let deviates = chip.stop_is_ignored || chip.bits_to_timeout != 50;
        let mut not_fine = log.iter().filter(|line| line.contains("NOT FINE"));
        let is_only = not_fine.all(|line| deviates && line.contains(" STOPRX to RXTO | "));
        assert!(is_only, "{name}: {log:#?}");
        let sent = u32::try_from(outcome.commits).unwrap();
        assert!(sent > 700, "{name}");
        let yes = |is_so: bool, value: u32| value * u32::from(is_so);
        let shown = yes(!chip.any_write_clears, 1);
        for (question, expected) in [
            ("3 of 5 bytes", vec![5, 5]),
            ("4 of 16 bad", vec![16, 0]),
            (
                "5 of 16 overruns",
                vec![
                    16,
                    u32::try_from(chip.fifo).unwrap(),
                    yes(chip.overrun_drops_oldest, 16),
                ],
            ),
            ("6 ERROR", vec![2, 12]),
            ("13 ERRORSRC", vec![12 * shown, 8 * shown, 0]),
            ("14 of 16 second", vec![0, 32]),
            ("20 of 3 FLUSHRX", vec![3, yes(!chip.flush_is_silent, 3)]),
            ("2 frames", vec![sent, sent, 0]),
        ] {
            let answer = answer(&outcome, question);
            assert!(answer.starts_with(&expected), "{name}: {log:#?}");
        }
        assert_eq!(
            answer(&outcome, "10 from")[1],
            yes(chip.start_cuts_period, 1)
        );
        let stops = answer(&outcome, "15 cycles");
        assert_eq!(stops[3], yes(chip.causeless_timeout, 16), "{name}");
        // These times are some cycles off, because the self-test polls.
        let timeout = |bits: u64| {
            if chip.stop_is_ignored {
                u64::from(u32::MAX)
            } else {
                64 * bits
            }
        };
        let bits = chip.bits_to_timeout;
        let with_parity = bits + u64::from(chip.timeout_counts_parity) * bits / 10;
        for (answer, cycles) in [
            (stops[0], timeout(bits)),
            (stops[1], timeout(bits)),
            (stops[2], timeout(with_parity)),
            (answer(&outcome, "18 cycles")[0], chip.end_lag),
            (
                answer(&outcome, "19 cycles")[0],
                if chip.overrun_at_start_bit { 640 } else { 32 },
            ),
        ] {
            assert!(
                u64::from(answer).abs_diff(cycles) < 40,
                "{name}: {answer}, {cycles}"
            );
        }
    }
}

/// If the chip violates one of the firmware's assumptions, the self-test reports it. Row 17 is not fine on any chip
/// here, because the test sets `BOUND` to 0.
#[test]
fn a_chip_that_does_less_is_not_fine() {
    type Change = fn(&mut Assumptions);
    let cases: [(Change, &[&str]); 6] = [
        (|a| a.start_lag = 300, &["3 of 5 bytes"]),
        (|a| a.fifo = 3, &["3 of 5 bytes", "5 of 16 overruns"]),
        (
            |a| a.slowness = 1_300,
            &["9 cycles of the", "2 frames sent"],
        ),
        (|a| a.bits_to_timeout = 20, &["15 cycles from STOPRX"]),
        (|a| a.end_lag = 200, &["18 cycles from a byte"]),
        (|_| {}, &["17 units that an output moves"]),
    ];
    let words = [("MILLISECONDS", 60), ("BOUND", 0)];
    for (change, parts) in cases {
        let chip = Assumptions::default().with(change);
        let outcome = self_test("self-test-megabaud", chip, true, &words);
        for part in parts {
            assert!(is_not_fine(&outcome, part), "{:#?}", outcome.log);
        }
    }
}

/// The self-test starts with a running watchdog, as if it had been flashed over the firmware. UICR allows the self-test
/// to open the debug port.
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

/// `FRAMELOCK_WRITE_FIGURES=1 cargo xtask verify --only emulated` rewrites the report in the guide. The numbers may
/// differ if another compiler than that of `FIGURES.txt` built the image.
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
