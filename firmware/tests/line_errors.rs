//! Errors on the line: each is counted, and no frame reaches across one (L1).

use crate::firmware::{Firmware, PAUSE, RESTART, Setpoint, frame, setpoints};
use nrf52840_emulator::{LineSymbol, MILLISECOND, Parity};

/// What the specification leaves open: whether a byte that is not stored is counted.
const EITHER: [bool; 2] = [false, true];

/// Cycles of a byte at 115 200 baud.
const BYTE: u64 = 10 * 64_000_000 / 115_200;

fn booted(counted: bool) -> Firmware {
    let mut firmware = Firmware::booted("default");
    firmware.assume(|all| {
        all.ready_on_framing_error = counted;
        all.ready_on_overrun = counted;
    });
    firmware
}

fn symbols(bytes: &[u8]) -> impl Iterator<Item = LineSymbol> {
    bytes.iter().copied().map(LineSymbol::Byte)
}

#[test]
fn no_frame_reaches_across_a_byte_that_was_lost_to_an_error() {
    for counted in EITHER {
        for error in [LineSymbol::BadStop(b'x'), LineSymbol::Break(15)] {
            for place in 1..7 {
                let mut firmware = booted(counted);
                let bytes = frame([1, 2, 3]);
                let mut sent: Vec<_> = symbols(&bytes[..place]).collect();
                sent.push(error);
                sent.extend(symbols(&bytes[place..]));
                let end = firmware.board.send_symbols(&sent);
                firmware.board.run_until(end + RESTART).unwrap();
                assert!(firmware.commits().is_empty(), "{error:?} at {place}");
                assert_eq!(firmware.counter("framing"), 1, "{error:?} at {place}");
                let breaks = u32::from(matches!(error, LineSymbol::Break(_)));
                assert_eq!(firmware.counter("line_break"), breaks);

                // The error is over: the next frame is taken, and the next error is counted.
                firmware.send_and_wait(&frame([4, 5, 6]), RESTART);
                assert_eq!(firmware.commits(), [[4, 5, 6]], "{error:?} at {place}");
                let end = firmware.board.send_symbols(&[LineSymbol::Idle(3), error]);
                firmware.board.run_until(end + RESTART).unwrap();
                assert_eq!(firmware.counter("framing"), 2, "{error:?} at {place}");
            }
        }
    }
}

#[test]
fn each_cause_is_counted_once() {
    let mut firmware = booted(false);
    for n in 1..=3 {
        let end = firmware.board.send_symbols(&[LineSymbol::Break(15)]);
        firmware.board.run_until(end + RESTART).unwrap();
        assert_eq!(firmware.counter("line_break"), n);
        let end = firmware.board.send_symbols(&[LineSymbol::BadStop(b'x')]);
        firmware.board.run_until(end + RESTART).unwrap();
        // A break is a framing error too.
        assert_eq!(firmware.counter("framing"), 2 * n);
        assert_eq!(firmware.counter("line_break"), n);
    }
}

/// An error costs the frame that it hits, also in the middle of a flood, wherever it falls in the
/// receive buffer.
#[test]
fn an_error_in_a_flood_costs_one_frame() {
    for counted in EITHER {
        for hit in 40..80 {
            let mut firmware = booted(counted);
            let sent: Vec<_> = setpoints(40).collect();
            let mut line: Vec<LineSymbol> = sent
                .iter()
                .copied()
                .flat_map(frame)
                .map(LineSymbol::Byte)
                .collect();
            line[hit] = LineSymbol::BadStop(0xFF);
            let end = firmware.board.send_symbols(&line);
            // The last byte before a silence is taken when it is certain that it is none.
            firmware.board.run_until(end + RESTART).unwrap();
            let expected: Vec<Setpoint> = sent
                .iter()
                .enumerate()
                .filter(|(n, _)| *n != hit / 7)
                .map(|(_, setpoint)| *setpoint)
                .collect();
            assert_eq!(
                firmware.commits(),
                expected,
                "byte {hit}, counted {counted}"
            );
            assert_eq!(firmware.counter("framing"), 1);
            assert_eq!(firmware.counter("late"), 0);
        }
    }
}

