//! Proves that the parts of the failsafe's `poll` do the same in C and in Rust, from any state that satisfies the
//! invariant, at any time. The output, the phase and the next state are the same.
//!
//! The failsafe has two axes, with demands of 8 or 16 bits. `poll` multiplies the time by a speed. The solver cannot
//! compare such multiplications in C and in Rust in reasonable time, if both factors are large. So `way_is_same`
//! compares the multiplication only for times below 16, and `move_is_same` replaces its result by any distance.

use framelock::motion::{Demand, Failsafe, FailsafeParameters, Phase};

unsafe extern "C" {
    safe fn c_start();
    safe fn c_state(which: u8) -> u32;
    safe fn c_pass(now: u32) -> u32;
    safe fn c_move(slow: u32, fast: u32) -> u8;
    safe fn c_way(per_tick: u32, per_poll: u32, elapsed: u32) -> u32;
    safe fn c_output(axis: u8) -> u32;
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
    let [frames_to_start, ..] = c_state(17).to_le_bytes();
    let parameters = FailsafeParameters {
        park: [demand(c_state(21)), demand(c_state(26))],
        longest_step: c_state(14),
        hold_after: c_state(15),
        ramp_after: c_state(16),
        frames_to_start,
        approach_for: c_state(18),
        approach_travel: c_state(19),
        live_travel: c_state(20),
    };
    let axis = |place| {
        (
            c_state(place),
            c_state(place + 1) != 0,
            c_state(place + 2) != 0,
        )
    };
    Failsafe::in_state(
        parameters,
        [0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map(|which| c_state(which)),
        [[10, 11], [12, 13]].map(|speed| speed.map(|which| c_state(which))),
        [demand(c_state(22)), demand(c_state(27))],
        [axis(23), axis(28)],
    )
}

fn are_related<D: Demand>(failsafe: &Failsafe<D, 2>) {
    let (numbers, demands, axes) = failsafe.state();
    assert!(numbers == [0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map(|which| c_state(which)));
    assert!(units(demands[0]) == c_state(22) && units(demands[1]) == c_state(27));
    let c_axis = |place| {
        (
            c_state(place),
            c_state(place + 1) != 0,
            c_state(place + 2) != 0,
        )
    };
    assert!(axes == [c_axis(23), c_axis(28)]);
}

fn pass_is_same<D: Demand>() {
    let mut failsafe = related::<D>();
    let now: u32 = kani::any();
    let (faults, slow_frames) = (c_state(7), c_state(9));
    assert!(failsafe.call_pass(now) == c_pass(now));
    are_related(&failsafe);
    kani::cover!(c_state(7) != faults, "the time goes backwards");
    kani::cover!(c_state(9) != slow_frames, "a slow frame");
    kani::cover!(c_state(5) == 0 && c_state(3) > 1, "a frame");
}

fn move_is_same<D: Demand>() {
    let mut failsafe = related::<D>();
    let (slow, fast): (u32, u32) = kani::any();
    let before = c_state(23);
    let output = failsafe.call_step([slow, fast]);
    let phase = match output.phase {
        Phase::Live => 0,
        Phase::Approach => 1,
        Phase::Hold => 2,
        Phase::Ramp => 3,
        _ => 4,
    };
    assert!(c_move(slow, fast) == phase);
    assert!(units(output.axes[0]) == c_output(0) && units(output.axes[1]) == c_output(1));
    are_related(&failsafe);
    let has_moved = c_state(23) != before;
    kani::cover!(phase == 3 && has_moved, "an axis moves to park");
    kani::cover!(
        phase == 1 && has_moved,
        "an axis moves to the demand slowly"
    );
    kani::cover!(phase == 0 && has_moved, "an axis moves to the demand");
}

fn way_is_same() {
    let (per_tick, per_poll): (u32, u32) = kani::any();
    let elapsed = kani::any::<u8>() & 15;
    let way = Failsafe::<u8, 2>::way([per_tick, per_poll], elapsed.into());
    assert!(way == c_way(per_tick, per_poll, elapsed.into()));
    kani::cover!(way < per_poll, "in time");
    kani::cover!(way == per_poll, "late");
}

mod failsafe8 {
    #[kani::proof]
    #[kani::unwind(17)]
    fn way_is_same() {
        super::way_is_same();
    }

    #[kani::proof]
    #[kani::unwind(17)]
    fn pass_is_same() {
        super::pass_is_same::<u8>();
    }

    #[kani::proof]
    #[kani::unwind(17)]
    fn move_is_same() {
        super::move_is_same::<u8>();
    }
}

mod failsafe16 {
    #[kani::proof]
    #[kani::unwind(17)]
    fn pass_is_same() {
        super::pass_is_same::<u16>();
    }

    #[kani::proof]
    #[kani::unwind(17)]
    fn move_is_same() {
        super::move_is_same::<u16>();
    }
}
