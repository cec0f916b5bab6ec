//! Tests of errors on the line: each error is counted, and no frame contains bytes from both sides of an error (L1 in
//! `docs/protocol.md`). The reception's decisions are proved for every order of events: see
//! `reception/src/verification.rs`. These tests check the firmware's accesses to registers, and times.

use crate::firmware::{Firmware, PAUSE, RESTART, frames, is_some_of};
use nrf52840_emulator::{Assumptions, LineSymbol, MICROSECOND, MILLISECOND};

/// Cycles of a byte at 115 200 baud.
const BYTE: u64 = 10 * 64_000_000 / 115_200;
const FRAME: [u8; 7] = [b'A', b'B', 0, 1, 2, 3, b'\r'];

/// Returns the booted default image, on a chip with a changed assumption.
fn assuming(change: impl FnOnce(&mut Assumptions)) -> Firmware {
    let mut firmware = Firmware::booted("default");
    firmware.assume(change);
    firmware
}

fn symbols(bytes: &[u8]) -> impl Iterator<Item = LineSymbol> {
    bytes.iter().copied().map(LineSymbol::Byte)
}

/// Each error is counted once.
#[test]
fn no_frame_reaches_across_a_byte_that_was_lost_to_an_error() {
    let errors = [LineSymbol::BadStop(b'x'), LineSymbol::Break(15)];
    for (error, other) in [(errors[0], errors[1]), (errors[1], errors[0])] {
        for place in 1..7 {
            let what = format!("{error:?} at {place}");
            let mut firmware = Firmware::booted("default");
            let mut sent: Vec<_> = symbols(&FRAME[..place]).collect();
            sent.push(error);
            sent.extend(symbols(&FRAME[place..]));
            firmware.send_symbols_and_wait(&sent, RESTART);
            assert!(firmware.commits().is_empty(), "{what}");
            // A break is a framing error too.
            assert_eq!(firmware.counter("framing"), 1, "{what}");
            let breaks = u32::from(matches!(error, LineSymbol::Break(_)));
            assert_eq!(firmware.counter("line_break"), breaks, "{what}");

            // The error is over: the next frame is received, and the next error is counted.
            firmware.takes_a_frame(RESTART, &what);
            firmware.send_symbols_and_wait(&[LineSymbol::Idle(3), other], RESTART);
            let counts = ["framing", "line_break"].map(|name| firmware.counter(name));
            assert_eq!(counts, [2, 1], "{what}");
        }
    }
}

/// The frame after an error loses no byte, however short the pause between them, even on a core that takes 1.5 times as
/// many cycles as the model.
#[test]
fn a_frame_right_behind_an_error_is_taken() {
    for image in ["default", "megabaud"] {
        for idle in 0..60 {
            let mut firmware = Firmware::booted(image);
            firmware.assume(|all| all.slowness = all.slowness.max(150));
            let mut line = vec![LineSymbol::BadStop(0xFF), LineSymbol::Idle(idle)];
            line.extend(symbols(&FRAME));
            firmware.send_symbols_and_wait(&line, PAUSE);
            assert_eq!(firmware.commits(), [[1, 2, 3]], "{image}, {idle} bits");
        }
    }
}

/// Each error costs only the frame in which it occurs, even if errors are frequent. At 1 Mbaud, on a core that is
/// slower than the model, an error sometimes also costs the next frame. The first bytes of the next frame are then in
/// the FIFO when the error is noticed.
#[test]
fn an_error_every_few_bytes_costs_the_frames_that_it_hits() {
    for image in ["default", "megabaud"] {
        for every in [8, 15, 22, 50] {
            let (sent, bytes) = frames(600);
            let mut line: Vec<_> = symbols(&bytes).collect();
            let mut expected: Vec<_> = sent.iter().copied().map(Some).collect();
            for at in (every - 1..line.len()).step_by(every) {
                line[at] = LineSymbol::BadStop(0xFF);
                expected[at / 7] = None;
            }
            let mut firmware = Firmware::booted(image);
            firmware.send_symbols_and_wait(&line, PAUSE);
            let expected: Vec<_> = expected.into_iter().flatten().collect();
            let mut commits = firmware.commits();
            if image == "megabaud" && firmware.assumptions.slowness > 100 {
                let most = expected.len() / 10;
                assert!(
                    commits.len() + most >= expected.len(),
                    "every {every} bytes"
                );
                let mut rest = expected.iter();
                commits.retain(|one| !rest.any(|sent| sent == one));
                assert_eq!(commits, [[0_u8; 3]; 0], "every {every} bytes");
            } else {
                assert_eq!(commits, expected, "{image}, every {every} bytes");
            }
        }
    }
}

