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
    // Not the whole of a hold in one poll, which would go two ways.
    kani::assume(before >= hold_after || silence < ramp_after);
    let (target, moving) = if before < hold_after {
        (any.at(any.demand), silence.min(hold_after) - before)
    } else {
        (any.at(park), silence.saturating_sub(before.max(ramp_after)))
    };
    // No longer than two units take: a longer poll is rare.
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
/// Length: any; polled at least every other unit
#[kani::proof]
#[kani::unwind(9)]
fn pitch_moves_at_its_rate() {
    spends_every_tick(0);
}

/// S1, S2: likewise.
///
/// Theorem: 10
/// Length: any; polled at least every other unit
/// Run: long
#[kani::proof]
#[kani::unwind(9)]
fn yaw_moves_at_its_rate() {
    spends_every_tick(2);
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
