//! The failsafe: never faster than the rate, parked in time, and right across the wrap of time.

use core::num::NonZeroU32;

use framelock::{Failsafe, FailsafeParameters, Phase, Setpoint};

use super::any_setpoint;

/// A failsafe in any state, of which one axis (all are treated alike) has any rate; a unit of the
/// others takes one tick. So that one division has two unknowns, not three.
struct Any {
    failsafe: Failsafe,
    parameters: FailsafeParameters,
    axis: usize,
    rate: u32,
    now: u32,
    silence: u32,
    demand: Setpoint,
    position: u8,
    since_unit: u32,
}

fn any_failsafe(axis: usize) -> Any {
    let rate: NonZeroU32 = kani::any();
    let mut ticks_per_unit = [NonZeroU32::MIN; 3];
    ticks_per_unit[axis] = rate;
    let parameters = FailsafeParameters {
        hold_after: kani::any_where(|&ticks| ticks > 0),
        ramp_after: kani::any(),
        park: any_setpoint(),
        ticks_per_unit,
    };
    kani::assume(parameters.ramp_after >= parameters.hold_after);
    let (now, silence, demand) = (kani::any(), kani::any(), any_setpoint());
    let positions: [u8; 3] = kani::any();
    let mut since_unit = [0; 3];
    since_unit[axis] = kani::any_where(|&ticks| ticks < rate.get());
    let failsafe = Failsafe::in_state(parameters, (now, silence), demand, positions, since_unit);
    Any {
        failsafe,
        parameters,
        axis,
        rate: rate.get(),
        now,
        silence,
        demand,
        position: positions[axis],
        since_unit: since_unit[axis],
    }
}

impl Any {
    fn at(&self, setpoint: Setpoint) -> u8 {
        <[u8; 3]>::from(setpoint)[self.axis]
    }
}

/// S2: how many units an axis has time for, for any time. Long division, by induction over the
/// bits of the quotient.
///
/// The invariant, once the bits from `bit` on are known: the ticks of the units counted and those
/// left make up the time, and what is left is less than `1 << bit` units take; or else all these
/// bits are 1, more units than any way has. At first nothing is counted and every bit is unknown.
/// At the end what is left is less than a unit takes: as many units are counted as there is time
/// for, and no tick is lost.
///
/// Theorem: 10
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn the_division_is_exact() {
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

    let (after, left_after) = Failsafe::division_step(units, left, ticks_per_unit, bit);
    let counted = after - units;
    assert!(counted == 0 || counted == 1 << bit);
    assert!(left_after + if counted == 0 { 0 } else { unit << bit } == left);
    assert!(holds(after, left_after, bit));
    kani::cover!(bit == 0 && left_after < unit, "fewer than any way has");
    kani::cover!(bit == 0 && left_after >= unit, "more");
}

/// S2: an axis moves as many units as it has time for, towards its target and no further; the
/// ticks left count for the next unit unless it is there.
///
/// Theorem: 10
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn an_axis_stops_at_its_target() {
    let (position, target, units): (u8, u8, u8) = (kani::any(), kani::any(), kani::any());
    let left: u32 = kani::any();
    let (reached, since_unit) = Failsafe::advanced(position, target, units, u64::from(left));
    let way = position.abs_diff(target);
    assert!(position.abs_diff(reached) == way.min(units));
    assert!(reached.abs_diff(target) == way - way.min(units));
    assert!(since_unit == if reached == target { 0 } else { left });
    kani::cover!(units > way && way > 0, "it stops");
    kani::cover!(units < way, "it is on its way");
}

