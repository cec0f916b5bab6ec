//! Tests of PWM0, the watchdog, the pins and the clock, register by register.

use crate::registers::*;
use nrf52840_emulator::{Assumptions, Board, MICROSECOND, MILLISECOND, Period, ResetCause};

const PWM: u32 = 0x4001_C000;
const PWM_STOP: u32 = PWM + 0x004;
const SEQSTART0: u32 = PWM + 0x008;
const STOPPED: u32 = PWM + 0x104;
const PWM_ENABLE: u32 = PWM + 0x500;
const COUNTERTOP: u32 = PWM + 0x508;
const PWM_PRESCALER: u32 = PWM + 0x50C;
const DECODER: u32 = PWM + 0x510;
const SEQ0_PTR: u32 = PWM + 0x520;
const SEQ0_CNT: u32 = PWM + 0x524;
const PSEL_OUT0: u32 = PWM + 0x560;

const WDT: u32 = 0x4001_0000;
const PIN_CNF: u32 = 0x5000_0700;
const RESETREAS: u32 = 0x4000_0400;

/// Returns the compare value, with the polarity bit, for a pulse that is high for `counts` counts and then low.
fn pulse(counts: u16) -> u16 {
    counts + 0x8000
}

fn write_values(board: &mut Board, values: &[u16]) {
    let bytes: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    board.patch(BUFFER, &bytes).unwrap();
}

/// Returns a board with PWM0 set up for servo pulses: it counts microseconds, a period is 20 ms,
/// and three channels are on pins.
fn servos(values: &[u16]) -> Board {
    let mut board = asleep();
    write_values(&mut board, values);
    for channel in 0..3 {
        board.set(PSEL_OUT0 + 4 * channel, 20 + channel);
    }
    board.set(PWM_ENABLE, 1);
    board.set(PWM_PRESCALER, 4);
    board.set(COUNTERTOP, 20_000);
    board.set(DECODER, 2);
    board.set(SEQ0_PTR, BUFFER);
    board.set(SEQ0_CNT, u32::try_from(values.len()).unwrap());
    board
}

fn widths(board: &mut Board) -> Vec<[Option<u64>; 4]> {
    board
        .trace()
        .pwm_periods
        .iter()
        .map(Period::pulses)
        .collect()
}

#[test]
fn pulses_are_as_wide_as_the_values_say() {
    // Without the polarity bit, the rest of the period is high.
    let mut board = servos(&[pulse(1_000), 1_498, pulse(2_000), 0]);
    board.set(SEQSTART0, 1);
    board.wait(45 * MILLISECOND);
    // A step is repeated until another sequence starts. The fourth channel has no pin.
    let pulses = [Some(1_000), Some(18_502), Some(2_000), None];
    assert_eq!(widths(&mut board), [pulses; 3]);
    let periods = &board.trace().pwm_periods;
    assert!(
        periods
            .iter()
            .all(|period| period.length == 20 * MILLISECOND)
    );
}

#[test]
fn stopping_waits_for_the_end_of_the_period() {
    let mut board = servos(&[pulse(1_000); 4]);
    board.set(SEQSTART0, 1);
    board.wait(5 * MILLISECOND);
    board.set(PWM_STOP, 1);
    assert!(!board.take_event(STOPPED));
    board.wait(16 * MILLISECOND);
    assert!(board.take_event(STOPPED));
    board.wait(100 * MILLISECOND);
    assert_eq!(board.trace().pwm_periods.len(), 1);
}

/// Returns a board whose watchdog times out after 3277 cycles of 32.768 kHz, 100 ms.
fn watched() -> Board {
    let mut board = asleep();
    board.set(WDT + 0x504, 3_276);
    board.set(WDT, 1);
    board
}

#[test]
fn the_watchdog_bites_when_it_is_not_fed_and_says_why() {
    let mut board = watched();
    board.set(PIN_CNF + 4 * 13, 3);
    let began = board.now();
    board.wait(100 * MILLISECOND);
    assert!(board.trace().resets.is_empty());
    board.wait(MILLISECOND);
    let &[reset] = board.trace().resets.as_slice() else {
        panic!("{:?}", board.trace().resets)
    };
    assert_eq!(reset.cause, ResetCause::Watchdog);
    // TIMEOUT comes after (3276 + 1) / 32768 s, and the reset two cycles later.
    let expected = 3_279 * 64_000_000 / 32_768;
    assert!(
        (reset.at - began).abs_diff(expected) < 64,
        "{}",
        reset.at - began
    );
    assert_eq!(board.get(RESETREAS), 2);
    assert_eq!(board.pins().outputs, [0, 0], "the pins are inputs again");
    board.set(RESETREAS, 2);
    assert_eq!(board.get(RESETREAS), 0);
}

