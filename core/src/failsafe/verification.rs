//! Theorem 10: outside [`Phase::Live`] an axis never moves faster than its rate and loses no tick, so
//! it is at park within [`FailsafeParameters::parked_after`]; there it stays; a frame after silence is
//! no step (S1, S2); all that across the wrap of time (S3). And its part of theorem 1: nothing panics.
//!
//! An axis divides its time by its rate, which solvers cannot follow as a whole. So the proof goes in
//! parts:
//!
//! * Long division, by induction over the eight bits of the quotient ([`division_is_exact`]). The
//!   invariant, once the bits from `bit` on are known: the ticks of the units counted and those left
//!   make up the time, and what is left is less than `1 << bit` units take; or else all these bits are
//!   1, as many units as any way has. At first nothing is counted and no bit is known. At the end as
//!   many units are counted as there is time for, and no tick is lost.
//! * With that many units an axis moves, no further than its target ([`axis_stops_at_its_target`]).
//!   For less than two units' time, both together ([`axis_moves_at_its_rate`]).
//! * The ticks between two polls are given to the way to the demand until the hold, to the way to
//!   park from the ramp on, and nowhere between ([`ticks_are_shared_out`]); and to each axis with its
//!   own rate and target ([`each_axis_has_its_rate`]).

use super::{Axis, Failsafe, FailsafeParameters, NonZeroU32, Phase, Setpoint, division_step};

fn any_setpoint() -> Setpoint {
    kani::any::<[u8; 3]>().into()
}

fn any_axis(ticks_per_unit: NonZeroU32) -> Axis {
    Axis {
        position: kani::any(),
        since_unit: kani::any_where(|&ticks| ticks < ticks_per_unit.get()),
    }
}

/// Any state and parameters, at these rates.
fn any_failsafe(ticks_per_unit: [NonZeroU32; 3]) -> Failsafe {
    let hold_after = kani::any_where(|&ticks| ticks > 0);
    let [pitch, roll, yaw] = ticks_per_unit;
    Failsafe {
        parameters: FailsafeParameters {
            hold_after,
            ramp_after: kani::any_where(|&ticks| ticks >= hold_after),
            park: any_setpoint(),
            ticks_per_unit,
        },
        now: kani::any(),
        silence: kani::any(),
        demand: any_setpoint(),
        axes: [any_axis(pitch), any_axis(roll), any_axis(yaw)],
    }
}

/// Silence, and the ticks for the way to the demand and for the one to park, after so many ticks more.
fn shared_out(failsafe: &Failsafe, elapsed: u32) -> (u64, u32, u32) {
    let FailsafeParameters {
        hold_after,
        ramp_after,
        ..
    } = failsafe.parameters;
    let before = failsafe.silence;
    let silence = u64::from(before) + u64::from(elapsed);
    let to_demand = elapsed.min(hold_after.saturating_sub(before));
    let to_park = elapsed.saturating_sub(ramp_after.saturating_sub(before));
    (silence, to_demand, to_park)
}

#[kani::proof]
#[kani::unwind(9)]
fn division_is_exact() {
    let ticks_per_unit: NonZeroU32 = kani::any();
    let unit = u64::from(ticks_per_unit.get());
    let bit: u8 = kani::any_where(|&bit| bit < 8);
    let known = |units: u8, bit: u8| u16::from(units) >> bit;
    let all = |bit: u8| 0xFF_u16 >> bit;
    let holds = |units: u8, left: u64, bit: u8| {
        known(units, bit) << bit == u16::from(units)
            && (left < unit << bit || known(units, bit) == all(bit))
    };
    let units: u8 = kani::any();
    // Time is less than two counters of 32 bits.
    let left: u64 = kani::any_where(|&left| left < 2 << u32::BITS);
    kani::assume(holds(units, left, bit + 1));

    let (after, left_after) = division_step(units, left, ticks_per_unit, u32::from(bit));
    let counted = after - units;
    assert!(counted == 0 || counted == 1 << bit);
    assert!(left_after + if counted == 0 { 0 } else { unit << bit } == left);
    assert!(holds(after, left_after, bit));
    kani::cover!(bit == 0 && left_after < unit, "fewer than any way has");
    kani::cover!(bit == 0 && left_after >= unit, "more");
}

