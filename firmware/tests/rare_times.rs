//! Tests of rare times: the wrap of the firmware's clock after 71.6 minutes, and hours without an event. The emulator
//! skips most of this time.

use nrf52840_emulator::{LineSymbol, MILLISECOND, ResetCause, Trace};

use crate::bounds::Recorded;
use crate::firmware::{Firmware, frame};
use crate::outputs::{pulse, pulses};

/// TIMER0, the firmware's clock, counts microseconds.
const TIMER0: u32 = 0x4000_8000;
const INTENSET: u32 = 0x304;
/// The firmware does not use this capture.
const CAPTURE_3: u32 = 0x04C;
const CC_3: u32 = 0x54C;

/// Returns the clock's count.
fn count(firmware: &mut Firmware) -> u32 {
    firmware.board.set_register(TIMER0 + CAPTURE_3, 1).unwrap();
    firmware.board.register(TIMER0 + CC_3).unwrap()
}

/// Skips the time until the clock has this count. Between two skips of at most a quarter of the clock's range, the main
/// loop runs a few times.
fn skip_to(firmware: &mut Firmware, then: u32) {
    loop {
        let rest = then.wrapping_sub(count(firmware));
        let skipped = rest.min(1 << 30);
        firmware.board.skip_counts(skipped).unwrap();
        if skipped == rest {
            break;
        }
        firmware.run_for(5 * MILLISECOND);
    }
}

/// Returns firmware whose clock starts this many microseconds before its wrap.
fn starts_before_the_wrap(microseconds: u32) -> Firmware {
    let mut firmware = Firmware::at_power_on("default");
    while firmware.board.register(TIMER0 + INTENSET).unwrap() == 0 {
        firmware.run_for(1);
    }
    let skipped = microseconds.wrapping_neg();
    firmware.board.skip_counts(skipped).unwrap();
    firmware
}

/// After a wrap, the clock reaches the count of the last error again, but LED2 stays dark. The outputs stay parked, and
/// then start as always.
#[test]
fn hours_of_silence_change_nothing() {
    let mut recorded = Recorded::of(Firmware::booted("default"));
    let firmware = &mut recorded.firmware;
    firmware.drive(1_500, 10, |_| [255, 0, 128]);
    firmware.send_symbols_and_wait(&[LineSymbol::BadStop(0)], 20 * MILLISECOND);
    assert!(firmware.leds()[1]);
    let at = count(firmware);
    firmware.run_for(2_000 * MILLISECOND);
    let before = firmware.counter("bytes");
    let parked_from = firmware.board.now();
    for wraps in 1..=3 {
        skip_to(firmware, at.wrapping_sub(100_000));
        for _ in 0..300 {
            firmware.run_for(MILLISECOND);
            assert_eq!(firmware.leds(), [false, false, true], "{wraps} wraps");
        }
    }
    assert_eq!(firmware.counter("bytes"), before);
    assert!(firmware.resets().is_empty());
    let from = firmware.board.now();
    let mut parked = pulses(firmware, parked_from).into_iter();
    assert!(parked.all(|widths| widths == [pulse(128); 3]));
    firmware.commits();
    firmware.drive(1_000, 10, |_| [255, 0, 128]);
    assert_eq!(firmware.commits(), [[255, 0, 128]; 100]);
    recorded.assert_bounded(from, 2, "an approach");
    let firmware = &mut recorded.firmware;
    firmware.drive(500, 10, |_| [255, 0, 128]);
    let last = pulses(firmware, from).pop();
    assert_eq!(last, Some([pulse(255), pulse(0), pulse(128)]));
}

/// Runs the firmware through every state within six seconds. Each comment states a time at which the clock may wrap,
/// and the firmware's state at that time. Returns everything that the firmware shows: commits, pulses, pins and resets;
/// the counters; and the log.
fn through_every_state(mut firmware: Firmware) -> (Trace, Vec<u8>, Vec<String>) {
    let frames = |firmware: &mut Firmware, until: u64, every: u64, setpoint| {
        while firmware.board.now() < until * MILLISECOND {
            let next = firmware.board.now() + every * MILLISECOND;
            firmware.board.send(&frame(setpoint));
            firmware.board.run_until(next).unwrap();
        }
    };
    // 1.05 s: an approach.
    frames(&mut firmware, 2_045, 10, [255, 0, 60]);
    // 2.1 s: live, and LED2 shows an error.
    firmware.board.send_symbols(&[LineSymbol::BadStop(0)]);
    frames(&mut firmware, 3_142, 10, [0, 255, 60]);
    // 3.15 s: live, just before the last frame moves the outputs.
    firmware.board.send(&frame(*b"abc"));
    firmware.board.run_until(3_800 * MILLISECOND).unwrap();
    // 4.2 s: parked, with frames that are too far apart. The main loop is interrupted for more than a tick.
    let late_at = 4_190 * MILLISECOND;
    firmware.board.hold_off(late_at, 10 * MILLISECOND);
    frames(&mut firmware, 5_200, 200, [255; 3]);
    // 5.24 s: the main loop is stuck until the watchdog resets the chip.
    firmware.board.stick_main_loop().unwrap();
    firmware.board.run_until(5_900 * MILLISECOND).unwrap();
    let counters = firmware.board.image().symbol("COUNTERS").unwrap().clone();
    let mut bytes = vec![0; counters.size as usize];
    let memory = firmware.board.memory();
    memory.read(counters.address, &mut bytes).unwrap();
    let log = firmware.board.log();
    let mut trace = std::mem::take(firmware.board.trace());
    trace.activations.clear();
    (trace, bytes, log)
}

/// LED3's patterns repeat after 2^20 us. The clock starts a multiple of this time before its wrap, so the patterns are
/// the same in each run.
#[test]
fn a_wrap_of_the_clock_changes_nothing_in_any_state() {
    let (usual, counters, log) = through_every_state(starts_before_the_wrap(0));
    let causes: Vec<_> = usual.resets.iter().map(|reset| reset.cause).collect();
    assert_eq!(causes, [ResetCause::Watchdog]);
    assert!(usual.changes.len() > 200 && usual.pwm_periods.len() > 250);
    for steps in 1..=5 {
        let shown = through_every_state(starts_before_the_wrap(steps << 20));
        // The difference would be too long to print.
        assert!(shown.0 == usual, "{steps}: commits, pulses, LEDs, resets");
        assert_eq!(shown.1, counters, "{steps}");
        assert_eq!(shown.2, log, "{steps}");
    }
}