/// A doubled ENDRX changes nothing if the second one comes before the next transfer is opened.
#[test]
fn a_doubled_endrx_costs_nothing() {
    for lag in 0..80 {
        let mut firmware = assuming(|all| (all.doubled_end, all.double_lag) = (u32::MAX, lag));
        let (sent, bytes) = frames(3);
        firmware.send_and_wait(&bytes, 3 * MILLISECOND);
        assert_eq!(firmware.commits(), sent, "{lag} cycles");
        assert_eq!(firmware.counter("bytes") as usize, bytes.len(), "{lag}");
    }
}

/// An error comes while the firmware is interrupted in the middle of a round. The test tries every cycle of the round.
/// The byte after the error would complete a frame with the bytes before the error.
#[test]
fn an_error_in_the_middle_of_a_round_is_seen() {
    for any_write_clears in [false, true] {
        let booted = || {
            let mut firmware = assuming(|all| all.any_write_clears |= any_write_clears);
            firmware.send_and_wait(&FRAME[..6], PAUSE);
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

/// Before the UARTE is switched off, the receiver is stopped and the firmware waits for RXTO. If RXTO does not come,
/// the UARTE is switched off nevertheless.
#[test]
fn the_receiver_is_stopped_before_the_uarte_is_switched_off() {
    const ENABLE: u32 = 0x4000_2500;
    const RXTO: u32 = 0x4000_2144;
    for is_lost in [false, true] {
        let mut firmware = assuming(|all| {
            (all.lost_end, all.causeless_timeout) = (1, false);
            all.lost_timeout = u32::MAX * u32::from(is_lost);
        });
        firmware.send_and_wait(b"x", 0);
        let began = firmware.board.now();
        while firmware.counter("restarts") == 0 {
            firmware.run_for(MICROSECOND);
        }
        // The counter is updated a tick after STOPRX.
        assert!(firmware.board.now() - began < 7 * MILLISECOND);
        let rxto = firmware.board.register(RXTO).unwrap();
        assert_eq!(rxto == 0, is_lost, "five byte times are less than a tick");
        assert_eq!(firmware.board.register(ENABLE).unwrap(), 8);
        firmware.run_for(if is_lost { 12 } else { 0 } * MILLISECOND);
        firmware.takes_a_frame(PAUSE, "started anew");
        assert_eq!(firmware.counter("restarts"), 1);
    }
}

/// An earlier RXTO came together with an ENDRX. The firmware must not take this RXTO as the sign that the receiver has
/// stopped.
#[test]
fn an_rxto_from_before_is_not_waited_for() {
    let mut firmware = assuming(|all| all.causeless_timeout = true);
    firmware.send_and_wait(b"x", MILLISECOND);
    firmware.assume(|all| {
        (all.lost_end, all.causeless_timeout) = (1, false);
        all.lost_timeout = u32::MAX;
    });
    firmware.send_and_wait(b"x", 9 * MILLISECOND);
    assert_eq!(firmware.counter("restarts"), 1);
    // The firmware waits for RXTO until twice the gap has elapsed.
    firmware.send_and_wait(&FRAME, PAUSE);
    assert!(firmware.commits().is_empty());
    firmware.run_for(9 * MILLISECOND);
    firmware.takes_a_frame(PAUSE, "after twice the gap");
}

/// If frames are sent back to back, the FIFO overruns before the tick. A lost ENDRX is then noticed at the overrun.
#[test]
fn a_lost_endrx_in_a_flood_costs_a_few_frames() {
    for image in ["default", "megabaud"] {
        let mut firmware = Firmware::booted(image);
        let (sent, bytes) = frames(600);
        let began = firmware.board.now();
        let end = firmware.board.send(&bytes);
        firmware.board.run_until(began + (end - began) / 3).unwrap();
        firmware.assume(|all| all.lost_end = 1);
        firmware.board.run_until(end + PAUSE).unwrap();
        let commits = firmware.commits();
        assert!(is_some_of(&commits, &sent), "{image}");
        assert!(commits.len() + 5 > sent.len(), "{image}: {}", commits.len());
        assert_eq!(firmware.counter("restarts"), 1, "{image}");
        // Overruns while the receiver was stopping are not reported again.
        assert_eq!(firmware.counter("overrun"), 1, "{image}");
    }
}

/// If no ENDRX comes at all, only a reset may help, so the watchdog is not fed.
#[test]
fn without_any_endrx_the_watchdog_bites() {
    for pause in [0, 3 * MILLISECOND] {
        let mut firmware = assuming(|all| all.lost_end = u32::MAX);
        for _ in 0..400_u64 * MILLISECOND / (pause + 7 * BYTE) {
            firmware.send_and_wait(&FRAME, pause);
        }
        assert!(!firmware.board.trace().resets.is_empty(), "{pause}");
    }
}

/// A break is counted once, with its length. A tick at which the line is low because of a byte does not count.
#[test]
fn a_long_break_is_counted_once_with_its_length() {
    let mut firmware = Firmware::booted("default");
    for phase in 0..40 {
        firmware.send_and_wait(&[0], 8 * MILLISECOND + phase * MILLISECOND / 20);
    }
    assert_eq!(firmware.counter("break_ticks"), 0);
    for n in 1..=2_u32 {
        // 100 ms, in ticks of 2 ms.
        firmware.board.send_symbols(&[LineSymbol::Break(11_520)]);
        firmware.run_for(100 * MILLISECOND + RESTART);
        assert_eq!(firmware.counter("line_break"), n);
        assert_eq!(firmware.counter("framing"), n);
        assert!(firmware.counter("break_ticks").abs_diff(50 * n) <= 2 * n);
    }
}

#[test]
fn a_gap_ends_the_frame_under_way() {
    let mut firmware = Firmware::booted("default");
    // A shorter pause does not.
    firmware.send_and_wait(&FRAME[..4], 2 * MILLISECOND);
    firmware.send_and_wait(&FRAME[4..], RESTART);
    assert_eq!(firmware.commits(), [[1, 2, 3]]);
    firmware.send_and_wait(&FRAME[..4], RESTART);
    firmware.send_and_wait(&FRAME[4..], RESTART);
    assert!(firmware.commits().is_empty());
    assert_eq!(firmware.counter("idle"), 3);
    assert_eq!(firmware.counter("line_event"), 4);
}

/// The UARTE is set to 8N1, so nothing raises the cause "parity". A sender with a parity bit causes a framing error
/// whenever this bit is low.
#[test]
fn with_other_settings_of_the_sender_nothing_is_put_in_force_and_the_failsafe_stays() {
    let rates = [9_600, 38_400, 57_600, 76_800, 230_400, 250_000, 1_000_000];
    for baud in rates.map(Some).into_iter().chain([None]) {
        let mut firmware = Firmware::booted("default");
        let (_, bytes) = frames(60);
        if let Some(baud) = baud {
            firmware.board.line(|line| line.set_millibaud(baud * 1_000));
            firmware.send_and_wait(&bytes, 3 * MILLISECOND);
        } else {
            // With an even parity bit, a byte with an even number of ones has a low bit where the stop bit should be.
            let symbols = bytes.iter().flat_map(|byte| match byte.count_ones() % 2 {
                0 => vec![LineSymbol::BadStop(*byte)],
                _ => vec![LineSymbol::Byte(*byte), LineSymbol::Idle(1)],
            });
            firmware.send_symbols_and_wait(&symbols.collect::<Vec<_>>(), 3 * MILLISECOND);
        }
        assert!(firmware.commits().is_empty(), "{baud:?} baud");
        let seen = firmware.counter("framing") + firmware.counter("no_sync");
        assert!(seen > 0, "{baud:?} baud: the errors are counted");
        assert_eq!(firmware.counter("parity"), 0);
        assert!(firmware.leds()[2], "{baud:?} baud: LED3, failsafe");
    }
}
