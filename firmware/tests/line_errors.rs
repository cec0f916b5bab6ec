//! Errors on the line: each is counted, and no frame reaches across one (L1).

use crate::firmware::{Firmware, GAP, PAUSE, Setpoint, frame, setpoints};
use nrf52840_emulator::{Assumptions, LineSymbol, MILLISECOND, Parity};

/// What the specification leaves open: whether a byte that is not stored is counted.
const EITHER: [bool; 2] = [false, true];

fn booted(counted: bool) -> Firmware {
    let mut firmware = Firmware::booted("default");
    firmware.board.assume(Assumptions {
        ready_on_framing_error: counted,
        ready_on_overrun: counted,
        ..Assumptions::default()
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
                firmware.board.run_until(end + GAP).unwrap();
                assert!(firmware.commits().is_empty(), "{error:?} at {place}");
                assert_eq!(firmware.counter("framing"), 1, "{error:?} at {place}");
                let breaks = u32::from(matches!(error, LineSymbol::Break(_)));
                assert_eq!(firmware.counter("line_break"), breaks);

                // The error is over: the next frame is taken, and the next error is counted.
                firmware.send_and_wait(&frame([4, 5, 6]), GAP);
                assert_eq!(firmware.commits(), [[4, 5, 6]], "{error:?} at {place}");
                let end = firmware.board.send_symbols(&[LineSymbol::Idle(3), error]);
                firmware.board.run_until(end + GAP).unwrap();
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
        firmware.board.run_until(end + GAP).unwrap();
        assert_eq!(firmware.counter("line_break"), n);
        let end = firmware.board.send_symbols(&[LineSymbol::BadStop(b'x')]);
        firmware.board.run_until(end + GAP).unwrap();
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
            firmware.board.run_until(end + 3 * MILLISECOND).unwrap();
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
            firmware.board.run_until(end + GAP).unwrap();
            assert!(firmware.commits().is_empty(), "counted {counted}");
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
        // The buffer is full of terminators; then six bytes of a frame, which are stored.
        firmware.send_and_wait(&[b'\r'; 64], PAUSE);
        let stored = firmware.board.send(&frame([1, 2, 3])[..6]);
        firmware.board.run_until(stored).unwrap();
        let assumed = Assumptions {
            ready_on_framing_error: counted,
            ready_on_overrun: counted,
            ..Assumptions::default()
        };
        firmware.board.assume(Assumptions {
            dma_lag: MILLISECOND,
            ..assumed
        });
        // Six of these fill the FIFO.
        firmware.send_and_wait(b"xxxxxxx", 3 * MILLISECOND);
        assert!(firmware.commits().is_empty(), "counted {counted}");
        assert!(firmware.counter("overrun") > 0, "counted {counted}");
        let (late, skipped) = firmware.losses();
        assert!(late == 0 && skipped > 0, "the loss is counted");

        // It is over: the next frame is taken.
        firmware.board.assume(assumed);
        firmware.send_and_wait(&frame([4, 5, 6]), GAP);
        assert_eq!(firmware.commits(), [[4, 5, 6]], "counted {counted}");
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
    firmware.send_and_wait(&frame([1, 2, 3])[..4], GAP);
    firmware.send_and_wait(&frame([1, 2, 3])[4..], GAP);
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