/// Stale bytes lie behind those that were received: were one taken for received because an error
/// was counted as a byte, an old terminator would complete a frame.
#[test]
fn bytes_that_were_never_stored_are_never_taken() {
    for counted in EITHER {
        let mut firmware = booted(counted);
        // The buffer's halves are full of frames' ends.
        firmware.send_and_wait(&[b'\r'; 64], PAUSE);
        // In front of what could be one byte too many, and behind it.
        for place in [0, 6] {
            let mut sent: Vec<_> = symbols(&frame([7, 8, 9])[..6]).collect();
            sent.insert(place, LineSymbol::BadStop(0));
            let end = firmware.board.send_symbols(&sent);
            firmware.board.run_until(end + RESTART).unwrap();
            assert!(firmware.commits().is_empty(), "counted {counted}");
        }
    }
}

/// After an error the UARTE is started anew, but only when the line has been silent for so long that no
/// frame is cut.
#[test]
fn traffic_soon_after_an_error_loses_nothing() {
    for counted in EITHER {
        for early_end in EITHER {
            for idle in (10..170).step_by(4) {
                let mut firmware = booted(counted);
                firmware.assume(|all| all.early_end = early_end);
                let sent: Vec<_> = setpoints(13).collect();
                let mut line: Vec<_> = symbols(&frame(sent[0])).collect();
                line.extend([LineSymbol::BadStop(0xFF), LineSymbol::Idle(idle)]);
                line.extend(
                    sent[1..]
                        .iter()
                        .flat_map(|one| frame(*one))
                        .map(LineSymbol::Byte),
                );
                let end = firmware.board.send_symbols(&line);
                firmware.board.run_until(end + RESTART).unwrap();
                let commits = firmware.commits();
                let what = format!("counted {counted}, early end {early_end}, {idle} bits");
                assert_eq!(commits, sent, "{what}");
            }
        }
    }
}

/// Nothing is stored between the start and the error: what AMOUNT says may be of the time before.
#[test]
fn an_error_alone_replays_nothing() {
    for stale_amount in EITHER {
        for counted in EITHER {
            let mut firmware = booted(counted);
            firmware.assume(|all| all.stale_amount = stale_amount);
            // Both halves are full of frames.
            let mut bytes: Vec<u8> = setpoints(9).flat_map(frame).collect();
            bytes.push(b'x');
            firmware.send_and_wait(&bytes, RESTART);
            assert_eq!(firmware.commits().len(), 9);
            for _ in 0..3 {
                let end = firmware.board.send_symbols(&[LineSymbol::BadStop(b'x')]);
                firmware.board.run_until(end + RESTART).unwrap();
                firmware.send_and_wait(b"y", RESTART);
                assert!(firmware.commits().is_empty(), "counted {counted}");
            }
        }
    }
}

/// Handlers that come late cause none, since the UARTE goes on to the next half by itself. What
/// does is EasyDMA that is kept from RAM for longer than its FIFO lasts: then six bytes are counted
/// and not stored, and what lies in their place is older.
#[test]
fn bytes_in_front_of_an_overrun_are_not_taken() {
    for counted in EITHER {
        let mut firmware = booted(counted);
        // With it a byte that EasyDMA stores only after three byte times of silence is taken too soon:
        // see the next test for all shorter times.
        firmware.assume(|all| all.ready_at_head = false);
        // The buffer is full of terminators; then six bytes of a frame, which are stored.
        firmware.send_and_wait(&[b'\r'; 64], PAUSE);
        let stored = firmware.board.send(&frame([1, 2, 3])[..6]);
        firmware.board.run_until(stored).unwrap();
        let dma_lag = firmware.assumptions.dma_lag;
        firmware.assume(|all| all.dma_lag = MILLISECOND);
        // Six of these fill the FIFO.
        firmware.send_and_wait(b"xxxxxxx", RESTART);
        assert!(firmware.commits().is_empty(), "counted {counted}");
        assert!(firmware.counter("overrun") > 0, "counted {counted}");
        let (late, skipped) = firmware.losses();
        assert!(late == 0 && skipped > 0, "the loss is counted");

        // It is over: the next frame is taken.
        firmware.assume(|all| all.dma_lag = dma_lag);
        firmware.send_and_wait(&frame([4, 5, 6]), RESTART);
        assert_eq!(firmware.commits(), [[4, 5, 6]], "counted {counted}");
    }
}

