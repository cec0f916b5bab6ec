//! Compares the failsafe with the model in its fuzz oracle, and with known outputs at some times.

use std::sync::Mutex;

use framelock::motion::{Failsafe, FailsafeError, Phase, Setpoint};
use framelock_oracles::{Occurred, Schedule, ScheduleStep, failsafe};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

type FailsafeParameters = framelock::motion::FailsafeParameters<u8, 3>;

/// The firmware's parameters: a clock of microseconds, and polls every 2 ms.
const FIRMWARE: FailsafeParameters = FailsafeParameters::for_clock(1_000_000, TICK, [128; 3]);
const TICK: u32 = 2_000;

#[test]
fn the_firmwares_bounds() {
    assert_eq!(FIRMWARE.check(), Ok(()));
    assert_eq!(FIRMWARE.most_per_poll(), 6);
    // 0.5 s, and 128 units at 255 units a second.
    assert_eq!(FIRMWARE.parked_after(), 500_000 + 501_984);
    // 1 s, and the whole travel, 255 / 256 of the range, at 4 278 / 2^32 of the range per tick.
    const { assert!(FIRMWARE.live_after() == 1_000_000 + 1_000_045) };
}

/// The axis with the longest way to park determines `parked_after`, whichever axis it is.
#[test]
fn any_axis_may_be_the_last_to_park() {
    for park in [[255, 128, 90], [128, 0, 128], [90, 128, 255]] {
        let parameters = FailsafeParameters { park, ..FIRMWARE };
        let expected = FailsafeParameters {
            park: [0; 3],
            ..FIRMWARE
        };
        assert_eq!(parameters.parked_after(), expected.parked_after());
        let farthest = park.map(|park| if park > 127 { 0 } else { 255 });
        let mut failsafe = Failsafe::resumed(parameters, 0, farthest).expect("valid");
        let way = parameters.parked_after() - u64::from(parameters.ramp_after);
        let mut polls = (0_u32..).step_by(TICK as usize);
        let parked = polls.find(|now| failsafe.poll(*now).phase == Phase::Parked);
        let late = u64::from(parked.expect("it parks")).abs_diff(way);
        assert!(late <= TICK.into(), "{park:?}: {late}");
    }
}

/// The usual times are right for every clock, not only for one that counts milliseconds.
#[test]
fn the_usual_times_are_the_same_for_every_clock() {
    for clock in [1_000, 1_024, 32_768, 62_500, 16_000_000] {
        let usual = FailsafeParameters::for_clock(clock, 20 * clock / 1_000, [128; 3]);
        for (time, tenths) in [
            (usual.hold_after, 1),
            (usual.ramp_after, 5),
            (usual.approach_for, 10),
            (usual.approach_travel, 10),
            (usual.live_travel, 2),
        ] {
            // Rounded down to whole ticks.
            assert_eq!(time, clock * tenths / 10, "{clock} {tenths}");
        }
        assert_eq!(usual.longest_step, 2 * (20 * clock / 1_000));
        assert_eq!(usual.check(), Ok(()), "{clock}");
    }
}

#[test]
fn parameters_are_checked() {
    use FailsafeError as E;
    let with = |change: fn(&mut FailsafeParameters)| {
        let mut parameters = FIRMWARE;
        change(&mut parameters);
        assert_eq!(Failsafe::new(parameters, 0).err(), parameters.check().err());
        parameters.check().err()
    };
    assert_eq!(with(|p| p.longest_step = 0), Some(E::NoStep));
    assert_eq!(with(|p| p.hold_after = 3_999), Some(E::HoldWithinStep));
    assert_eq!(with(|p| p.hold_after = 4_000), None);
    assert_eq!(with(|p| p.ramp_after = 99_999), Some(E::RampBeforeHold));
    assert_eq!(with(|p| p.ramp_after = 100_000), None);
    assert_eq!(with(|p| p.frames_to_start = 1), Some(E::SingleFrame));
    assert_eq!(with(|p| p.frames_to_start = 2), None);
    assert_eq!(with(|p| p.approach_for = 0), Some(E::NoApproach));
    assert_eq!(with(|p| p.live_travel = 15_999), Some(E::LiveTooFast));
    assert_eq!(with(|p| p.live_travel = 16_000), None);
    assert_eq!(
        with(|p| p.approach_travel = 199_999),
        Some(E::ApproachFasterThanLive)
    );
    assert_eq!(with(|p| p.approach_travel = 0x7FFF_FFFF), None);
    assert_eq!(
        with(|p| p.approach_travel = 0x8000_0000),
        Some(E::ApproachTooSlow)
    );
    assert_eq!(
        E::RampBeforeHold.to_string(),
        "ramp_after is less than hold_after"
    );
}

#[test]
fn resumed_it_begins_at_the_output_and_moves_to_park() {
    let output = Setpoint {
        pitch: 130,
        roll: 128,
        yaw: 0,
    };
    let mut failsafe = Failsafe::resumed(FIRMWARE, 7, output).expect("valid");
    let first = failsafe.poll(7);
    assert_eq!((first.axes, first.phase), (output.into(), Phase::Ramp));
    let yaws: Vec<u8> = (1..=252)
        .map(|tick| failsafe.poll(7 + TICK * tick).axes[2])
        .collect();
    assert_eq!(
        [yaws[0], yaws[1], yaws[9], yaws[99], yaws[251]],
        [0, 1, 5, 50, 128]
    );
    assert_eq!(failsafe.poll(8 + TICK * 252).phase, Phase::Parked);
}

