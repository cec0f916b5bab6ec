//! The self-test's program: its table says what the emulated chip does, whatever is assumed of it.

use nrf52840_emulator::{Assumptions, Board, LogTable, MILLISECOND, ResetCause};

use crate::firmware::{image, image_file};

/// P1.01 and P1.02.
const WIRE: [u32; 2] = [33, 34];
/// How often a question is asked, and how often UARTE0 is stopped in all.
const TIMES: u32 = 16;
const STOPS: u32 = 1 + TIMES + 1 + 2 * TIMES;

/// What the program found out.
struct Outcome {
    finished: u32,
    /// Bytes counted at ENDRX, least and most; transfers with RXTO unasked.
    order: [u32; 3],
    /// Of bytes with a bad stop bit: errors, stored, counted.
    bad_stop_bits: [u32; 3],
    /// RXD.AMOUNT; of all stops, how many with RXTO, how many in all.
    empty_stop: [u32; 3],
    /// ENDRX of how many of all flushes, and the most cycles until it.
    empty_flush: [u32; 3],
    /// The parser's for a byte, with the cache and without.
    cycles: [u32; 2],
    /// Sent, committed, how often late.
    frames: [u32; 3],
    /// How often the setpoint changed.
    commits: usize,
    log: Vec<String>,
}

fn self_test(image_name: &str, assumptions: Assumptions, is_wired: bool) -> Outcome {
    let mut board = Board::new(image(image_name)).unwrap();
    board.assume(assumptions);
    board.wire_line_to(WIRE[1]);
    if is_wired {
        board.wire_loopback(WIRE[0]);
    }
    let setpoint = board.watch("SETPOINT").unwrap();
    board.run_for(MILLISECOND).unwrap();
    let milliseconds = board.image().symbol("MILLISECONDS").unwrap().address;
    board.patch(milliseconds, &60_u32.to_le_bytes()).unwrap();
    let mut log = Vec::new();
    let mut finished = 0;
    for _ in 0..100 {
        board.run_for(10 * MILLISECOND).unwrap();
        log.extend(board.take_rtt(0));
        if finished != 0 {
            break;
        }
        finished = board.word("FINISHED").unwrap();
    }
    let at = board.image().symbol("ANSWERS").unwrap().address;
    let word = |n: u32| board.memory().word(at + 4 * n).unwrap();
    let row = |row: u32| [0, 1, 2].map(|n| word(3 * row + n));
    let table = LogTable::parse(&image_file(image_name)).unwrap();
    Outcome {
        finished,
        order: row(0),
        bad_stop_bits: row(1),
        empty_stop: row(2),
        empty_flush: row(3),
        cycles: [word(12), word(13)],
        frames: row(5),
        log: table.decoder().lines(&log),
        commits: {
            let changes = board.trace().changes.iter();
            changes.filter(|change| change.watch == setpoint).count()
        },
    }
}

/// Whether the log has a line with this, and that verdict.
fn says(outcome: &Outcome, part: &str, verdict: &str) -> bool {
    let mut lines = outcome.log.iter();
    lines.any(|line| line.contains(part) && line.ends_with(&format!("| {verdict}")))
}

