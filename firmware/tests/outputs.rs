//! Tests of servos, LEDs, log and watchdog.

use nrf52840_emulator::{LineSymbol, MILLISECOND, ResetCause};

use crate::firmware::{Firmware, RESTART, UNDEFINED, frame, sample};

/// Returns the pulse for a demand, in microseconds.
pub(crate) fn pulse(demand: u64) -> u64 {
    1_000 + 1_000 * demand / 255
}

const PARK: u64 = 128;

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

#[test]
fn from_power_on_the_servos_are_parked() {
    let mut firmware = Firmware::booted("default");
    firmware.run_for(100 * MILLISECOND);
    for widths in pulses(&mut firmware, 0) {
        assert_eq!(widths, [pulse(PARK); 3]);
    }
    assert_eq!(firmware.leds(), [false, false, true]);
}

#[test]
fn silence_holds_then_ramps_then_parks() {
    let mut firmware = Firmware::booted("default");
    parks_in_silence(&mut firmware);
    // No pulse is cut short, even if the PWM begins a new period immediately when it gets new widths.
    let mut firmware = Firmware::booted("default");
    firmware.assume(|all| all.start_cuts_period = true);
    parks_in_silence(&mut firmware);
}

fn parks_in_silence(firmware: &mut Firmware) {
    firmware.drive(1_500, 10, |_| [0, 255, 64]);
    let demand = [pulse(0), pulse(255), pulse(64)];
    assert_eq!(firmware.leds(), [true, false, false]);
    let silent_from = firmware.board.now();
    assert_eq!(pulses(firmware, silent_from - 40 * MILLISECOND)[0], demand);

    firmware.run_for(450 * MILLISECOND);
    let held = pulses(firmware, silent_from);
    assert!(
        held.len() >= 22 && held.iter().all(|widths| *widths == demand),
        "held"
    );
    assert_eq!(firmware.leds(), [false, false, true]);

    let ramp_from = firmware.board.now();
    firmware.run_for(700 * MILLISECOND);
    let ramp = pulses(firmware, ramp_from);
    for pair in ramp.windows(2) {
        for (before, after) in pair[0].iter().zip(pair[1]) {
            // At full travel in a second, the pulse changes by 20 us per period. One unit of demand is 4 us.
            assert!(before.abs_diff(after) <= 20 + 4, "{pair:?}: slowly");
        }
        assert!(
            pair[0][0] <= pair[1][0] && pair[0][1] >= pair[1][1],
            "{pair:?}: to park"
        );
    }
    assert_eq!(ramp.last(), Some(&[pulse(PARK); 3]));
}

#[test]
fn after_a_silence_the_demand_is_approached_and_then_followed() {
    let mut firmware = Firmware::booted("default");
    // An approach takes at least a second. Then a new demand takes effect within the 0.2 s that the outputs take for
    // their travel, and two pulses.
    firmware.drive(1_200, 10, |_| [255; 3]);
    let from = firmware.board.now() + 240 * MILLISECOND;
    firmware.drive(340, 10, |_| [10, 20, 30]);
    let [pitch, roll, yaw] = [10, 20, 30].map(pulse);
    for widths in pulses(&mut firmware, from) {
        assert_eq!(widths, [pitch, roll, yaw]);
    }
}

#[test]
fn led1_goes_out_with_a_dropped_byte_and_comes_back_with_a_frame() {
    let mut firmware = Firmware::booted("default");
    firmware.drive(100, 10, |_| [1, 2, 3]);
    assert!(firmware.leds()[0], "in an approach");
    firmware.drive(1_000, 10, |_| [1, 2, 3]);
    assert_eq!(firmware.leds(), [true, false, false]);
    firmware.send_and_wait(b"?", 10 * MILLISECOND);
    assert_eq!(firmware.leds(), [false; 3]);
    firmware.send_and_wait(&frame([1, 2, 3]), 10 * MILLISECOND);
    assert_eq!(firmware.leds(), [true, false, false]);
}

/// The log's text about a sender that is too slow.
const SLOW: &str = "frames arrive too far apart: fewer than 10 a second (hold_after is 100 ms)";

/// Sends frames, this many milliseconds apart, without running the board.
fn queue(firmware: &mut Firmware, frames: u64, milliseconds: u64, setpoint: [u8; 3]) {
    let now = firmware.board.now();
    firmware.board.line(|line| {
        for n in 0..frames {
            let at = now + n * milliseconds * MILLISECOND;
            for byte in frame(setpoint) {
                line.send(at, LineSymbol::Byte(byte));
            }
        }
    });
}

/// Runs the board for two periods of LED3's slowest pattern, which takes 1.05 s. Asserts for how many milliseconds LED3
/// is lit, how often it goes on, and that the log has this text, and none of the texts about other states.
fn says(firmware: &mut Firmware, lit: [u64; 2], flashes: u64, text: &str) {
    firmware.log("default");
    let (is_lit, has_flashed) = led3(firmware, 2_097);
    assert!((lit[0]..=lit[1]).contains(&is_lit), "{text}: {is_lit} ms");
    assert_eq!(has_flashed, flashes, "{text}");
    let log = firmware.log("default");
    for state in ["no frames", SLOW, "approach", "live"] {
        let is_logged = log.iter().any(|line| line.ends_with(state));
        assert_eq!(is_logged, state == text, "{state}: {log:#?}");
    }
}