/// A byte is stored before the line has been silent for three byte times, however RXDRDY counts it.
#[test]
fn what_is_stored_late_is_taken_when_it_is_stored() {
    for ready_at_head in EITHER {
        for lag in (0..3 * BYTE).step_by(97) {
            let mut firmware = booted(false);
            firmware.assume(|all| all.ready_at_head = ready_at_head);
            firmware.send_and_wait(&[b'\r'; 64], PAUSE);
            firmware.assume(|all| all.dma_lag = lag);
            firmware.send_and_wait(&frame([1, 2, 3])[..6], PAUSE);
            firmware.send_and_wait(b"x", PAUSE);
            assert!(firmware.commits().is_empty(), "{ready_at_head}, {lag}");
            firmware.send_and_wait(&frame([4, 5, 6]), PAUSE);
            assert_eq!(firmware.commits(), [[4, 5, 6]], "{ready_at_head}, {lag}");
        }
    }
}

/// The UARTE is set to 8N1, where nothing raises the cause "parity": there is no such bit to be
/// wrong. A sender that has one makes framing errors, wherever the bit is low.
#[test]
fn a_sender_with_a_parity_bit_makes_framing_errors_and_moves_nothing() {
    let mut firmware = booted(false);
    firmware.board.line(|line| line.set_parity(Parity::Even));
    let bytes: Vec<u8> = setpoints(60).flat_map(frame).collect();
    firmware.send_and_wait(&bytes, 3 * MILLISECOND);
    assert!(firmware.commits().is_empty());
    assert!(firmware.counter("framing") > 0);
    assert_eq!(firmware.counter("parity"), 0);
    assert!(firmware.leds()[2], "LED3, failsafe");
}

#[test]
fn a_gap_ends_the_frame_under_way() {
    let mut firmware = booted(false);
    firmware.send_and_wait(&frame([1, 2, 3])[..4], RESTART);
    firmware.send_and_wait(&frame([1, 2, 3])[4..], RESTART);
    assert!(firmware.commits().is_empty());
    assert_eq!(firmware.counter("idle"), 2);
    assert_eq!(firmware.counter("line_event"), 4);
}

#[test]
fn a_pause_inside_a_frame_does_not() {
    let mut firmware = booted(false);
    firmware.send_and_wait(&frame([1, 2, 3])[..4], 2 * MILLISECOND);
    firmware.send_and_wait(&frame([1, 2, 3])[4..], PAUSE);
    assert_eq!(firmware.commits(), [[1, 2, 3]]);
}

#[test]
fn at_the_wrong_baud_rate_nothing_is_put_in_force_and_the_failsafe_stays() {
    for baud in [9_600, 38_400, 57_600, 76_800, 230_400, 250_000, 1_000_000] {
        let mut firmware = booted(false);
        firmware.board.line(|line| line.set_millibaud(baud * 1_000));
        let bytes: Vec<u8> = setpoints(60).flat_map(frame).collect();
        firmware.send_and_wait(&bytes, 3 * MILLISECOND);
        assert!(firmware.commits().is_empty(), "{baud} baud");
        let seen = firmware.counter("framing") + firmware.counter("no_sync");
        assert!(seen > 0, "{baud} baud: it is seen");
        assert!(firmware.leds()[2], "{baud} baud: LED3, failsafe");
    }
}

/// Two per cent is what two ordinary oscillators may differ by.
#[test]
fn at_a_baud_rate_that_is_two_per_cent_off_every_frame_is_received() {
    for baud in [112_900, 117_500] {
        let mut firmware = booted(false);
        firmware.board.line(|line| line.set_millibaud(baud * 1_000));
        let sent: Vec<_> = setpoints(100).collect();
        let bytes: Vec<u8> = sent.iter().copied().flat_map(frame).collect();
        firmware.send_and_wait(&bytes, 3 * MILLISECOND);
        assert_eq!(firmware.commits(), sent, "{baud} baud");
    }
}