#[test]
fn as_the_specification_has_it_all_is_fine_at_both_rates() {
    for (image, half, sent) in [("self-test", 32, 80), ("self-test-megabaud", 128, 800)] {
        let outcome = self_test(image, Assumptions::default(), true);
        assert_eq!(outcome.finished, 1, "{:#?}", outcome.log);
        assert_eq!(outcome.order, [half, half, 0]);
        assert_eq!(outcome.bad_stop_bits, [TIMES, 0, 0]);
        assert_eq!(outcome.empty_stop, [0, STOPS, STOPS]);
        assert_eq!(outcome.empty_flush[..2], [STOPS, STOPS]);
        assert_eq!(outcome.frames, [sent, sent, 0]);
        assert_eq!(outcome.commits, sent as usize);
        for (number, parts) in [
            ("9", format!("{} with the cache", outcome.cycles[0])),
            ("3", format!("{half} to {half}; 0 of 16 times")),
            ("4", "16 errors, 0 stored, 0 counted".to_owned()),
            ("5", "| 0; 50 of 50 times".to_owned()),
            ("6", "| 50 of 50 times, within".to_owned()),
            ("2", format!("{sent} sent, {sent} committed, late 0 times")),
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
        let [least, most, unasked] = match name {
            "end_before_ready" | "ready_lag" => [127, 127, 0],
            "spurious_timeout" => [128, 128, TIMES],
            _ => [128, 128, 0],
        };
        assert_eq!(outcome.order, [least, most, unasked], "{name}");
        let counted = TIMES * u32::from(assumptions.ready_on_framing_error);
        assert_eq!(outcome.bad_stop_bits, [TIMES, 0, counted], "{name}");
        let amount = 5 * u32::from(assumptions.stale_amount);
        let timeouts = STOPS.saturating_sub(assumptions.lost_timeout);
        assert_eq!(outcome.empty_stop, [amount, timeouts, STOPS], "{name}");
        let ends = if assumptions.lost_empty_flush_end {
            0
        } else {
            STOPS.saturating_sub(assumptions.lost_flush_end)
        };
        assert_eq!(outcome.empty_flush[..2], [ends, STOPS], "{name}");
        let slowest = u64::from(outcome.empty_flush[2]);
        assert_eq!(slowest > 300, assumptions.slow_flush > 300, "{name}");
        let [with, without] = outcome.cycles;
        assert!(with == without && (with > 30) == (assumptions.slowness > 120));

        for (part, is_fine) in [
            (format!("| {least} to {most}; {unasked} of 16 times"), true),
            (format!("16 errors, 0 stored, {counted} counted"), true),
            (
                format!("| {amount}; {timeouts} of {STOPS} times"),
                timeouts == STOPS,
            ),
            (
                format!("| {ends} of {STOPS} times, within {slowest} cycles"),
                ends == STOPS || ends == 0,
            ),
            (format!("| {with} with the cache, {without} without"), true),
        ] {
            let verdict = if is_fine { "fine" } else { "NOT FINE" };
            assert!(says(&outcome, &part, verdict), "{name}: {:#?}", outcome.log);
        }
        let [sent, commits, late] = outcome.frames;
        assert_eq!(outcome.commits, commits as usize, "{name}");
        let part = format!("{sent} sent, {commits} committed, late {late} times");
        let is_fine = commits == sent && late == 0;
        let verdict = if is_fine { "fine" } else { "NOT FINE" };
        assert!(says(&outcome, &part, verdict), "{name}: {:#?}", outcome.log);
        assert_eq!(outcome.finished, 1, "{name}");
    }
}

/// As after flashing it over the firmware, which leaves the watchdog running.
#[test]
fn it_keeps_the_debug_port_open_and_sees_the_firmwares_watchdog_off() {
    let mut board = Board::new(image("self-test")).unwrap();
    let (start, reload_value, running) = (0x4001_0000, 0x4001_0504, 0x4001_0400);
    board.set_register(reload_value, 8_192).unwrap();
    board.set_register(start, 1).unwrap();
    board.run_for(400 * MILLISECOND).unwrap();
    assert_eq!(board.register(running).unwrap(), 0);
    let resets: Vec<_> = board.trace().resets.iter().map(|it| it.cause).collect();
    assert_eq!(resets, [ResetCause::Soft, ResetCause::Watchdog]);
    assert!(board.debug_port_is_open());
    // There is no wire.
    assert_eq!(board.word("FINISHED").unwrap(), 2);
}

#[test]
fn without_a_wire_it_says_so() {
    let outcome = self_test("self-test", Assumptions::default(), false);
    assert_eq!(outcome.finished, 2);
    let last = outcome.log.last().unwrap();
    assert!(last.contains("is P1.01 wired to P1.02?"), "{last}");
}