#[test]
fn a_watchdog_that_is_fed_does_not_bite() {
    let mut board = watched();
    // A running watchdog cannot be slowed down.
    board.set(WDT + 0x504, 100_000);
    for _ in 0..20 {
        board.wait(90 * MILLISECOND);
        board.set(WDT + 0x600, 0x6E52_4635);
    }
    assert!(board.trace().resets.is_empty());
    // Another value does not feed it.
    board.wait(90 * MILLISECOND);
    board.set(WDT + 0x600, 1);
    board.wait(20 * MILLISECOND);
    assert_eq!(board.trace().resets.len(), 1);
}

/// The time has passed also for the peripherals that do not pause.
#[test]
fn a_halt_pauses_the_watchdog() {
    let mut board = watched();
    board.wait(50 * MILLISECOND);
    let began = board.now();
    board.halt_for(2_000 * MILLISECOND);
    board.wait(2_040 * MILLISECOND);
    assert!(board.trace().resets.is_empty());
    assert!(board.now() >= began + 2_040 * MILLISECOND);
    board.wait(20 * MILLISECOND);
    assert_eq!(board.trace().resets.len(), 1);
}

#[test]
fn outputs_are_seen_when_they_change() {
    let mut board = asleep();
    // PIN_CNF[13] as output, then OUTSET and OUTCLR.
    board.set(PIN_CNF + 4 * 13, 3);
    board.set(0x5000_0508, 1 << 13);
    board.wait(10 * MICROSECOND);
    board.set(0x5000_050C, 1 << 13);
    // P1.02 as well.
    board.set(PIN_CNF + 0x300 + 4 * 2, 3);
    let seen: Vec<_> = board
        .trace()
        .pin_changes
        .iter()
        .map(|(_, pins)| (pins.outputs, pins.high))
        .collect();
    let p0 = 1 << 13;
    assert_eq!(
        seen,
        [
            ([p0, 0], [0, 0]),
            ([p0, 0], [p0, 0]),
            ([p0, 0], [0, 0]),
            ([p0, 4], [0, 0])
        ]
    );
}

#[test]
fn a_quiet_line_is_read_as_high() {
    let mut board = asleep();
    // PIN_CNF[8]: input, buffer connected, pulled up.
    board.set(PIN_CNF + 4 * 8, 3 << 2);
    assert_eq!(board.get(0x5000_0510), 1 << 8);
}

#[test]
fn the_crystal_takes_its_time() {
    let mut board = asleep();
    board.set(0x4000_0000, 1);
    board.wait(359 * MICROSECOND);
    assert!(!board.take_event(0x4000_0100));
    board.wait(2 * MICROSECOND);
    assert!(board.take_event(0x4000_0100));
}

/// SEQSTART comes in the middle of a pulse.
#[test]
fn seqstart_may_cut_the_period() {
    for cuts in [false, true] {
        let mut board = servos(&[pulse(1_000), pulse(1_498), pulse(2_000), 0]);
        board.assume(Assumptions::default().with(|a| a.start_cuts_period = cuts));
        board.set(SEQSTART0, 1);
        board.wait(1_200 * MICROSECOND);
        write_values(&mut board, &[pulse(500); 4]);
        board.set(SEQSTART0, 1);
        board.wait(30 * MILLISECOND);
        let first = board.trace().pwm_periods[0];
        let length = if cuts { 1_200 } else { 20_000 };
        assert!(first.length.abs_diff(length * MICROSECOND) < 100);
        assert_eq!(first.pulses()[0], Some(1_000));
        assert_eq!(first.pulses()[1] == Some(1_498), !cuts);
        assert_eq!(board.trace().pwm_periods[1].pulses()[0], Some(500));
        // A reset ends the pulses.
        let periods = board.trace().pwm_periods.len();
        board.reset();
        board.wait(50 * MILLISECOND);
        assert_eq!(board.trace().pwm_periods.len(), periods);
    }
}

/// RESETREAS shows no cause, as after power-on, and RAM keeps its contents.
#[test]
fn a_brown_out_has_no_cause() {
    let mut board = asleep();
    board.reset();
    assert_eq!(board.get(RESETREAS), 1);
    board.patch(BUFFER, b"kept").unwrap();
    board.brown_out();
    assert_eq!(board.get(RESETREAS), 0);
    assert_eq!(board.bytes(BUFFER, 4), b"kept");
    let causes: Vec<_> = board.trace().resets.iter().map(|it| it.cause).collect();
    assert_eq!(causes, [ResetCause::Pin, ResetCause::BrownOut]);
}