#[test]
fn led3_and_the_log_say_why_nothing_moves() {
    let mut firmware = Firmware::booted("default");
    says(&mut firmware, [2_097; 2], 0, "no frames");

    queue(&mut firmware, 27, 200, [255, 0, 255]);
    firmware.run_for(3_100 * MILLISECOND);
    says(&mut firmware, [515, 535], 4, SLOW);
    let widths = pulses(&mut firmware, 0);
    assert!(widths.iter().all(|widths| *widths == [pulse(PARK); 3]));

    // The sender falls silent. A single frame a second later does not count as a slow sender.
    firmware.run_for(2_000 * MILLISECOND);
    firmware.send_and_wait(&frame([1, 2, 3]), 0);
    says(&mut firmware, [2_097; 2], 0, "no frames");
}

#[test]
fn led3_blinks_evenly_in_an_approach_and_is_off_when_the_outputs_are_live() {
    let mut firmware = Firmware::booted("default");
    queue(&mut firmware, 400, 20, [255, 0, 255]);
    firmware.run_for(100 * MILLISECOND);
    let (lit, flashes) = led3(&mut firmware, 786);
    assert!((380..=406).contains(&lit), "{lit} ms");
    assert_eq!(flashes, 3);
    firmware.run_for(1_200 * MILLISECOND);
    let log = firmware.log("default");
    assert!(
        log.iter().any(|line| line.ends_with("approach")),
        "{log:#?}"
    );
    says(&mut firmware, [0, 0], 0, "live");
}

/// A sender that is just fast enough starts the servos.
#[test]
fn twelve_frames_a_second_suffice() {
    let mut firmware = Firmware::booted("default");
    queue(&mut firmware, 60, 83, [255, 0, 255]);
    firmware.run_for(2_500 * MILLISECOND);
    says(&mut firmware, [0, 0], 0, "live");
}

#[test]
fn led2_shows_an_error_for_a_moment() {
    let mut firmware = Firmware::booted("default");
    for _ in 0..2 {
        assert!(!firmware.leds()[1]);
        firmware.board.send_symbols(&[LineSymbol::BadStop(0)]);
        firmware.run_for(20 * MILLISECOND);
        assert!(firmware.leds()[1]);
        firmware.run_for(200 * MILLISECOND);
    }
    assert!(!firmware.leds()[1]);
}

#[test]
fn a_stuck_main_loop_is_reset_by_the_watchdog_and_that_is_logged() {
    let mut firmware = Firmware::booted("default");
    firmware.run_for(2_000 * MILLISECOND);
    assert!(
        firmware.board.trace().resets.is_empty(),
        "fed while all is well"
    );
    firmware.log("default");

    firmware.board.stick_main_loop().unwrap();
    let stuck_at = firmware.board.now();
    firmware.run_for(400 * MILLISECOND);
    let [reset] = firmware.board.trace().resets.as_slice() else {
        panic!("{:?}", firmware.board.trace().resets);
    };
    assert_eq!(reset.cause, ResetCause::Watchdog);
    assert!(reset.at - stuck_at < 260 * MILLISECOND);
    let log = firmware.log("default").join("\n");
    assert!(log.contains("reset by watchdog"), "{log}");
    // Now the firmware works again.
    firmware.commits();
    firmware.takes_a_frame(RESTART, "after the reset");
}

/// If a handler ends just before a tick, the main loop is awake when the tick comes. The line has a break, so no byte
/// wakes the main loop later. The time between two breaks is long enough for a restart of the UARTE, because a receiver
/// that is switched off would miss a break.
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
/// request a tick whose time has already passed. It must not sleep until this tick.
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

/// If the main loop runs but the receive handler does not, the watchdog is not fed: neither in silence, nor while the
/// servos follow the demand and while they are held.
#[test]
fn a_dead_receiver_is_reset_by_the_watchdog() {
    for driven in [0, 1_500] {
        let mut firmware = Firmware::booted("default");
        firmware.drive(driven, 10, |_| [255, 0, 255]);
        // `bx lr`: the handler returns immediately.
        let code = firmware.patch("UARTE0_UART0", [0x70, 0x47]);
        let dead_from = firmware.board.now();
        firmware.run_for(300 * MILLISECOND);
        firmware.patch("UARTE0_UART0", code);
        assert_eq!(firmware.resets(), [ResetCause::Watchdog]);
        let reset = firmware.board.trace().resets[0].at;
        assert!(reset - dead_from < 260 * MILLISECOND);
    }
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

#[test]
fn the_log_tells_of_boot_lock_and_counters() {
    let mut firmware = Firmware::booted("default");
    firmware.drive(200, 10, |_| [1, 2, 3]);
    let log = firmware.log("default").join("\n");
    for part in ["boot at 115200 baud; reset by power", "lock gained"] {
        assert!(log.contains(part), "{part:?} is missing in: {log}");
    }
    firmware.run_for(1_100 * MILLISECOND);
    let log = firmware.log("default");
    let counted = log.iter().filter(|line| line.contains("bytes 140 "));
    assert_eq!(counted.count(), 1, "once a second: {log:#?}");
    let log = log.join("\n");
    for part in ["lock lost", "frames 20 ", "skipped 0 restarts 0 unserved 0"] {
        assert!(log.contains(part), "{part:?} is missing in: {log}");
    }
}
