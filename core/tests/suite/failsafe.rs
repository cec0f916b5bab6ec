//! Compares the failsafe with the model in its fuzz oracle, and with known outputs at some times.

use std::num::NonZeroU32;
use std::sync::Mutex;

use framelock::motion::{Failsafe, FailsafeError, Output, Phase, Setpoint};
use framelock_fuzz_oracles::{Occurred, Schedule, ScheduleStep, failsafe};
use proptest::prelude::*;

type FailsafeParameters = framelock::motion::FailsafeParameters<u8, 3>;

fn ticks(count: u32) -> NonZeroU32 {
    NonZeroU32::new(count).expect("not zero")
}

const PARK: Setpoint = Setpoint {
    pitch: 128,
    roll: 100,
    yaw: 0,
};

fn parameters() -> FailsafeParameters {
    FailsafeParameters {
        hold_after: 20,
        ramp_after: 50,
        park: PARK.into(),
        ticks_per_unit: [ticks(1), ticks(3), ticks(10)],
    }
}

#[test]
fn parameters_are_checked() {
    let build = |parameters| Failsafe::new(parameters, 0);
    assert!(build(parameters()).is_ok());
    let hold = FailsafeParameters {
        hold_after: 0,
        ..parameters()
    };
    assert_eq!(build(hold), Err(FailsafeError::HoldAtOnce));
    let ramp = FailsafeParameters {
        ramp_after: 19,
        ..parameters()
    };
    assert_eq!(build(ramp), Err(FailsafeError::RampBeforeHold));
    assert!(
        build(FailsafeParameters {
            ramp_after: 20,
            ..parameters()
        })
        .is_ok()
    );
    assert_eq!(
        FailsafeError::HoldAtOnce.to_string(),
        "hold_after is 0 ticks; it must be at least 1"
    );
    assert_eq!(
        FailsafeError::RampBeforeHold.to_string(),
        "ramp_after is less than hold_after"
    );
}

#[test]
fn resumed_it_begins_at_the_output_and_moves_at_its_rate() {
    let output = Setpoint {
        pitch: 130,
        roll: 100,
        yaw: 3,
    };
    let mut failsafe = Failsafe::resumed(parameters(), 7, output).expect("valid");
    let outputs = [7, 8, 9, 16, 17, 37].map(|now| failsafe.poll(now));
    let [at_once, .., parked] = outputs;
    assert_eq!(at_once.axes, <[u8; 3]>::from(output));
    assert_eq!(
        outputs.map(|output| output.axes[0]),
        [130, 129, 128, 128, 128, 128]
    );
    assert_eq!(outputs.map(|output| output.axes[2]), [3, 3, 3, 3, 2, 0]);
    assert_eq!(at_once.phase, Phase::Ramp);
    assert_eq!((parked.axes, parked.phase), (PARK.into(), Phase::Parked));
}

/// Draws demands, half of them so close to each other that an axis soon reaches the next one.
fn demands() -> impl Strategy<Value = [u8; 3]> {
    prop_oneof![any::<[u8; 3]>(), [100..103_u8, 100..103, 100..103]]
}

fn any_parameters() -> impl Strategy<Value = FailsafeParameters> {
    let rate = || (1..12_u32).prop_map(ticks);
    (1..40_u32, 0..40_u32, demands(), [rate(), rate(), rate()]).prop_map(
        |(hold_after, more, park, ticks_per_unit)| FailsafeParameters {
            hold_after,
            ramp_after: hold_after + more,
            park,
            ticks_per_unit,
        },
    )
}

fn long_parameters() -> impl Strategy<Value = FailsafeParameters> {
    let ticks = || (1..=u32::MAX).prop_map(ticks);
    (
        any::<[u32; 2]>(),
        any::<[u8; 3]>(),
        [ticks(), ticks(), ticks()],
    )
        .prop_map(|(mut times, park, ticks_per_unit)| {
            times.sort_unstable();
            FailsafeParameters {
                hold_after: times[0],
                ramp_after: times[1],
                park,
                ticks_per_unit,
            }
        })
}

/// The phases of the random schedules.
static PHASES: Mutex<Occurred> = Mutex::new(Occurred::NOTHING);

#[test]
fn goes_as_the_model_does() {
    any_schedule();
    let missing = PHASES.lock().expect("no count panics").missing();
    assert!(missing.is_empty(), "{missing:?}");
}

