//! Tests of UARTE0's receiver, register by register.

use crate::registers::*;
use nrf52840_emulator::{Error, LineSymbol, MICROSECOND, Refusal};

/// The cycles of a byte at 1 Mbaud.
const BYTE: u64 = 10 * MICROSECOND;

#[test]
fn bytes_arrive_in_ram_and_the_transfer_ends_when_it_is_full() {
    let mut board = receiving(4);
    assert!(board.take_event(RXSTARTED));
    board.send(&[0x00, 0xFF, 0x55]);
    board.wait(4 * BYTE);
    assert_eq!(board.bytes(BUFFER, 3), [0x00, 0xFF, 0x55]);
    assert!(!board.take_event(ENDRX));
    board.send(&[0xAA]);
    board.wait(2 * BYTE);
    assert!(board.take_event(ENDRX));
    assert_eq!(board.bytes(BUFFER, 4), [0x00, 0xFF, 0x55, 0xAA]);
    assert_eq!(board.get(ERRORSRC), 0);
}

/// "This event is likely to occur before the corresponding data has been transferred to Data RAM."
#[test]
fn rxdrdy_comes_before_the_byte_is_in_ram() {
    let mut board = receiving(4);
    let end = board.send(&[0x5A]);
    // The byte is complete in the middle of the stop bit, and is in RAM 32 cycles later.
    board.run_until(end - MICROSECOND / 2 + 8).unwrap();
    assert!(board.take_event(RXDRDY));
    assert_eq!(board.bytes(BUFFER, 1), [0]);
    board.wait(32);
    assert_eq!(board.bytes(BUFFER, 1), [0x5A]);
}

#[test]
fn the_next_buffer_is_armed_while_the_first_fills() {
    let mut board = receiving(4);
    board.set(UARTE_SHORTS, 1 << 5);
    board.set(RXD_PTR, BUFFER + 4);
    board.send(b"abcdefgh");
    board.wait(5 * BYTE);
    board.set(RXD_PTR, BUFFER + 8);
    board.wait(4 * BYTE);
    assert_eq!(board.bytes(BUFFER, 8), b"abcdefgh");
}

/// "That specific byte will NOT be stored into Data RAM, but following incoming bytes will." A break no longer than a
/// character is only a framing error.
#[test]
fn a_byte_without_a_stop_bit_is_not_stored() {
    for (error, causes) in [
        (LineSymbol::BadStop(b'b'), FRAMING),
        (LineSymbol::Break(10), FRAMING),
        (LineSymbol::Break(20), FRAMING | BREAK),
    ] {
        let mut board = receiving(8);
        board.send_symbols(&[LineSymbol::Byte(b'a'), error, LineSymbol::Byte(b'c')]);
        board.wait(5 * BYTE);
        assert_eq!(board.bytes(BUFFER, 3), b"ac\0");
        assert_eq!(board.get(ERRORSRC), causes);
        board.set(ERRORSRC, FRAMING);
        assert_eq!(board.get(ERRORSRC), causes & BREAK, "a cause of its own");
    }
}

/// "A framing error is always generated before a break condition occurs."
#[test]
fn a_break_is_a_framing_error_first() {
    let mut board = receiving(8);
    board.send_symbols(&[LineSymbol::Break(40), LineSymbol::Byte(b'a')]);
    board.wait(39 * MICROSECOND / 4);
    assert_eq!(board.get(ERRORSRC), FRAMING);
    board.wait(MICROSECOND);
    assert_eq!(board.get(ERRORSRC), FRAMING | BREAK);
    board.set(ERRORSRC, FRAMING | BREAK);
    board.wait(6 * BYTE);
    assert_eq!(board.get(ERRORSRC), 0, "one break raises one event");
    assert_eq!(board.bytes(BUFFER, 1), b"a");
}

