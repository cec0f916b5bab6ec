//! Tests of servos, LEDs, log and watchdog. Most of them are scripts: see `outputs.txt`.

use nrf52840_emulator::{LineSymbol, MILLISECOND, ResetCause};

use crate::firmware::{Firmware, RESTART, UNDEFINED, sample};

/// Returns the pulse for a demand, in microseconds.
pub(crate) fn pulse(demand: u64) -> u64 {
    1_000 + 1_000 * demand / 255
}

/// Returns the pulses of pitch, roll and yaw in every period since an instant, in microseconds.
pub(crate) fn pulses(firmware: &mut Firmware, since: u64) -> Vec<[u64; 3]> {
    // If SEQSTART immediately begins a period, the previous period is shorter, but its pulses are complete.
    let shortest = if firmware.assumptions.start_cuts_period {
        16
    } else {
        20
    };
    firmware
        .board
        .trace()
        .pwm_periods
        .iter()
        .filter(|period| period.at >= since)
        .map(|period| {
            let length = period.length / MILLISECOND;
            assert!((shortest..=20).contains(&length), "50 Hz: {length} ms");
            let [pitch, roll, yaw, _] = period.pulses();
            [pitch.unwrap(), roll.unwrap(), yaw.unwrap()]
        })
        .collect()
}

/// Runs the board, and looks at LED3 every millisecond. Returns the number of milliseconds for which LED3 was lit, and
/// how often it went on.
pub(crate) fn led3(firmware: &mut Firmware, milliseconds: u64) -> (u64, u64) {
    let (mut lit, mut flashes) = (0, 0);
    let mut before = firmware.leds()[2];
    for _ in 0..milliseconds {
        firmware.run_for(MILLISECOND);
        let is_lit = firmware.leds()[2];
        lit += u64::from(is_lit);
        flashes += u64::from(is_lit && !before);
        before = is_lit;
    }
    (lit, flashes)
}

/// A break causes a handler to run, at various times before a tick. If the handler ends just before the tick, the main
/// loop is awake when the tick comes. If the main loop then slept through the tick, it would not update the counter,
/// because no later byte would wake it. The time between two breaks is long enough for a restart of the UARTE, because
/// a receiver that is switched off would miss a break.
#[test]
fn a_tick_is_not_slept_through_whenever_it_comes() {
    let mut firmware = Firmware::booted("default");
    for (n, pause) in (1..).zip(sample((0..74_000).step_by(37), 4)) {
        firmware.board.send_symbols(&[LineSymbol::Break(15)]);
        firmware.run_for(RESTART + pause);
        assert_eq!(firmware.counter("framing"), n);
    }
    assert!(firmware.board.trace().resets.is_empty());
}

/// The firmware is interrupted for longer than a tick, at many positions of the main loop. Then the main loop may
/// request a tick whose time has already passed. The main loop must go on immediately, because this tick would come
/// only after the clock has wrapped.
#[test]
fn a_tick_that_is_over_already_is_not_waited_for() {
    const TIMER0: u16 = 16 + 8;
    let mut firmware = Firmware::booted("default");
    for place in 0..150 {
        let board = &mut firmware.board;
        let end = board.now() + 3 * MILLISECOND;
        let ticks = board.run(end, |board| board.exception() == TIMER0);
        assert!(ticks.unwrap(), "{place}");
        board.hold_off(board.now() + 3 * place, 5 * MILLISECOND);
        firmware.run_for(6 * MILLISECOND);
    }
}

/// After a fault, such as an access through a wild pointer, the pulses end after the current one.
#[test]
fn a_fault_lets_the_servos_go_and_resets_the_chip() {
    let mut firmware = Firmware::booted("default");
    firmware.board.let_faults_be_handled();
    firmware.patch("UARTE0_UART0", UNDEFINED);
    firmware.run_for(50 * MILLISECOND);
    firmware.board.send(b"x");
    firmware.run_for(50 * MILLISECOND);
    let trace = firmware.board.trace();
    // More resets follow, because the faulty instruction is still there.
    let reset = trace.resets[0];
    assert_eq!(reset.cause, ResetCause::Soft);
    let mut before = trace.pwm_periods.iter().rev();
    let last = before.find(|period| period.at < reset.at).unwrap();
    assert!(last.at + last.length <= reset.at, "{last:?}, {reset:?}");
}

/// If the tick cannot access the receiver, because the receiver's cell is empty or in use, the failure is counted and
/// the watchdog is not fed.
#[test]
fn a_receiver_that_cannot_be_reached_is_reset_by_the_watchdog() {
    let cell = |firmware: &Firmware| {
        let symbol = firmware.board.image().symbol("RECEIVER").unwrap().clone();
        let mut bytes = vec![0; symbol.size as usize];
        let memory = firmware.board.memory();
        memory.read(symbol.address, &mut bytes).unwrap();
        (symbol.address, bytes)
    };
    // The crystal has not started yet, so the cell is still empty.
    let mut starts = Firmware::at_power_on("default");
    starts.run_for(MILLISECOND / 10);
    let (address, empty) = cell(&starts);
    let mut in_use = cell(&Firmware::booted("default")).1;
    assert_ne!(empty, in_use);
    // The first word of the cell is its count of borrows.
    in_use[..4].copy_from_slice(&1_u32.to_le_bytes());
    for bytes in [empty, in_use] {
        let mut firmware = Firmware::booted("default");
        firmware.board.patch(address, &bytes).unwrap();
        firmware.run_for(100 * MILLISECOND);
        assert!(firmware.counter("unserved") > 40);
        firmware.run_for(200 * MILLISECOND);
        assert_eq!(firmware.resets(), [ResetCause::Watchdog]);
        firmware.takes_a_frame(MILLISECOND, "after the reset");
    }
}