#[kani::proof]
#[kani::unwind(9)]
fn axis_stops_at_its_target() {
    let (position, target, units): (u8, u8, u8) = kani::any();
    let left: u32 = kani::any();
    let mut axis = Axis {
        position,
        since_unit: kani::any(),
    };
    axis.advance(target, units, u64::from(left));
    let way = position.abs_diff(target);
    assert!(position.abs_diff(axis.position) == way.min(units));
    assert!(axis.position.abs_diff(target) == way - way.min(units));
    let is_there = axis.position == target;
    assert!(axis.since_unit == if is_there { 0 } else { left });
    kani::cover!(units > way && way > 0, "it stops");
    kani::cover!(units < way, "it is on its way");
}

#[kani::proof]
#[kani::unwind(9)]
fn axis_moves_at_its_rate() {
    let ticks_per_unit: NonZeroU32 = kani::any();
    let rate = u64::from(ticks_per_unit.get());
    let before = any_axis(ticks_per_unit);
    let target: u8 = kani::any();
    let ticks: u32 = kani::any_where(|&ticks| ticks > 0 && u64::from(ticks) < 2 * rate);
    let mut after = before;
    after.approach(target, ticks, ticks_per_unit);
    let moved = after.position.abs_diff(before.position);
    let spent = match moved {
        0 => 0,
        1 => rate,
        2 => 2 * rate,
        _ => u64::MAX,
    };
    let ticks = u64::from(ticks) + u64::from(before.since_unit);
    assert!(spent <= ticks);
    let way = before.position.abs_diff(target);
    assert!(after.position.abs_diff(target) + moved == way);
    assert!(after.position == target || spent + u64::from(after.since_unit) == ticks);
    kani::cover!(after.position == target, "it arrives");
    kani::cover!(moved == 2 && after.position != target, "it moves");
}

/// Shown by the ticks of an axis so slow that these make no unit, on its way both times. The others are
/// where they are to be.
#[kani::proof]
#[kani::unwind(9)]
fn ticks_are_shared_out() {
    let mut failsafe = any_failsafe([NonZeroU32::MAX; 3]);
    let [pitch, ..] = failsafe.axes;
    failsafe.axes = super::setpoint_axes(Setpoint::default());
    failsafe.axes[0] = pitch;
    (failsafe.demand.roll, failsafe.demand.yaw) = (0, 0);
    let park = &mut failsafe.parameters.park;
    (park.roll, park.yaw) = (0, 0);
    let parameters = failsafe.parameters;
    let elapsed: u32 = kani::any();
    let (silence, to_demand, to_park) = shared_out(&failsafe, elapsed);
    let ticks = pitch.since_unit.checked_add(to_demand);
    let ticks = ticks.and_then(|ticks| ticks.checked_add(to_park));
    kani::assume(ticks.is_some_and(|ticks| ticks < u32::MAX));
    kani::assume(failsafe.demand.pitch != pitch.position);
    kani::assume(parameters.park.pitch != pitch.position);

    let output = failsafe.poll(failsafe.now.wrapping_add(elapsed));
    assert!(output.setpoint.pitch == pitch.position);
    assert!(Some(failsafe.axes[0].since_unit) == ticks);
    let phase = match silence {
        _ if silence < u64::from(parameters.hold_after) => Phase::Approach,
        _ if silence < u64::from(parameters.ramp_after) => Phase::Hold,
        _ => Phase::Ramp,
    };
    assert!(output.phase == phase);
    kani::cover!(phase == Phase::Hold, "held");
    kani::cover!(to_demand > 0 && to_park > 0, "a whole hold in one poll");
}