/// A poll moves the axis by as many units as there is time for, until it arrives, and no tick is
/// lost: what does not make a unit counts for the next.
///
/// So the axis is never faster than its rate; and it arrives in the time that its way takes.
fn spends_every_tick(axis: usize) {
    let mut any = any_failsafe(axis);
    let elapsed: u32 = kani::any();
    let FailsafeParameters {
        hold_after,
        ramp_after,
        park,
        ..
    } = any.parameters;
    let (before, silence) = (
        u64::from(any.silence),
        u64::from(any.silence) + u64::from(elapsed),
    );
    let (hold_after, ramp_after) = (u64::from(hold_after), u64::from(ramp_after));
    // The whole of a hold in one poll goes two ways: `a_poll_may_span_a_hold`.
    kani::assume(before >= hold_after || silence < ramp_after);
    let (target, moving) = if before < hold_after {
        (any.at(any.demand), silence.min(hold_after) - before)
    } else {
        (any.at(park), silence.saturating_sub(before.max(ramp_after)))
    };
    // Longer ways: `the_division_is_exact`.
    kani::assume(moving < 2 * u64::from(any.rate));

    let output = any.failsafe.poll(any.now.wrapping_add(elapsed));
    let position = any.at(output.setpoint);
    let moved = position.abs_diff(any.position);
    let spent = match moved {
        0 => 0,
        1 => u64::from(any.rate),
        2 => 2 * u64::from(any.rate),
        _ => u64::MAX,
    };
    let ticks = moving + u64::from(any.since_unit);
    assert!(spent <= ticks);
    assert!(position.abs_diff(target) + moved == any.position.abs_diff(target));
    let left = u64::from(any.failsafe.since_unit()[axis]);
    assert!(position == target || spent + left == ticks);
    kani::cover!(moved == 2 && position != target, "it moves");
    kani::cover!(
        moving < u64::from(elapsed) && moved == 1,
        "it moves for a part of the time"
    );
    kani::cover!(any.now.wrapping_add(elapsed) < any.now, "time wraps");
}

/// S1, S2: from any state, at any rate.
///
/// Theorem: 10
/// Length: any; less than two units in one poll
#[kani::proof]
#[kani::unwind(9)]
fn pitch_moves_at_its_rate() {
    spends_every_tick(0);
}

/// S1, S2: likewise.
///
/// Theorem: 10
/// Length: any; less than two units in one poll
/// Run: long
#[kani::proof]
#[kani::unwind(9)]
fn yaw_moves_at_its_rate() {
    spends_every_tick(2);
}

/// S1, S2: one poll may span the whole of a hold: what lies before it counts on the way to the
/// demand, what lies behind it on the way to park, and the hold itself nowhere. Shown by the ticks of
/// an axis so slow that they make no unit.
///
/// Theorem: 10
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn a_poll_may_span_a_hold() {
    let mut any = any_failsafe(0);
    let elapsed: u32 = kani::any();
    let FailsafeParameters {
        hold_after,
        ramp_after,
        park,
        ..
    } = any.parameters;
    let before = u64::from(any.silence);
    let silence = before + u64::from(elapsed);
    let to_hold = silence.min(u64::from(hold_after)).saturating_sub(before);
    let from_ramp = silence.saturating_sub(before.max(u64::from(ramp_after)));
    let ticks = u64::from(any.since_unit) + to_hold + from_ramp;
    kani::assume(ticks < u64::from(any.rate));
    // It is on its way both times: nowhere is time of no use.
    kani::assume(any.at(any.demand) != any.position && any.at(park) != any.position);

    let output = any.failsafe.poll(any.now.wrapping_add(elapsed));
    assert!(any.at(output.setpoint) == any.position);
    assert!(u64::from(any.failsafe.since_unit()[0]) == ticks);
    assert!(
        output.phase
            == match silence {
                _ if silence < u64::from(hold_after) => Phase::Approach,
                _ if silence < u64::from(ramp_after) => Phase::Hold,
                _ => Phase::Ramp,
            }
    );
    kani::cover!(to_hold > 0 && from_ramp > 0, "a whole hold in one poll");
    kani::cover!(output.phase == Phase::Hold, "held");
}

/// S2: a frame moves nothing at once unless the output was live.
///
/// Theorem: 10
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn a_frame_is_no_step() {
    let mut any = any_failsafe(0);
    let before = any.failsafe.poll(any.now);
    let setpoint = any_setpoint();
    any.failsafe.frame(any.now, setpoint);
    let after = any.failsafe.poll(any.now);
    if before.phase == Phase::Live {
        assert!(after.setpoint == setpoint && after.phase == Phase::Live);
    } else {
        assert!(after.setpoint == before.setpoint);
        assert!(
            after.phase
                == if setpoint == before.setpoint {
                    Phase::Live
                } else {
                    Phase::Approach
                }
        );
    }
    kani::cover!(before.phase == Phase::Live, "live");
    kani::cover!(
        before.phase == Phase::Parked && after.phase == Phase::Approach,
        "back from park"
    );
}

/// S1, S3: an output at park stays there whenever it is looked at, the wrap of time included.
///
/// Theorem: 10
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn parked_is_parked() {
    let mut any = any_failsafe(0);
    let output = any.failsafe.poll(any.now);
    kani::assume(output.phase == Phase::Parked);
    assert!(output.setpoint == any.parameters.park);
    let later = any.failsafe.poll(kani::any());
    assert!(later == output);
    kani::cover!(any.rate > 1, "a slow axis");
}
