//! Tests of the debug port, of the outputs after power-on, and of the PWM's updates. Other tests of start-up are
//! scripts: see `start.txt`.

use nrf52840_emulator::{MILLISECOND, ResetCause};

use crate::firmware::{Firmware, NVMC_CONFIG, UICR, frame};
use crate::image::MOST_FLASH;
use crate::outputs::{pulse, pulses};

const SERVO: [u64; 3] = [1_784, 1_196, 1_352];
/// The setpoint for which the servos get the pulses `SERVO`.
const DEMAND: [u8; 3] = [200, 50, 90];
/// The pulses of the park position.
const PARK: [u64; 3] = [1_501; 3];

/// Sends a hundred frames a second for 0.6 s. Asserts that the servos then get the pulses `SERVO`.
fn live(firmware: &mut Firmware) {
    firmware.drive(600, 10, |_| DEMAND);
    let now = firmware.board.now();
    let pulses = pulses(firmware, now - 25 * MILLISECOND);
    assert!(!pulses.is_empty() && pulses.iter().all(|widths| *widths == SERVO));
}

/// A board may use the kit's reset pin for another purpose, or have words of its own in UICR. So only the image
/// `write-uicr` writes UICR, and it writes only erased words. Every image opens the debug port if UICR allows it. The
/// words of UICR take effect at a reset.
#[test]
fn only_one_image_writes_to_uicr_and_every_image_opens_the_debug_port() {
    const ERASED: u32 = u32::MAX;
    let [words, ours] = [UICR.map(|(word, _)| word), UICR.map(|(_, value)| value)];
    let each = |value: &dyn Fn(usize) -> u32| [0, 1, 2].map(value);
    let states = (0..8).map(|mask| each(&|n| if mask >> n & 1 == 1 { ours[n] } else { ERASED }));
    for state in states.chain([[21, 22, 0]]) {
        for image in MOST_FLASH
            .map(|(image, _)| image)
            .into_iter()
            .chain(["self-test"])
        {
            let what = format!("{image}: {state:x?}");
            let mut firmware = Firmware::on_an_erased_chip(image);
            firmware.write_uicr(words.into_iter().zip(state));
            firmware.board.reset();
            let (mut expected, mut resets) = (state, vec![ResetCause::Pin]);
            if image == "write-uicr" && state.contains(&ERASED) {
                resets.push(ResetCause::Soft);
                expected = each(&|n| {
                    if state[n] == ERASED {
                        ours[n]
                    } else {
                        state[n]
                    }
                });
            }
            firmware.run_for(5 * MILLISECOND);
            let read = words.map(|word| firmware.board.register(word).unwrap());
            assert_eq!(read, expected, "{what}");
            assert_eq!(firmware.board.register(NVMC_CONFIG).unwrap(), 0, "{what}");
            assert_eq!(firmware.resets(), resets, "{what}");
            let is_open = firmware.board.debug_port_is_open();
            assert_eq!(is_open, expected[2] == 0x5A, "{what}");
        }
    }
}

/// After power-on, RAM has arbitrary contents.
#[test]
fn after_power_on_the_outputs_begin_at_park() {
    let mut firmware = Firmware::booted("default");
    live(&mut firmware);
    let image = firmware.board.image();
    let kept = image.symbol("LAST_OUTPUT").unwrap().address;
    let mut bytes = [0; 8];
    firmware.board.memory().read(kept, &mut bytes).unwrap();
    assert_eq!(bytes[..3], DEMAND);
    let first_pulses = |bytes: [u8; 8]| {
        let mut firmware = Firmware::at_power_on("default");
        firmware.board.patch(kept, &bytes).unwrap();
        firmware.run_for(10 * MILLISECOND);
        pulses(&mut firmware, 0)[0]
    };
    assert_eq!(first_pulses(bytes), SERVO);
    // The stored output is ignored if one of its bits is wrong.
    for bit in 0..64 {
        let mut bytes = bytes;
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(first_pulses(bytes), PARK, "bit {bit}");
    }
}

/// The firmware hands new widths to the PWM late in a period, so the widths are recent, and at most once in a period.
#[test]
fn a_flood_starts_the_pwm_once_in_a_period_with_the_newest_setpoint() {
    let mut firmware = Firmware::booted("megabaud");
    live(&mut firmware);
    // The watched word belongs to one of the two sets of widths, so it changes only at every second handover.
    let widths = firmware.board.watch("WIDTHS").unwrap();
    let from = firmware.board.now();
    for n in 0..2_000_u32 {
        // The pitch goes up and down by about a unit per millisecond. The outputs can move faster.
        let [position, ..] = (n / 2 % 510).to_le_bytes();
        let pitch = if n / 2 % 510 > 255 {
            !position
        } else {
            position
        };
        firmware.send_and_wait(&frame([pitch, 0, 0]), MILLISECOND / 2);
    }
    // The least time between two changes of this word, which are two periods apart, in milliseconds. With
    // `start_cuts_period`, SEQSTART shortens the periods.
    let shortest = if firmware.assumptions.start_cuts_period {
        31
    } else {
        38
    };
    let trace = firmware.board.trace();
    let changes = |watch| {
        trace
            .changes
            .iter()
            .filter(move |change| change.watch == watch)
    };
    // Several instructions write the widths, so one handover may cause several changes.
    let mut times: Vec<u64> = changes(widths).map(|change| change.at).collect();
    times.dedup_by(|later, earlier| *later - *earlier < MILLISECOND / 10);
    assert!(times.len() > 10);
    for pair in times.windows(2) {
        assert!(pair[1] - pair[0] >= shortest * MILLISECOND, "{pair:?}");
    }
    let setpoints: Vec<_> = changes(0).collect();
    let periods = trace.pwm_periods.iter();
    for period in periods.filter(|period| period.at > from + 400 * MILLISECOND) {
        let pitch = period.pulses()[0].unwrap();
        // The setpoints that were current at some time in the last 5 ms before the period.
        let new = setpoints.partition_point(|change| change.at + 5 * MILLISECOND < period.at);
        let mut new = setpoints[new - 1..].iter().map(|change| change.value);
        let says = |value: u32| pulse(value.to_le_bytes()[0].into());
        assert!(new.any(|value| pitch == says(value)), "{period:?}");
    }
}
