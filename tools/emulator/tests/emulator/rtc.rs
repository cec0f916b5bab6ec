//! Tests of RTC1: its counter and its events.

use crate::registers::*;
use nrf52840_emulator::{Board, CYCLES_PER_SECOND, MILLISECOND};

const RTC: u32 = 0x4001_1000;
const START: u32 = RTC;
const CLEAR: u32 = RTC + 0x008;
const OVRFLW: u32 = RTC + 0x104;
const COMPARE0: u32 = RTC + 0x140;
const INTENSET: u32 = RTC + 0x304;
const COUNTER: u32 = RTC + 0x504;
const CC0: u32 = RTC + 0x540;
const COMPARE0_ENABLED: u32 = 1 << 16;

fn counting() -> Board {
    let mut board = asleep();
    board.set(START, 1);
    board
}

#[test]
fn it_counts_32768_in_a_second() {
    let mut board = counting();
    let start = board.now();
    board.run_until(start + CYCLES_PER_SECOND - 1).unwrap();
    assert_eq!(board.get(COUNTER), 32_767);
    board.run_until(start + CYCLES_PER_SECOND).unwrap();
    assert_eq!(board.get(COUNTER), 32_768);
    board.set(CLEAR, 1);
    assert_eq!(board.get(COUNTER), 0);
}

#[test]
fn a_compare_comes_when_the_count_becomes_its_value_if_its_interrupt_is_enabled() {
    let mut board = counting();
    let start = board.now();
    board.set(CC0, 100);
    let count = |count: u64| (count * CYCLES_PER_SECOND).div_ceil(32_768);
    board.run_until(start + count(101)).unwrap();
    assert!(!board.take_event(COMPARE0));

    board.set(INTENSET, COMPARE0_ENABLED);
    board.set(CC0, 200);
    board.run_until(start + count(200) - 1).unwrap();
    assert!(!board.take_event(COMPARE0));
    board.run_until(start + count(200)).unwrap();
    assert!(board.take_event(COMPARE0));
    // The count already equals this value, so no event comes.
    board.set(CC0, 200);
    board.wait(MILLISECOND);
    assert!(!board.take_event(COMPARE0));
}

#[test]
fn it_overflows_behind_24_bits() {
    let mut board = counting();
    board.set(INTENSET, 1 << 1);
    board.wait(512 * CYCLES_PER_SECOND - MILLISECOND);
    assert!(!board.take_event(OVRFLW));
    board.wait(2 * MILLISECOND);
    assert!(board.take_event(OVRFLW));
    assert_eq!(board.get(COUNTER), 32);
}

/// Drivers wait for this event before they use the RTC.
#[test]
fn the_low_frequency_clock_starts() {
    const LFCLKSTART: u32 = 0x4000_0008;
    const LFCLKSTARTED: u32 = 0x4000_0104;
    let mut board = asleep();
    board.set(LFCLKSTART, 1);
    board.wait(MILLISECOND / 2);
    assert!(!board.take_event(LFCLKSTARTED));
    board.wait(MILLISECOND);
    assert!(board.take_event(LFCLKSTARTED));
}
