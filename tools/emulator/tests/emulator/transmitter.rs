//! Tests of UARTE1's transmitter, wired to UARTE0.

use crate::registers::*;
use nrf52840_emulator::{Board, Error, MICROSECOND, RAM_START, Refusal};

const UARTE1: u32 = 0x4002_8000;
const STARTTX: u32 = UARTE1 + 0x008;
const ENDTX: u32 = UARTE1 + 0x120;
const INTENSET: u32 = UARTE1 + 0x304;
const ENABLE: u32 = UARTE1 + 0x500;
const PSEL_TXD: u32 = UARTE1 + 0x50C;
const TX_BAUDRATE: u32 = UARTE1 + 0x524;
const TXD_PTR: u32 = UARTE1 + 0x544;
const TXD_MAXCNT: u32 = UARTE1 + 0x548;
const CONFIG: u32 = UARTE1 + 0x56C;

const PIN: u32 = 33;
const SOURCE: u32 = RAM_START + 0x800;
/// The cycles of a byte at 1 Mbaud.
const BYTE: u64 = 10 * MICROSECOND;
const BAUD_500K: u32 = 0x0800_0000;

/// Sets UARTE1 up to send these bytes at 1 Mbaud.
fn prepare(board: &mut Board, bytes: &[u8]) {
    board.memory().write(SOURCE, bytes).unwrap();
    board.set(PSEL_TXD, PIN);
    board.set(TX_BAUDRATE, BAUD_1M);
    board.set(ENABLE, 8);
    board.set(TXD_PTR, SOURCE);
    board.set(TXD_MAXCNT, u32::try_from(bytes.len()).unwrap());
}

/// Returns a board on which UARTE0 receives at 1 Mbaud, and UARTE1 is ready to send these bytes to UARTE0.
fn wired(bytes: &[u8]) -> Board {
    let mut board = receiving(8);
    board.wire_loopback(PIN);
    prepare(&mut board, bytes);
    board
}

#[test]
fn what_uarte1_sends_is_heard_by_uarte0() {
    let mut board = wired(b"hello\0\xFF");
    let began = board.now();
    board.set(STARTTX, 1);
    board.run_until(began + 7 * BYTE - 1).unwrap();
    assert!(!board.take_event(ENDTX));
    board.run_until(began + 7 * BYTE).unwrap();
    assert!(board.take_event(ENDTX));
    assert_eq!(board.bytes(BUFFER, 8), b"hello\0\xFF\0");
    assert_eq!(board.get(ERRORSRC), 0);
    // A reset of the chip does not remove the wire.
    board.reset();
    start_receiving(&mut board, BAUD_1M, 3);
    prepare(&mut board, b"abc");
    board.set(STARTTX, 1);
    board.wait(4 * BYTE);
    assert!(board.take_event(ENDRX));
    assert_eq!(board.bytes(BUFFER, 3), b"abc");
}

#[test]
fn without_the_wire_uarte0_hears_the_sender_only() {
    for pin in [None, Some(PIN + 1)] {
        let mut board = receiving(8);
        if let Some(pin) = pin {
            board.wire_loopback(pin);
        }
        prepare(&mut board, b"xyz");
        board.set(STARTTX, 1);
        board.send(b"ab");
        board.wait(5 * BYTE);
        assert!(board.take_event(ENDTX));
        assert_eq!(board.bytes(BUFFER, 3), b"ab\0");
    }
}

#[test]
fn another_baud_rate_and_an_unexpected_parity_bit_are_framing_errors() {
    let mut slow = wired(&[0]);
    slow.set(TX_BAUDRATE, BAUD_500K);
    slow.set(STARTTX, 1);
    slow.wait(3 * BYTE);
    assert_eq!(slow.get(ERRORSRC), FRAMING | BREAK);

    // If the byte has two ones, its parity bit is 0, but UARTE0 expects the stop bit there. If the byte has one 1, its
    // parity bit is 1, which UARTE0 takes for the stop bit.
    for (byte, error, stored) in [(0x03, FRAMING, 0), (0x01, 0, 0x01)] {
        let mut parity = wired(&[byte]);
        parity.set(CONFIG, 7 << 1);
        parity.set(STARTTX, 1);
        parity.wait(3 * BYTE);
        assert_eq!(parity.get(ERRORSRC), error);
        assert_eq!(parity.bytes(BUFFER, 1), [stored]);
    }
}

#[test]
fn a_string_in_flash_and_a_second_start_are_errors() {
    let mut board = wired(b"abc");
    let refusal = |board: &mut Board| match board.set_register(STARTTX, 1) {
        Err(Error::Refused { refusal, .. }) => refusal,
        other => panic!("{other:?}"),
    };
    board.set(TXD_PTR, 0x1000);
    let outside = Refusal::DmaOutsideRam { address: 0x1000 };
    assert_eq!(refusal(&mut board), outside);
    board.set(TXD_PTR, SOURCE);
    board.set(STARTTX, 1);
    let peripheral = "UARTE1";
    let how = "STARTTX while it sends, or with TXD.MAXCNT 0";
    assert_eq!(refusal(&mut board), Refusal::Misused { peripheral, how });
    // UARTE0's own transmitter is not modelled.
    assert!(board.set_register(STARTRX + 8, 1).is_err());
}

#[test]
fn the_end_is_interrupt_40() {
    let main = [&store(0xE000_E104, 1 << (40 - 32))[..], &SLEEP].concat();
    let mut handler = load(0, ENDTX).to_vec();
    handler.extend([0x2100, 0x6001, RETURN]); // movs r1, #0; str r1, [r0]
    let mut board = booted(board_of(&main, &handler));
    prepare(&mut board, b"ab");
    board.set(INTENSET, 1 << 8);
    board.set(STARTTX, 1);
    board.wait(3 * BYTE);
    let ran: Vec<u16> = board
        .trace()
        .activations
        .iter()
        .map(|a| a.exception)
        .collect();
    assert_eq!(ran, [16 + 40]);
}