proptest! {
    /// The failsafe gives the same outputs as the oracle's model, for frames and polls after short and long waits, even
    /// if the clock wraps.
    fn any_schedule(
        parameters in prop_oneof![any_parameters(), long_parameters()],
        start in prop_oneof![any::<u32>(), u32::MAX - 500..=u32::MAX],
        steps in prop::collection::vec(
            prop_oneof![
                (0..90_u32).prop_map(ScheduleStep::Wait),
                any::<u16>().prop_map(|ticks| ScheduleStep::Wait(ticks.into())),
                any::<u32>().prop_map(ScheduleStep::Wait),
                demands().prop_map(ScheduleStep::Frame),
            ],
            0..60,
        ),
    ) {
        let phases = failsafe(&Schedule { parameters, start, steps }).expect("no contradiction");
        PHASES.lock().expect("no count panics").count_phases(&phases);
    }
}

#[test]
fn a_whole_outage() {
    let mut failsafe = Failsafe::new(parameters(), 0).expect("valid");
    let frame = |failsafe: &mut Failsafe<u8, 3>, now, pitch| {
        failsafe.frame(now, [pitch, PARK.roll, PARK.yaw]);
    };
    let output = |failsafe: &mut Failsafe<u8, 3>, now| {
        let Output { axes, phase } = failsafe.poll(now);
        (phase, axes[0])
    };
    frame(&mut failsafe, 0, 138);
    assert_eq!(output(&mut failsafe, 9), (Phase::Approach, 137));
    assert_eq!(output(&mut failsafe, 10), (Phase::Live, 138));
    assert_eq!(output(&mut failsafe, 19), (Phase::Live, 138));
    assert_eq!(output(&mut failsafe, 20), (Phase::Hold, 138));
    assert_eq!(output(&mut failsafe, 50), (Phase::Ramp, 138));
    assert_eq!(output(&mut failsafe, 55), (Phase::Ramp, 133));
    assert_eq!(output(&mut failsafe, 60), (Phase::Parked, 128));
    // The outputs return from the middle of the ramp.
    frame(&mut failsafe, 1000, 255);
    assert_eq!(output(&mut failsafe, 1000), (Phase::Approach, 128));
    assert_eq!(output(&mut failsafe, 1019), (Phase::Approach, 147));
    // In the phase `Live` a jump of the demand is the sender's choice.
    frame(&mut failsafe, 1019, 147);
    assert_eq!(output(&mut failsafe, 1019), (Phase::Live, 147));
    frame(&mut failsafe, 1020, 0);
    assert_eq!(output(&mut failsafe, 1020), (Phase::Live, 0));
}

/// A silence that is longer than the clock's period is still a silence.
#[test]
fn the_longest_times_do_not_wrap_into_life() {
    let longest = FailsafeParameters {
        hold_after: u32::MAX,
        ramp_after: u32::MAX,
        park: PARK.into(),
        ticks_per_unit: [ticks(u32::MAX), ticks(u32::MAX), ticks(1)],
    };
    let mut failsafe = Failsafe::new(longest, 7).expect("valid");
    failsafe.frame(7, PARK);
    failsafe.frame(7, Setpoint { pitch: 129, ..PARK });
    assert_eq!(failsafe.poll(6).phase, Phase::Ramp);
    let mut now = 6_u32;
    for _ in 0..3 {
        now = now.wrapping_add(u32::MAX / 2);
        assert_ne!(failsafe.poll(now).phase, Phase::Live);
    }
    assert_eq!(failsafe.poll(now).phase, Phase::Parked);
    assert_eq!(longest.parked_after(), u64::from(u32::MAX) * 156);
}

/// Six axes of 16 bits each move at their own rate. Moving down from the top takes `parked_after` minus the time until
/// the ramp.
#[test]
fn six_axes_of_sixteen_bits() {
    let rates = [1, 2, 3, 4, 5, 6];
    let parameters = framelock::motion::FailsafeParameters {
        hold_after: 10,
        ramp_after: 20,
        park: [0_u16, 1, 2, 3, 4, 5],
        ticks_per_unit: rates.map(ticks),
    };
    let mut failsafe = Failsafe::resumed(parameters, 0, [u16::MAX; 6]).expect("valid");
    assert_eq!(
        failsafe.poll(12).axes,
        [12, 6, 4, 3, 2, 2].map(|way| u16::MAX - way)
    );
    let slowest = (u32::from(u16::MAX) - 5) * 6;
    assert_eq!(failsafe.poll(slowest - 1).axes, [0, 1, 2, 3, 4, 6]);
    assert_eq!(failsafe.poll(slowest).phase, Phase::Parked);
    assert_eq!(parameters.parked_after(), u64::from(slowest) + 20);
}
