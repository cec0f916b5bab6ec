//! Tests with late interrupt handlers. As long as the UARTE's FIFO has room, nothing is lost. When it is full, losses
//! are reported, and no wrong setpoint is committed.

use crate::firmware::{self, Firmware, Setpoint, is_some_of, sample};
use nrf52840_emulator::{MICROSECOND, MILLISECOND};

/// Each entry has the image, the cycles of a byte, and two delays in microseconds. `README.md` promises that handlers
/// may be late by at least these delays without losing a byte. The FIFO holds five bytes. The first delay applies if an
/// overrun comes at the end of the byte that finds no room. The second delay applies if the overrun comes at this
/// byte's start bit.
const PROMISED: [(&str, u64, [u64; 2]); 2] =
    [("default", 5_556, [500, 430]), ("megabaud", 640, [50, 45])];

/// Sends frames back to back, and holds the firmware off for `cycles` from the cycle `from` on. Returns the
/// firmware, the sent setpoints and the committed ones.
fn flood(
    image: &str,
    at_start_bit: bool,
    frames: u32,
    from: u64,
    cycles: u64,
) -> (Firmware, Vec<Setpoint>, Vec<Setpoint>) {
    let mut firmware = Firmware::booted(image);
    firmware.assume(|all| {
        all.fifo = 5;
        all.overrun_at_start_bit |= at_start_bit;
    });
    let (sent, bytes) = firmware::frames(frames);
    let now = firmware.board.now();
    firmware.board.hold_off(now + from, cycles);
    firmware.send_and_wait(&bytes, 3 * MILLISECOND);
    let commits = firmware.commits();
    (firmware, sent, commits)
}

#[test]
fn for_as_long_as_promised_nothing_is_lost_wherever_it_begins() {
    for (image, byte, promised) in PROMISED {
        for at_start_bit in [false, true] {
            let starts = Firmware::booted(image);
            let is_less = at_start_bit || starts.assumptions.overrun_at_start_bit;
            let promised = promised[usize::from(is_less)];
            for part in 1..=4 {
                for phase in sample(0..24, 3) {
                    let (from, length) = (20 * byte + phase * byte / 8, promised * part / 4);
                    let length = length * MICROSECOND;
                    let (firmware, sent, commits) = flood(image, at_start_bit, 20, from, length);
                    assert_eq!(commits, sent, "{image}: {length} cycles from {from} on");
                    assert_eq!(firmware.losses(), (0, 0));
                }
            }
        }
    }
}

#[test]
fn beyond_that_losses_are_reported_and_nothing_wrong_is_put_in_force() {
    let (mut reported, mut count) = (0, 0);
    for (image, byte, [promised, _]) in PROMISED {
        for times in sample(1..40, 2) {
            count += 1;
            let length = promised * times / 2;
            let (firmware, sent, commits) =
                flood(image, false, 150, 7 * byte, length * MICROSECOND);
            assert!(is_some_of(&commits, &sent), "{image}: {length} us");
            let (overruns, skipped) = firmware.losses();
            if commits.len() < sent.len() {
                assert!(overruns > 0 && skipped > 0, "silent loss at {length} us");
                reported += 1;
            }
            // Only these frames may be lost: those that arrived during the delay, those that were arriving when the
            // delay began or ended, and those in the FIFO.
            let lost = (sent.len() - commits.len()) as u64;
            let most = length * MICROSECOND / (7 * byte) + 4;
            assert!(lost <= most, "{image}: {lost} frames lost by {length} us");
        }
    }
    assert!(100 * reported > 52 * count, "{reported} of {count}");
}
