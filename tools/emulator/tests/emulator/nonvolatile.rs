//! Tests of UICR, NVMC, and the debug port's protection.

use crate::registers::*;
use nrf52840_emulator::Board;

const FICR_VARIANT: u32 = 0x1000_0104;
const UICR_PSELRESET: u32 = 0x1000_1200;
const UICR_APPROTECT: u32 = 0x1000_1208;
const DISABLE: u32 = 0x4000_0558;
const NVMC_READY: u32 = 0x4001_E400;
const NVMC_CONFIG: u32 = 0x4001_E504;
const UNPROTECTED: u32 = 0x5A;

fn write_uicr(board: &mut Board, address: u32, value: u32) {
    board.set(NVMC_CONFIG, 1);
    board.set(address, value);
    assert_eq!(board.get(NVMC_READY), 1);
    board.set(NVMC_CONFIG, 0);
}

#[test]
fn uicr_is_written_as_flash_is_and_survives_a_reset() {
    let mut board = asleep();
    assert_eq!(board.get(UICR_PSELRESET), u32::MAX, "erased");
    write_uicr(&mut board, UICR_PSELRESET, 18);
    write_uicr(&mut board, UICR_PSELRESET + 4, 0xFFFF_FF0F);
    write_uicr(&mut board, UICR_PSELRESET + 4, 0xFFFF_FFF0);
    board.reset();
    assert_eq!(board.get(UICR_PSELRESET), 18);
    assert_eq!(
        board.get(UICR_PSELRESET + 4),
        0xFFFF_FF00,
        "writing changes bits from 1 to 0 only"
    );
}

#[test]
fn uicr_is_not_written_unless_nvmc_enables_it() {
    let mut board = asleep();
    write_uicr(&mut board, UICR_PSELRESET, 18);
    board.set(NVMC_CONFIG, 1);
    board.reset();
    let error = board.set_register(UICR_PSELRESET, 0).unwrap_err();
    assert!(error.to_string().contains("UICR: written while"), "{error}");
    // Erasing is not modelled.
    assert!(board.set_register(NVMC_CONFIG, 2).is_err());
}

#[test]
fn the_debug_port_opens_if_uicr_and_the_firmware_both_say_so_after_a_reset() {
    let mut board = asleep();
    assert_eq!(board.get(FICR_VARIANT) >> 8 & 0xFF, u32::from(b'F'));
    board.set(DISABLE, UNPROTECTED);
    assert!(!board.debug_port_is_open(), "UICR is erased");
    write_uicr(&mut board, UICR_APPROTECT, UNPROTECTED);
    assert!(!board.debug_port_is_open(), "UICR takes effect at a reset");
    board.reset();
    assert!(!board.debug_port_is_open(), "each reset closes it");
    board.set(DISABLE, UNPROTECTED);
    assert!(board.debug_port_is_open());
}

#[test]
fn bits_of_a_broken_word_of_uicr_stay_1() {
    let mut board = asleep();
    board.break_uicr(0x200, 0x10);
    write_uicr(&mut board, UICR_PSELRESET, 2);
    write_uicr(&mut board, UICR_PSELRESET + 4, 2);
    assert_eq!(board.get(UICR_PSELRESET), 0x12);
    assert_eq!(board.get(UICR_PSELRESET + 4), 2);
}