#[test]
fn stopping_ends_the_transfer_and_then_says_so() {
    let mut board = receiving(8);
    board.send(b"abc");
    board.wait(4 * BYTE);
    board.set(STOPRX, 1);
    assert!(!board.take_event(ENDRX));
    board.wait(6 * BYTE);
    assert!(board.take_event(ENDRX));
    assert!(board.take_event(RXTO));
    board.send(b"d");
    board.wait(3 * BYTE);
    assert_eq!(
        board.bytes(BUFFER, 4),
        b"abc\0",
        "a stopped receiver hears nothing"
    );
}

#[test]
fn noise_shorter_than_half_a_bit_is_no_start_bit() {
    let mut board = receiving(8);
    let at = board.now() + BYTE;
    board.line(|line| line.invert(at, MICROSECOND / 4));
    board.wait(3 * BYTE);
    board.send(b"a");
    board.wait(2 * BYTE);
    assert_eq!(board.bytes(BUFFER, 2), b"a\0");
    assert_eq!(board.get(ERRORSRC), 0);
}

#[test]
fn noise_in_the_middle_of_a_bit_inverts_it() {
    let mut board = receiving(8);
    let end = board.send(&[0x00]);
    // Bit 3 is the fourth after the start bit. Its middle is 4.5 bits after the beginning.
    let middle = end - BYTE + 9 * MICROSECOND / 2;
    board.line(|line| line.invert(middle - 16, 40));
    board.wait(2 * BYTE);
    assert_eq!(board.bytes(BUFFER, 1), [0x08]);
}

/// Sends every byte value back to back, with the sender's rate off by `per_mille`. Returns the
/// number of bytes that arrive unchanged, and ERRORSRC.
fn survivors(per_mille: i64) -> (usize, u32) {
    let bytes: Vec<u8> = (0..=255).collect();
    // The receiver's rate for 115200 baud is 115108 baud.
    let nominal = 16_000_000_000 / 139;
    let millibaud = u64::try_from(nominal + nominal * per_mille / 1000).unwrap();
    let mut board = receiving_at(BAUD_115200, millibaud, 256);
    let end = board.send(&bytes);
    board.run_until(end + 2 * MICROSECOND * 100).unwrap();
    let arrived = board.bytes(BUFFER, 256);
    let right = arrived.iter().zip(&bytes).filter(|(a, b)| a == b).count();
    (right, board.get(ERRORSRC))
}

#[test]
fn the_baud_rates_may_differ_by_four_per_cent_but_not_by_six() {
    for per_mille in [-40, -20, 0, 20, 40] {
        assert_eq!(survivors(per_mille), (256, 0), "{per_mille} per mille");
    }
    for per_mille in [-60, 60] {
        let (right, _) = survivors(per_mille);
        assert!(right < 200, "{right} of 256 at {per_mille} per mille");
    }
}

#[test]
fn a_transfer_outside_ram_is_an_error() {
    let mut board = receiving(1);
    board.send(b"a");
    board.wait(3 * BYTE);
    board.set(RXD_PTR, 0x1000);
    let error = board.set_register(STARTRX, 1).unwrap_err();
    let refusal = Refusal::DmaOutsideRam { address: 0x1000 };
    assert!(matches!(error, Error::Refused { refusal: r, .. } if r == refusal));
}

#[test]
fn the_receiver_hears_only_the_pin_that_is_wired() {
    for wired in [8, 9] {
        let mut board = asleep();
        board.wire_line_to(wired);
        start_receiving_from(9, &mut board, BAUD_1M, 4);
        board.line(|line| line.set_millibaud(1_000_000_000));
        board.send(b"a");
        board.wait(3 * BYTE);
        assert_eq!(board.take_event(RXDRDY), wired == 9);
    }
}

/// A line that nobody drives is low unless the pin pulls it up.
#[test]
fn an_unconnected_line_is_as_the_pull_up_has_it() {
    const PIN_CNF_8: u32 = 0x5000_0720;
    for (configuration, error) in [(0xC, 0), (0, FRAMING | BREAK)] {
        let mut board = asleep();
        board.line(nrf52840_emulator::SerialLine::unplug);
        board.set(PIN_CNF_8, configuration);
        start_receiving(&mut board, BAUD_1M, 4);
        board.wait(100 * MICROSECOND);
        assert_eq!(board.get(ERRORSRC), error);
    }
}