#[kani::proof]
#[kani::unwind(9)]
fn each_axis_has_its_rate() {
    const RATES: [u8; 3] = [2, 3, 4];
    let mut failsafe = any_failsafe(RATES.map(|rate| NonZeroU32::new(rate.into()).unwrap()));
    let elapsed: u32 = kani::any();
    let (_, to_demand, to_park) = shared_out(&failsafe, elapsed);
    kani::assume(to_demand == 0 || to_park == 0);
    let moving = to_demand + to_park;
    kani::assume(0 < moving && moving < 6);
    let ticks = moving.to_le_bytes()[0];
    let target: [u8; 3] = if to_demand > 0 {
        failsafe.demand.into()
    } else {
        failsafe.parameters.park.into()
    };
    let before = failsafe.axes;

    let now = failsafe.now;
    let output: [u8; 3] = failsafe.poll(now.wrapping_add(elapsed)).setpoint.into();
    let mut axis = 0;
    while axis < 3 {
        let time = ticks + before[axis].since_unit.to_le_bytes()[0];
        let way = before[axis].position.abs_diff(target[axis]);
        let moved = way.min(time / RATES[axis]);
        assert!(before[axis].position.abs_diff(output[axis]) == moved);
        assert!(output[axis].abs_diff(target[axis]) == way - moved);
        axis += 1;
    }
    kani::cover!(now.wrapping_add(elapsed) < now, "time wraps");
    kani::cover!(moving < elapsed, "part of the time");
}

/// A frame moves nothing at once unless the output was live; nor does a start from any output.
#[kani::proof]
#[kani::unwind(9)]
fn frame_is_no_step() {
    let mut failsafe = any_failsafe([kani::any(), NonZeroU32::MIN, NonZeroU32::MIN]);
    let now = failsafe.now;
    let output = any_setpoint();
    let is_resumed: bool = kani::any();
    if is_resumed {
        failsafe = Failsafe::resumed(failsafe.parameters, now, output).unwrap();
    }
    let before = failsafe.poll(now);
    assert!(!is_resumed || before.setpoint == output && before.phase != Phase::Live);
    let setpoint = any_setpoint();
    failsafe.frame(now, setpoint);
    let after = failsafe.poll(now);
    let was_live = before.phase == Phase::Live;
    let expected = if was_live { setpoint } else { before.setpoint };
    assert!(after.setpoint == expected);
    let is_live = after.phase == Phase::Live;
    assert!(is_live == (expected == setpoint) && (is_live || after.phase == Phase::Approach));
    kani::cover!(was_live, "live");
    kani::cover!(before.phase == Phase::Parked && !is_live, "back from park");
    kani::cover!(is_resumed && before.phase == Phase::Ramp, "resumed");
}

#[kani::proof]
#[kani::unwind(9)]
fn parked_is_parked() {
    let rate: NonZeroU32 = kani::any();
    let mut failsafe = any_failsafe([rate, NonZeroU32::MIN, NonZeroU32::MIN]);
    let output = failsafe.poll(failsafe.now);
    kani::assume(output.phase == Phase::Parked);
    assert!(output.setpoint == failsafe.parameters.park);
    assert!(failsafe.poll(kani::any()) == output);
    kani::cover!(rate.get() > 1, "a slow axis");
}

/// Any parameters, state and times. `frame` begins with a `poll`.
#[kani::proof]
#[kani::unwind(9)]
fn no_panic() {
    let parameters = FailsafeParameters {
        hold_after: kani::any(),
        ramp_after: kani::any(),
        park: any_setpoint(),
        ticks_per_unit: kani::any(),
    };
    let _ = parameters.parked_after();
    let now = kani::any();
    let built = Failsafe::new(parameters, now);
    let is_valid = parameters.hold_after > 0 && parameters.ramp_after >= parameters.hold_after;
    assert!(built.is_ok() == is_valid);
    let state = Failsafe {
        parameters,
        now,
        silence: kani::any(),
        demand: any_setpoint(),
        axes: kani::any::<[(u8, u32); 3]>().map(|(position, since_unit)| Axis {
            position,
            since_unit,
        }),
    };
    // At reset, or in any state.
    let mut failsafe = built.unwrap_or(state);
    if kani::any() {
        failsafe = state;
    }
    failsafe.frame(kani::any(), any_setpoint());
    assert!(failsafe.silence == 0);
    kani::cover!(is_valid, "built");
}
