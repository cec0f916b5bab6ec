//! Tests of the TIMERs and PPI, register by register.

use crate::registers::*;
use nrf52840_emulator::{Board, MICROSECOND};

const BITS_32: u32 = 3;

const TIMER0: u32 = 0x4000_8000;
const TIMER1: u32 = 0x4000_9000;
const TIMER2: u32 = 0x4000_A000;
const START: u32 = 0x000;
const STOP: u32 = 0x004;
const COUNT: u32 = 0x008;
const CLEAR: u32 = 0x00C;
const CAPTURE: u32 = 0x040;
const COMPARE: u32 = 0x140;
const SHORTS: u32 = 0x200;
const MODE: u32 = 0x504;
const BITMODE: u32 = 0x508;
const PRESCALER: u32 = 0x510;
const CC: u32 = 0x540;

const PPI: u32 = 0x4001_F000;
const CHENSET: u32 = PPI + 0x504;
const CHENCLR: u32 = PPI + 0x508;
const CHANNEL_0: u32 = PPI + 0x510;
const GROUP_0: u32 = PPI + 0x800;
const FORK_0: u32 = PPI + 0x910;

/// Returns a board on which a timer of 32 bits counts microseconds.
fn microseconds(timer: u32) -> Board {
    let mut board = asleep();
    board.set(timer + PRESCALER, 4);
    start(&mut board, timer);
    board
}

fn start(board: &mut Board, timer: u32) {
    board.set(timer + BITMODE, BITS_32);
    board.set(timer + START, 1);
}

fn count(board: &mut Board, timer: u32) -> u32 {
    board.set(timer + CAPTURE, 1);
    board.get(timer + CC)
}

#[test]
fn a_timer_counts_microseconds_exactly() {
    let mut board = microseconds(TIMER1);
    let began = board.now();
    for at in [1, 10, 1_000, 100_000] {
        board.run_until(began + at * MICROSECOND).unwrap();
        let passed = (board.now() - began) / MICROSECOND;
        assert_eq!(u64::from(count(&mut board, TIMER1)), passed);
    }
}

#[test]
fn a_stopped_timer_keeps_its_count_and_clearing_sets_it_to_zero() {
    let mut board = microseconds(TIMER1);
    board.wait(50 * MICROSECOND);
    board.set(TIMER1 + STOP, 1);
    let stopped = count(&mut board, TIMER1);
    board.wait(50 * MICROSECOND);
    assert_eq!(count(&mut board, TIMER1), stopped);
    assert_eq!(stopped, 50);
    board.set(TIMER1 + CLEAR, 1);
    assert_eq!(count(&mut board, TIMER1), 0);
}

#[test]
fn a_compare_comes_when_the_count_is_reached_and_once() {
    let mut board = microseconds(TIMER1);
    board.set(TIMER1 + CC + 4, 30);
    board.wait(29 * MICROSECOND);
    assert!(!board.take_event(TIMER1 + COMPARE + 4));
    board.wait(2 * MICROSECOND);
    assert!(board.take_event(TIMER1 + COMPARE + 4));
    board.wait(1_000 * MICROSECOND);
    assert!(!board.take_event(TIMER1 + COMPARE + 4));
}

/// A compare value that has just passed is reached only after the counter has wrapped. Drivers must
/// handle that.
#[test]
fn a_compare_in_the_past_does_not_come() {
    let mut board = microseconds(TIMER1);
    board.wait(100 * MICROSECOND);
    board.set(TIMER1 + CC + 4, 99);
    board.wait(1_000_000 * MICROSECOND);
    assert!(!board.take_event(TIMER1 + COMPARE + 4));
}

#[test]
fn shorts_clear_and_stop_at_a_compare() {
    let mut board = microseconds(TIMER2);
    board.set(TIMER2 + CC, 30);
    // COMPARE[0] clears the timer, so the event comes every 30 us.
    board.set(TIMER2 + SHORTS, 1);
    board.wait(75 * MICROSECOND);
    board.set(TIMER2 + CAPTURE + 4, 1);
    assert_eq!(board.get(TIMER2 + CC + 4), 15);
    // With the short to STOP as well, the count stays at 0.
    board.set(TIMER2 + SHORTS, 0x101);
    board.wait(75 * MICROSECOND);
    board.set(TIMER2 + CAPTURE + 4, 1);
    assert_eq!(board.get(TIMER2 + CC + 4), 0);
}

