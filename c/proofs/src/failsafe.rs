//! Proves that the failsafe's `poll` and `frame` do the same in C and in Rust, from any state that
//! satisfies the invariant. The output, the phase and the next state are the same.
//!
//! The failsafe has two axes, with demands of 8 or 16 bits. At most `TICKS` ticks pass, and a unit
//! takes at most `RATE` ticks. C and Rust divide by different methods, and for larger numbers the
//! solver cannot compare these methods in reasonable time. All other numbers are arbitrary.

use core::num::NonZeroU32;

use framelock::motion::{Demand, Failsafe, FailsafeParameters, Phase};

const TICKS: u32 = 15;
const RATE: u32 = 3;

unsafe extern "C" {
    safe fn c_start();
    safe fn c_state(which: u8) -> u32;
    safe fn c_poll(now: u32) -> u8;
    safe fn c_output(axis: u8) -> u32;
    safe fn c_demand(axis: u8, demand: u16);
    safe fn c_frame(now: u32);
}

fn demand<D: Demand>(number: u32) -> D {
    let [low, high, ..] = number.to_le_bytes();
    u16::from_le_bytes([low, high])
        .try_into()
        .unwrap_or_default()
}

fn units<D: Demand>(demand: D) -> u32 {
    let units: u16 = demand.into();
    units.into()
}

/// Puts the C failsafe into an arbitrary state. Returns a Rust failsafe in the same state.
fn related<D: Demand>() -> Failsafe<D, 2> {
    c_start();
    let rate = |place| {
        let rate = c_state(place);
        kani::assume(rate <= RATE);
        NonZeroU32::new(rate).unwrap_or(NonZeroU32::MIN)
    };
    let parameters = FailsafeParameters {
        hold_after: c_state(2),
        ramp_after: c_state(3),
        park: [demand(c_state(4)), demand(c_state(9))],
        ticks_per_unit: [rate(5), rate(10)],
    };
    let axis = |place| (demand(c_state(place)), c_state(place + 1));
    let demands = [demand(c_state(6)), demand(c_state(11))];
    Failsafe::in_state(
        parameters,
        [c_state(0), c_state(1)],
        demands,
        [axis(7), axis(12)],
    )
}

fn are_related<D: Demand>(failsafe: &Failsafe<D, 2>) {
    let ([now, silence], demands, axes) = failsafe.state();
    assert!(now == c_state(0) && silence == c_state(1));
    assert!(units(demands[0]) == c_state(6) && units(demands[1]) == c_state(11));
    let is_same = |(position, since): (D, u32), place| {
        units(position) == c_state(place) && since == c_state(place + 1)
    };
    assert!(is_same(axes[0], 7) && is_same(axes[1], 12));
}

/// Returns a time at most `TICKS` ticks after the last call.
fn any_time() -> u32 {
    c_state(0).wrapping_add(kani::any_where(|&ticks| ticks <= TICKS))
}

fn poll_is_same<D: Demand>() {
    let mut failsafe = related::<D>();
    let now = any_time();
    let before = c_state(7);
    let output = failsafe.poll(now);
    let phase = match output.phase {
        Phase::Live => 0,
        Phase::Approach => 1,
        Phase::Hold => 2,
        Phase::Ramp => 3,
        _ => 4,
    };
    assert!(c_poll(now) == phase);
    assert!(units(output.axes[0]) == c_output(0) && units(output.axes[1]) == c_output(1));
    are_related(&failsafe);
    kani::cover!(
        phase == 3 && c_output(0).abs_diff(before) > 2,
        "an axis moves to park"
    );
    kani::cover!(
        phase == 1 && c_output(0).abs_diff(before) > 2,
        "an axis moves to the demand"
    );
}

fn frame_is_same<D: Demand>() {
    let mut failsafe = related::<D>();
    let now = any_time();
    let demands: [u16; 2] = kani::any();
    let of_type = demands.map(|one| demand::<D>(one.into()));
    c_demand(0, units(of_type[0]).try_into().unwrap_or(0));
    c_demand(1, units(of_type[1]).try_into().unwrap_or(0));
    failsafe.frame(now, of_type);
    c_frame(now);
    are_related(&failsafe);
    kani::cover!(c_state(7) != c_state(6), "an axis is not at its demand");
    kani::cover!(c_state(7) == c_state(6), "an axis is at its demand");
}

mod failsafe8 {
    #[kani::proof]
    #[kani::unwind(17)]
    fn poll_is_same() {
        super::poll_is_same::<u8>();
    }

    #[kani::proof]
    #[kani::unwind(17)]
    fn frame_is_same() {
        super::frame_is_same::<u8>();
    }
}

mod failsafe16 {
    #[kani::proof]
    #[kani::unwind(17)]
    fn poll_is_same() {
        super::poll_is_same::<u16>();
    }

    #[kani::proof]
    #[kani::unwind(17)]
    fn frame_is_same() {
        super::frame_is_same::<u16>();
    }
}
