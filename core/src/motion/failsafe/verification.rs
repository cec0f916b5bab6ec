//! Theorem 10: outside [`Phase::Live`] an axis never moves faster than its rate and loses no tick. So it
//! reaches park within [`FailsafeParameters::parked_after`], and stays there. A frame after a silence causes no
//! jump (S1, S2). All this also holds when the clock wraps (S3). The failsafe's part of theorem 1 is here, too:
//! nothing panics.
//!
//! An axis divides its time by its rate. Solvers cannot handle this division as a whole, so the proof has four parts:
//!
//! * Long division is exact, by induction over the bits of the quotient, the highest first ([`division_is_exact`]). The
//!   division starts with no units counted and no bits known. Each step makes one more bit known. Let `bit` be the
//!   lowest known bit. The invariant has two parts. First, the ticks for the counted units and the ticks left add up to
//!   the time. Second, the ticks left do not suffice for `1 << bit` units, or all known bits are 1. If all bits are 1,
//!   the quotient is the largest distance that an axis can move. So at the end the division has counted every unit for
//!   which the time suffices, and has lost no tick.
//! * An axis moves by as many units as the quotient says, but no further than its target
//!   ([`axis_stops_at_its_target`]). One harness checks the division and the move together, for times that are shorter
//!   than the time for two units ([`axis_moves_at_its_rate`]).
//! * Every axis is parked after `parked_after` ticks, for some rates ([`parked_in_time`]).
//! * Until the hold begins, ticks move the axis towards the demand. From the hold to the ramp, ticks do not move the
//!   axis. From the ramp on, ticks move the axis towards park ([`ticks_are_shared_out`]). Each axis uses its own rate
//!   and target ([`each_axis_has_its_rate`]).
//!
//! Each part is proved for three axes with demands of 8 bits, as in a setpoint, and for two axes with demands of 16
//! bits. No axis reads the state of another, so an axis behaves the same however many other axes there are.

use super::{Axis, Demand, Failsafe, FailsafeParameters, NonZeroU32, Phase, division_step};

impl<D: Demand, const AXES: usize> Failsafe<D, AXES> {
    /// Creates a failsafe in this state. `axes` contains each axis's position, and the ticks since it last moved by a
    /// unit. The proofs about the failsafe in C use this function.
    pub fn in_state(
        parameters: FailsafeParameters<D, AXES>,
        [now, silence]: [u32; 2],
        demands: [D; AXES],
        axes: [(D, u32); AXES],
    ) -> Self {
        Self {
            parameters,
            now,
            silence,
            demands,
            axes: axes.map(|(position, since_unit)| Axis {
                position,
                since_unit,
            }),
        }
    }

    /// Returns the failsafe's state, without the parameters.
    pub fn state(&self) -> ([u32; 2], [D; AXES], [(D, u32); AXES]) {
        let axes = self.axes.map(|axis| (axis.position, axis.since_unit));
        ([self.now, self.silence], self.demands, axes)
    }
}

fn in_units<D: Demand>(demand: D) -> u16 {
    demand.into()
}

fn any_axis<D: Demand + kani::Arbitrary>(ticks_per_unit: NonZeroU32) -> Axis<D> {
    Axis {
        position: kani::any(),
        since_unit: kani::any_where(|&ticks| ticks < ticks_per_unit.get()),
    }
}

/// Returns a failsafe with these rates, in any state. All other parameters are arbitrary.
fn any_failsafe<D: Demand + kani::Arbitrary, const AXES: usize>(
    ticks_per_unit: [NonZeroU32; AXES],
) -> Failsafe<D, AXES> {
    let hold_after = kani::any_where(|&ticks| ticks > 0);
    Failsafe {
        parameters: FailsafeParameters {
            hold_after,
            ramp_after: kani::any_where(|&ticks| ticks >= hold_after),
            park: kani::any(),
            ticks_per_unit,
        },
        now: kani::any(),
        silence: kani::any(),
        demands: kani::any(),
        axes: ticks_per_unit.map(any_axis),
    }
}

