//! Interrupt handlers that come late: up to 250 us nothing is lost; beyond that losses are counted,
//! and nothing wrong is committed.

use crate::firmware::{Firmware, Setpoint, frame, is_some_of, setpoints};
use nrf52840_emulator::{Assumptions, MICROSECOND, MILLISECOND};

/// Bytes of a half of the receive buffer at 1 Mbaud; cycles of a byte.
const HALF: u64 = 128;
const BYTE: u64 = 640;

/// At 1 Mbaud, back to back, with the processor taken away at that time.
fn flood(frames: u32, from: u64, cycles: u64) -> (Firmware, Vec<Setpoint>, Vec<Setpoint>) {
    let mut firmware = Firmware::booted("megabaud");
    let sent: Vec<_> = setpoints(frames).collect();
    let bytes: Vec<u8> = sent.iter().copied().flat_map(frame).collect();
    let now = firmware.board.now();
    firmware.board.hold_off(now + from, cycles);
    firmware.send_and_wait(&bytes, 3 * MILLISECOND);
    let commits = firmware.commits();
    (firmware, sent, commits)
}

#[test]
fn up_to_250_us_nothing_is_lost_wherever_they_begin() {
    for length in [10, 50, 120, 200, 250] {
        for from in (0..1_400).step_by(83) {
            let (firmware, sent, commits) = flood(250, from * MICROSECOND, length * MICROSECOND);
            assert_eq!(commits, sent, "{length} us from {from} us on");
            assert_eq!(firmware.losses(), (0, 0));
        }
    }
}

/// The handler may begin at any phase of a byte, also between RXDRDY and the byte's being stored.
#[test]
fn at_any_phase_of_a_byte_nothing_is_lost() {
    for phase in (0..640).step_by(5) {
        let (firmware, sent, commits) = flood(60, 36 * 640 + phase, 250 * MICROSECOND);
        assert_eq!(commits, sent, "phase {phase}");
        assert_eq!(firmware.losses(), (0, 0));
    }
}

/// The line falls silent, and the handler that is to look comes when bytes arrive again: one that
/// has been counted may still be on its way to memory, and what lies there is older.
#[test]
fn a_byte_on_its_way_to_memory_is_not_taken_yet() {
    for end in (0..480).step_by(4) {
        let mut firmware = Firmware::booted("megabaud");
        // The specification does not say how long the way is: a long one shows more.
        firmware.assume(|all| all.dma_lag = 500);
        // The buffer is full of terminators; then six bytes of a frame, and silence.
        firmware.send_and_wait(&[b'\r'; 256], 100 * MICROSECOND);
        let silent_from = firmware.board.send(&frame([1, 2, 3])[..6]);
        firmware.board.hold_off(silent_from, 58 * 640 + 300 + end);
        firmware.board.run_until(silent_from + 58 * 640).unwrap();
        // While handlers are held off, one more byte, which is no terminator.
        firmware.send_and_wait(b"x", MILLISECOND);
        assert!(firmware.commits().is_empty(), "until {end}");
    }
}

/// The last moment at which the next half can be named, in small steps: around the end of a half, for
/// hold-offs that end there. The full half is parsed before its place is given to the UARTE.
#[test]
fn at_the_last_moment_it_is_in_time_or_counted_and_never_wrong() {
    let mut in_time = 0;
    let begin = (HALF - 4) * BYTE;
    let last = 2 * HALF * BYTE;
    for end in (last - 4_000..last + 900).step_by(25) {
        let (firmware, sent, commits) = flood(60, begin, end - begin);
        let (late, skipped) = firmware.losses();
        if late == 0 && skipped == 0 {
            in_time += 1;
            assert_eq!(commits, sent, "until {end}");
        } else {
            assert!(is_some_of(&commits, &sent), "until {end}");
        }
    }
    assert!(
        in_time > 10 && in_time < 186,
        "both must be seen: {in_time}"
    );
}

#[test]
fn beyond_that_losses_are_counted_and_nothing_wrong_is_put_in_force() {
    for length in (300..6_000).step_by(171) {
        let (firmware, sent, commits) = flood(1_200, 1_000 * 64, length * MICROSECOND);
        assert!(is_some_of(&commits, &sent), "{length} us");
        let (late, skipped) = firmware.losses();
        if commits.len() < sent.len() {
            assert!(late > 0 && skipped > 0, "silent loss at {length} us");
        }
        assert!(commits.len() > 200, "{length} us: it goes on afterwards");
        let Assumptions {
            lost_timeout,
            lost_flush_end,
            lost_empty_flush_end,
            ..
        } = firmware.assumptions;
        if lost_timeout > 0 || lost_flush_end > 0 || lost_empty_flush_end {
            // What came until the UARTE was switched off and on was not heard.
            continue;
        }
        // While the UARTE is started anew, it hears nothing.
        let accounted = firmware.counter("bytes") + skipped;
        assert!(
            (8_350..=8_400).contains(&accounted),
            "{length} us: {accounted}"
        );
    }
}