#[test]
fn a_counter_counts_tasks_not_time() {
    let mut board = asleep();
    board.set(TIMER1 + MODE, 2);
    board.set(TIMER1 + CC + 4, 2);
    start(&mut board, TIMER1);
    board.wait(100 * MICROSECOND);
    assert_eq!(count(&mut board, TIMER1), 0);
    board.set(TIMER1 + COUNT, 1);
    assert!(!board.take_event(TIMER1 + COMPARE + 4));
    board.set(TIMER1 + COUNT, 1);
    assert!(board.take_event(TIMER1 + COMPARE + 4));
    assert_eq!(count(&mut board, TIMER1), 2);
}

/// Some drivers count bytes with a timer: each RXDRDY advances TIMER1. In this test, the fork also clears TIMER2.
#[test]
fn an_event_triggers_a_task_and_its_fork() {
    let mut board = receiving(8);
    board.set(TIMER1 + MODE, 2);
    start(&mut board, TIMER1);
    start(&mut board, TIMER2);
    board.set(CHANNEL_0, RXDRDY);
    board.set(CHANNEL_0 + 4, TIMER1 + COUNT);
    board.set(FORK_0, TIMER2 + CLEAR);
    board.set(CHENSET, 1);
    let end = board.send(b"abc");
    board.run_until(end + 20 * MICROSECOND).unwrap();
    assert_eq!(count(&mut board, TIMER1), 3);
    // RXDRDY came in the middle of the stop bit, half a microsecond before its end.
    assert_eq!(count(&mut board, TIMER2), 20);
    board.set(CHENCLR, 1);
    board.send(b"d");
    board.wait(20 * MICROSECOND);
    assert_eq!(
        count(&mut board, TIMER1),
        3,
        "a channel that is off does nothing"
    );
}

#[test]
fn a_group_switches_its_channels() {
    let mut board = asleep();
    board.set(GROUP_0, 0b11);
    board.set(PPI, 1);
    assert_eq!(board.get(CHENSET), 0b11);
    board.set(PPI + 4, 1);
    assert_eq!(board.get(CHENSET), 0);
}

#[test]
fn what_is_not_modelled_is_an_error_and_says_where() {
    for (register, value, name) in [
        // GPIOTE.
        (0x4000_6510, 0, "peripheral at 0x40006510"),
        // A fixed channel of PPI.
        (CHENSET, 1 << 20, "PPI at 0x4001f504"),
        // A task of the transmitter.
        (UARTE + 8, 1, "UARTE0 at 0x40002008"),
        // A loop, and a sequence of two steps.
        (0x4001_C514, 1, "PWM0 at 0x4001c514"),
        (0x4001_C524, 8, "PWM0 at 0x4001c524"),
        // A timer of 16 bits.
        (TIMER1 + START, 1, "TIMER1 at 0x40009000"),
        // The reserved words after the last register of UICR.
        (0x1000_1308, 0, "UICR"),
        (0x1000_0100, 0, "FICR at 0x10000100"),
    ] {
        let error = asleep().set_register(register, value).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
    }
}

#[test]
fn channels_that_form_a_loop_are_an_error() {
    let mut board = asleep();
    board.set(TIMER1 + MODE, 2);
    board.set(TIMER1 + CC, 1);
    start(&mut board, TIMER1);
    board.set(TIMER1 + SHORTS, 1);
    board.set(CHANNEL_0, TIMER1 + COMPARE);
    board.set(CHANNEL_0 + 4, TIMER1 + COUNT);
    board.set(CHENSET, 1);
    let error = board.set_register(TIMER1 + COUNT, 1).unwrap_err();
    assert!(error.to_string().contains("loop"), "{error}");
}

#[test]
fn skipped_counts_leave_the_next_events_as_far_away_and_reach_the_wrap() {
    let mut board = microseconds(TIMER0);
    board.set(TIMER0 + CC + 4, 150);
    board.wait(50 * MICROSECOND);
    let before = count(&mut board, TIMER0);
    board.skip_counts(u32::MAX - 100).unwrap();
    assert_eq!(count(&mut board, TIMER0), before.wrapping_sub(101));
    board.wait(90 * MICROSECOND);
    assert_eq!(board.get(TIMER0 + COMPARE + 4), 0);
    board.wait(20 * MICROSECOND);
    assert_eq!(board.get(TIMER0 + COMPARE + 4), 1);
    assert!(count(&mut board, TIMER0) < 100, "the count has wrapped");
}