/// Returns the silence after `elapsed` more ticks, the ticks that move the axis to the demand, and the ticks that move
/// it to park.
fn shared_out<D, const AXES: usize>(failsafe: &Failsafe<D, AXES>, elapsed: u32) -> (u64, u32, u32) {
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

fn division_is_exact_to<const BITS: u32>() {
    let ticks_per_unit: NonZeroU32 = kani::any();
    let unit = u64::from(ticks_per_unit.get());
    let bit: u32 = kani::any_where(|&bit| bit < BITS);
    let all = |bit: u32| u16::MAX >> (u16::BITS - BITS) >> bit;
    let known = |units: u16, bit: u32| if bit == BITS { 0 } else { units >> bit };
    let holds = |units: u16, left: u64, bit: u32| {
        let is_all = bit == BITS || known(units, bit) == all(bit);
        units
            == if bit == BITS {
                0
            } else {
                known(units, bit) << bit
            }
            && (left < unit << bit || is_all)
    };
    let units: u16 = kani::any_where(|&units| units <= all(0));
    // The time is the sum of at most two 32-bit counters.
    let left: u64 = kani::any_where(|&left| left < 2 << u32::BITS);
    kani::assume(holds(units, left, bit + 1));

    let (after, left_after) = division_step(units, left, ticks_per_unit, bit);
    let counted = after - units;
    assert!(counted == 0 || counted == 1 << bit);
    assert!(left_after + if counted == 0 { 0 } else { unit << bit } == left);
    assert!(after <= all(0) && holds(after, left_after, bit));
    kani::cover!(
        bit == 0 && left_after < unit,
        "the time suffices for no further unit"
    );
    kani::cover!(
        bit == 0 && left_after >= unit,
        "the time suffices for more units"
    );
}

fn stops_at_its_target<D: Demand + kani::Arbitrary>() {
    let (position, target): (D, D) = kani::any();
    let most = u16::MAX >> (u16::BITS - D::BITS);
    let made: u16 = kani::any_where(|&made| made <= most);
    let left: u32 = kani::any();
    let mut axis = Axis {
        position,
        since_unit: kani::any(),
    };
    axis.advance(target, made, u64::from(left));
    let (from, goal, to) = (
        in_units(position),
        in_units(target),
        in_units(axis.position),
    );
    let way = from.abs_diff(goal);
    assert!(from.abs_diff(to) == way.min(made));
    assert!(to.abs_diff(goal) == way - way.min(made));
    let is_there = axis.position == target;
    assert!(axis.since_unit == if is_there { 0 } else { left });
    kani::cover!(made > way && way > 0, "the axis stops at its target");
    kani::cover!(made < way, "the axis is on its way");
}

fn moves_at_its_rate<D: Demand + kani::Arbitrary>() {
    let ticks_per_unit: NonZeroU32 = kani::any();
    let rate = u64::from(ticks_per_unit.get());
    let before = any_axis::<D>(ticks_per_unit);
    let target: D = kani::any();
    let ticks: u32 = kani::any_where(|&ticks| ticks > 0 && u64::from(ticks) < 2 * rate);
    let mut after = before;
    after.approach(target, ticks, ticks_per_unit);
    let (from, goal, to) = (
        in_units(before.position),
        in_units(target),
        in_units(after.position),
    );
    let moved = to.abs_diff(from);
    let spent = match moved {
        0 => 0,
        1 => rate,
        2 => 2 * rate,
        _ => u64::MAX,
    };
    let ticks = u64::from(ticks) + u64::from(before.since_unit);
    assert!(spent <= ticks);
    let way = from.abs_diff(goal);
    assert!(to.abs_diff(goal) + moved == way);
    assert!(to == goal || spent + u64::from(after.since_unit) == ticks);
    kani::cover!(to == goal, "the axis arrives");
    kani::cover!(moved == 2 && to != goal, "the axis moves");
}

/// Defines one harness for demands of 8 bits and one for 16 bits.
macro_rules! for_demands {
    ($module:ident, $of_8:expr, $of_16:expr) => {
        mod $module {
            #[allow(unused_imports, reason = "some of the modules use nothing of it")]
            use super::*;

            #[kani::proof]
            #[kani::unwind(17)]
            fn of_8_bits() {
                $of_8;
            }

            #[kani::proof]
            #[kani::unwind(17)]
            fn of_16_bits() {
                $of_16;
            }
        }
    };
}
for_demands!(
    division_is_exact,
    division_is_exact_to::<8>(),
    division_is_exact_to::<16>()
);
for_demands!(
    axis_stops_at_its_target,
    stops_at_its_target::<u8>(),
    stops_at_its_target::<u16>()
);
for_demands!(
    axis_moves_at_its_rate,
    moves_at_its_rate::<u8>(),
    moves_at_its_rate::<u16>()
);

/// Observes how many ticks one axis receives. This axis is so slow that its ticks never suffice for a whole unit, even
/// if the ticks towards the demand and the ticks towards park are added up. All other axes are already at their
/// targets.
fn ticks_are_shared<D: Demand + kani::Arbitrary, const AXES: usize>() {
    let mut failsafe = any_failsafe::<D, AXES>([NonZeroU32::MAX; AXES]);
    let first = failsafe.axes[0];
    let (demand, park) = (failsafe.demands[0], failsafe.parameters.park[0]);
    failsafe.axes = [Axis::at(D::default()); AXES];
    failsafe.demands = [D::default(); AXES];
    failsafe.parameters.park = [D::default(); AXES];
    failsafe.axes[0] = first;
    failsafe.demands[0] = demand;
    failsafe.parameters.park[0] = park;
    let parameters = failsafe.parameters;
    let elapsed: u32 = kani::any();
    let (silence, to_demand, to_park) = shared_out(&failsafe, elapsed);
    let ticks = first.since_unit.checked_add(to_demand);
    let ticks = ticks.and_then(|ticks| ticks.checked_add(to_park));
    kani::assume(ticks.is_some_and(|ticks| ticks < u32::MAX));
    kani::assume(demand != first.position);
    kani::assume(park != first.position);

    let output = failsafe.poll(failsafe.now.wrapping_add(elapsed));
    assert!(output.axes[0] == first.position);
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
for_demands!(
    ticks_are_shared_out,
    ticks_are_shared::<u8, 3>(),
    ticks_are_shared::<u16, 2>()
);

fn axes_have_their_rates<D: Demand + kani::Arbitrary, const AXES: usize>(rates: [u8; AXES]) {
    let mut failsafe =
        any_failsafe::<D, AXES>(rates.map(|rate| NonZeroU32::new(rate.into()).unwrap()));
    let elapsed: u32 = kani::any();
    let (_, to_demand, to_park) = shared_out(&failsafe, elapsed);
    kani::assume(to_demand == 0 || to_park == 0);
    let moving = to_demand + to_park;
    kani::assume(0 < moving && moving < 6);
    let ticks = moving.to_le_bytes()[0];
    let target = if to_demand > 0 {
        failsafe.demands
    } else {
        failsafe.parameters.park
    };
    let before = failsafe.axes;

    let now = failsafe.now;
    let output = failsafe.poll(now.wrapping_add(elapsed)).axes;
    let mut axis = 0;
    while axis < AXES {
        let time = ticks + before[axis].since_unit.to_le_bytes()[0];
        let (from, to) = (in_units(before[axis].position), in_units(output[axis]));
        let goal = in_units(target[axis]);
        let way = from.abs_diff(goal);
        let moved = way.min(u16::from(time / rates[axis]));
        assert!(from.abs_diff(to) == moved);
        assert!(to.abs_diff(goal) == way - moved);
        axis += 1;
    }
    kani::cover!(now.wrapping_add(elapsed) < now, "time wraps");
    kani::cover!(moving < elapsed, "part of the time");
}
for_demands!(
    each_axis_has_its_rate,
    axes_have_their_rates::<u8, 3>([2, 3, 4]),
    axes_have_their_rates::<u16, 2>([2, 3])
);

/// A frame causes no jump unless the output was live. A failsafe that is resumed at any output causes no jump either.
fn a_frame_is_no_step<D: Demand + kani::Arbitrary, const AXES: usize>() {
    let mut rates = [NonZeroU32::MIN; AXES];
    rates[0] = kani::any();
    let mut failsafe = any_failsafe::<D, AXES>(rates);
    let now = failsafe.now;
    let output: [D; AXES] = kani::any();
    let is_resumed: bool = kani::any();
    if is_resumed {
        let resumed = Failsafe::resumed(failsafe.parameters, now, output);
        failsafe = resumed.ok().unwrap();
    }
    let before = failsafe.poll(now);
    assert!(!is_resumed || before.axes == output && before.phase != Phase::Live);
    let demands: [D; AXES] = kani::any();
    failsafe.frame(now, demands);
    let after = failsafe.poll(now);
    let was_live = before.phase == Phase::Live;
    let expected = if was_live { demands } else { before.axes };
    assert!(after.axes == expected);
    let is_live = after.phase == Phase::Live;
    assert!(is_live == (expected == demands) && (is_live || after.phase == Phase::Approach));
    kani::cover!(was_live, "live");
    kani::cover!(before.phase == Phase::Parked && !is_live, "back from park");
    kani::cover!(is_resumed && before.phase == Phase::Ramp, "resumed");
}
for_demands!(
    frame_is_no_step,
    a_frame_is_no_step::<u8, 3>(),
    a_frame_is_no_step::<u16, 2>()
);

#[kani::proof]
#[kani::unwind(17)]
fn parked_is_parked() {
    let rate: NonZeroU32 = kani::any();
    let mut failsafe = any_failsafe::<u16, 2>([rate, NonZeroU32::MIN]);
    let output = failsafe.poll(failsafe.now);
    kani::assume(output.phase == Phase::Parked);
    assert!(output.axes == failsafe.parameters.park);
    assert!(failsafe.poll(kani::any()) == output);
    kani::cover!(rate.get() > 1, "a slow axis");
}

/// Every axis is at park when [`FailsafeParameters::parked_after`] ticks have passed since a frame, whatever the
/// demands of the frame are, and wherever the axes are at that time. The bound is exact: if all axes begin as far from
/// park as possible, they are not all at park one tick earlier.
fn parks_in_time<D: Demand + kani::Arbitrary, const AXES: usize>(rates: [u8; AXES]) {
    let rates = rates.map(|rate| NonZeroU32::new(rate.into()).unwrap());
    let mut failsafe = any_failsafe::<D, AXES>(rates);
    failsafe.silence = 0;
    let is_farthest: bool = kani::any();
    if is_farthest {
        let most = u16::MAX >> (u16::BITS - D::BITS);
        let farthest = failsafe.parameters.park.map(|park| {
            let park = in_units(park);
            let end = if park > most / 2 { 0 } else { most };
            D::try_from(end).ok().unwrap()
        });
        failsafe.demands = farthest;
        failsafe.axes = farthest.map(Axis::at);
    }
    let parked_after = u32::try_from(failsafe.parameters.parked_after()).ok();
    kani::assume(parked_after.is_some());
    let at = failsafe.now.wrapping_add(parked_after.unwrap());
    let mut earlier = failsafe;
    assert!(failsafe.poll(at).phase == Phase::Parked);
    let is_parked = earlier.poll(at.wrapping_sub(1)).phase == Phase::Parked;
    assert!(!is_farthest || !is_parked);
    kani::cover!(is_farthest, "as late as can be");
    kani::cover!(is_parked, "earlier");
}
for_demands!(
    parked_in_time,
    parks_in_time::<u8, 2>([2, 3]),
    parks_in_time::<u16, 1>([2])
);

/// Nothing panics, for any parameters, states and times. `frame` calls `poll` first, so this covers `poll`.
fn nothing_panics<D: Demand + kani::Arbitrary, const AXES: usize>() {
    let parameters = FailsafeParameters::<D, AXES> {
        hold_after: kani::any(),
        ramp_after: kani::any(),
        park: kani::any(),
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
        demands: kani::any(),
        axes: parameters.ticks_per_unit.map(|_| Axis {
            position: kani::any(),
            since_unit: kani::any(),
        }),
    };
    // Start either at reset, or in any state.
    let mut failsafe = built.unwrap_or(state);
    if kani::any() {
        failsafe = state;
    }
    failsafe.frame(kani::any(), kani::any::<[D; AXES]>());
    assert!(failsafe.silence == 0);
    kani::cover!(is_valid, "built");
}
for_demands!(
    no_panic,
    nothing_panics::<u8, 3>(),
    nothing_panics::<u16, 2>()
);
