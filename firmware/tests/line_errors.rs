//! A test of errors on the line (L1 in `docs/protocol.md`). Other such tests are scripts: see `line_errors.txt`. The
//! reception's decisions are proved for every order of events: see `reception/src/verification.rs`. The tests check the
//! firmware's register accesses and timing.

use crate::firmware::{Firmware, PAUSE, frame};
use nrf52840_emulator::{LineSymbol, MILLISECOND};

/// Cycles of a byte at 115 200 baud.
const BYTE: u64 = 10 * 64_000_000 / 115_200;

/// An error comes while the firmware is interrupted in the middle of a round, which is one run of the receive handler.
/// The test tries every cycle of the round. The byte after the error would complete a frame with the bytes before the
/// error.
#[test]
fn an_error_in_the_middle_of_a_round_is_seen() {
    for any_write_clears in [false, true] {
        let booted = || {
            let mut firmware = Firmware::booted("default");
            firmware.assume(|all| all.any_write_clears |= any_write_clears);
            firmware.send_and_wait(&frame([1, 2, 3])[..6], PAUSE);
            firmware
        };
        let mut firmware = booted();
        let after = firmware.board.now();
        firmware.run_for(2 * MILLISECOND);
        let mut runs = firmware.board.trace().activations.iter();
        let round = *runs
            .find(|run| run.exception == 16 + 2 && run.at > after)
            .unwrap();
        for cycle in 0..round.cycles {
            let mut firmware = booted();
            firmware.board.run_until(round.at - 100).unwrap();
            firmware.board.hold_off(round.at + cycle, 3 * BYTE);
            let error = [LineSymbol::BadStop(0xFF), LineSymbol::Byte(b'\r')];
            firmware.board.send_symbols(&error);
            firmware.run_for(5 * BYTE);
            assert!(firmware.commits().is_empty(), "in cycle {cycle}");
            firmware.takes_a_frame(PAUSE, &format!("in cycle {cycle}"));
        }
    }
}