/// Even with the largest times that `check` accepts, the output is bounded, and an approach ends.
#[test]
fn the_largest_parameters() {
    let parameters = FailsafeParameters {
        park: [128; 3],
        longest_step: u32::MAX / 8,
        hold_after: u32::MAX,
        ramp_after: u32::MAX,
        frames_to_start: u8::MAX,
        approach_for: u32::MAX,
        approach_travel: u32::MAX / 2,
        live_travel: u32::MAX / 2,
    };
    assert_eq!(parameters.check(), Ok(()));
    // A quarter of 255 units, rounded up.
    assert!(parameters.most_per_poll() <= 64);
    let mut failsafe = Failsafe::new(parameters, 0).expect("valid");
    let (mut now, mut clock) = (0, 0_u32);
    let mut poll = |has_frame| {
        if has_frame {
            failsafe.frame([255; 3]);
        }
        now += u64::from(parameters.longest_step);
        clock = clock.wrapping_add(parameters.longest_step);
        (now, failsafe.poll(clock))
    };
    for _ in 1..255 {
        assert_eq!(poll(true).1.axes, [128; 3]);
    }
    let (start, output) = poll(true);
    assert_eq!(output.phase, Phase::Approach);
    let live = loop {
        let (now, output) = poll(true);
        if output.phase == Phase::Live {
            break now - start;
        }
    };
    assert!(u64::from(parameters.approach_for) <= live);
    assert!(live < parameters.live_after() + u64::from(parameters.longest_step));
    let last = loop {
        let (now, output) = poll(false);
        if output.phase != Phase::Live {
            break now;
        }
    };
    let parked = loop {
        let (now, output) = poll(false);
        if output.phase == Phase::Parked {
            break now;
        }
    };
    assert!(parked - last <= parameters.parked_after());
}

/// Draws demands, half of them so close to each other that an axis soon reaches the next one.
fn demands() -> impl Strategy<Value = [u8; 3]> {
    prop_oneof![any::<[u8; 3]>(), [100..103_u8, 100..103, 100..103]]
}

fn any_parameters(most: u32) -> impl Strategy<Value = FailsafeParameters> {
    let time = move || 1..=most;
    (
        [time(), time(), time(), time(), time(), time()],
        2..6_u8,
        demands(),
    )
        .prop_map(
            |([longest_step, hold, ramp, approach_for, live, approach], frames_to_start, park)| {
                let live = longest_step
                    .saturating_mul(4)
                    .saturating_add(live - 1)
                    .min(u32::MAX / 2);
                let hold_after = longest_step.saturating_add(hold - 1);
                FailsafeParameters {
                    park,
                    longest_step,
                    hold_after,
                    ramp_after: hold_after.saturating_add(ramp - 1),
                    frames_to_start,
                    approach_for,
                    approach_travel: live.saturating_add(approach - 1).min(u32::MAX / 2),
                    live_travel: live,
                }
            },
        )
}

/// The phases, counters and special cases of the random schedules.
static OCCURRED: Mutex<Occurred> = Mutex::new(Occurred::NOTHING);

#[test]
fn goes_as_the_model_does() {
    any_schedule();
    // The parameters never contradict each other.
    let errors = [
        "approach faster than live",
        "approach too slow",
        "hold within step",
        "live too fast",
        "no approach",
        "no step",
        "ramp before hold",
        "single frame",
    ];
    assert_eq!(OCCURRED.lock().expect("no panic").rarer_than(10), errors);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1_000, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// The failsafe gives the same outputs as the oracle's model, for frames and polls after short and long waits, even
    /// if the clock wraps.
    fn any_schedule(
        parameters in prop_oneof![any_parameters(20), any_parameters(300), any_parameters(1 << 28)],
        start in prop_oneof![any::<u32>(), u32::MAX - 500..=u32::MAX],
        steps in prop::collection::vec(
            prop_oneof![
                1 => Just(ScheduleStep::Wait(u32::MAX / 2)),
                4 => (0..20_u32).prop_map(ScheduleStep::Wait),
                2 => (0..400_u32).prop_map(ScheduleStep::Wait),
                1 => (0..400_u32).prop_map(|ticks| ScheduleStep::Wait(0_u32.wrapping_sub(ticks))),
                1 => any::<u32>().prop_map(ScheduleStep::Wait),
                8 => demands().prop_map(ScheduleStep::Frame),
            ],
            0..200,
        ),
        is_punctual: bool,
    ) {
        // If `is_punctual`, no poll is late, so an approach ends within `live_after`.
        let limit = if is_punctual { parameters.longest_step } else { u32::MAX };
        let steps = steps.into_iter().map(|step| match step {
            ScheduleStep::Wait(ticks) if ticks > limit => ScheduleStep::Wait(ticks % limit + 1),
            other => other,
        });
        let steps = steps.collect();
        failsafe(&Schedule { parameters, start, steps }, &mut OCCURRED.lock().expect("no panic"));
    }
}
