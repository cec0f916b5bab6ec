//! Theorem 10, by induction over the polls. Most harnesses take any parameters, any state that satisfies the invariant,
//! any frame and any time, and poll once. The invariant holds at the start ([`no_panic`]) and after each poll
//! ([`output_is_bounded`]).
//!
//! * Two consecutive outputs of an axis differ by at most `most_per_poll` units in every phase (S4,
//!   [`output_is_bounded`]), and by no more than the axis's speed allows for the time that has passed (S4,
//!   [`speed_is_bounded`]). `most_per_poll` is at most a quarter of the travel, rounded up, for travel times of up
//!   to 5 bits ([`stated_speed`]).
//! * A step of the clock of more than half its range counts as no time. Each smaller step counts in full for a silence
//!   (S3, [`clock_is_checked`]).
//! * Only `frames_to_start` frames in a row end a silence. Until then an axis stays, or moves to park (S1, S2,
//!   [`only_a_row_starts`], [`axis_moves_to_its_target`]), and reaches park in time ([`parked_in_time`]). Fewer frames
//!   change neither the output nor the motion to park ([`few_frames_change_nothing`]). Slow frames are counted
//!   ([`slow_frames_are_counted`]).
//! * A silence ends the fast motion: every axis is then slow ([`silence_stops`]). An axis goes live again only when the
//!   approach has lasted `approach_for` ([`approach_is_slow`]). From then on, each poll makes the axis live or moves it
//!   on in the same direction as far as the slow speed allows ([`approach_ends`]). The travel is finite, so an axis is
//!   live within `live_after`, however the demands move ([`live_in_time`]).
//! * The whole travel takes at least `live_travel` if the axis is live, or else `approach_travel` ([`stated_speed`]).
//!
//! `poll` multiplies the time by a speed. Solvers cannot compare two such products. So only [`no_panic`],
//! [`output_is_bounded`], [`parked_in_time`] and [`live_in_time`] call `poll` itself, the last two with a constant
//! slow speed. The other harnesses replace each product by any distance. Solvers cannot divide by arbitrary numbers, so
//! [`stated_speed`] uses only travel times of up to 5 bits.
//!
//! Most harnesses use three axes with demands of 8 bits, as in a setpoint. Some also use two axes with demands of 16
//! bits, and the harnesses of times and speeds use one axis. No axis reads the state of another, so an axis behaves the
//! same however many other axes there are. The failsafe's part of theorem 1 is here, too: nothing panics.

use super::{Axis, Demand, Failsafe, FailsafeParameters, Output, Phase, Speed};

impl<D: Demand, const AXES: usize> Failsafe<D, AXES> {
    /// Creates a failsafe in this state. The ten numbers are the fields `now` to `had_frame` and the three counters.
    /// The values of an axis are its position, whether the axis is live, and whether it rises. The proofs about the
    /// failsafe in C use this function.
    pub fn in_state(
        parameters: FailsafeParameters<D, AXES>,
        [
            now,
            quiet,
            silence,
            in_row,
            approached,
            frame_waits,
            had_frame,
            clock_faults,
            late_polls,
            slow_frames,
        ]: [u32; 10],
        [slow, fast]: [[u32; 2]; 2],
        demands: [D; AXES],
        axes: [(u32, bool, bool); AXES],
    ) -> Self {
        let [in_row, ..] = in_row.to_le_bytes();
        let speed = |[per_tick, per_poll]: [u32; 2]| Speed { per_tick, per_poll };
        Self {
            parameters,
            slow: speed(slow),
            fast: speed(fast),
            now,
            quiet,
            silence,
            in_row,
            approached,
            has_frame: frame_waits != 0,
            had_frame: had_frame != 0,
            demands,
            axes: axes.map(|(position, is_live, rises)| Axis {
                position,
                is_live,
                rises,
            }),
            clock_faults,
            late_polls,
            slow_frames,
        }
    }

    /// Calls [`pass`](Self::pass).
    pub fn call_pass(&mut self, now: u32) -> u32 {
        self.pass(now)
    }

    /// Calls [`step`](Self::step).
    pub fn call_step(&mut self, ways: [u32; 2]) -> Output<D, AXES> {
        self.step(ways)
    }

    /// Calls [`Speed::way`].
    pub fn way([per_tick, per_poll]: [u32; 2], elapsed: u32) -> u32 {
        Speed { per_tick, per_poll }.way(elapsed)
    }

    /// Returns the failsafe's state, without the parameters and the speeds.
    #[expect(clippy::type_complexity, reason = "the arguments of `in_state`")]
    pub fn state(&self) -> ([u32; 10], [D; AXES], [(u32, bool, bool); AXES]) {
        let numbers = [
            self.now,
            self.quiet,
            self.silence,
            self.in_row.into(),
            self.approached,
            self.has_frame.into(),
            self.had_frame.into(),
            self.clock_faults,
            self.late_polls,
            self.slow_frames,
        ];
        let axes = self
            .axes
            .map(|axis| (axis.position, axis.is_live, axis.rises));
        (numbers, self.demands, axes)
    }
}

fn any_parameters<D: Demand + kani::Arbitrary, const AXES: usize>() -> FailsafeParameters<D, AXES> {
    FailsafeParameters {
        park: kani::any(),
        longest_step: kani::any(),
        hold_after: kani::any(),
        ramp_after: kani::any(),
        frames_to_start: kani::any(),
        approach_for: kani::any(),
        approach_travel: kani::any(),
        live_travel: kani::any(),
    }
}

fn any_speed() -> Speed {
    Speed {
        per_tick: kani::any(),
        per_poll: kani::any(),
    }
}

/// Returns a failsafe in any state that satisfies the invariant, with any speeds.
fn any_failsafe<D: Demand + kani::Arbitrary, const AXES: usize>() -> Failsafe<D, AXES> {
    let parameters = any_parameters();
    kani::assume(parameters.check().is_ok());
    let failsafe = Failsafe {
        parameters,
        slow: any_speed(),
        fast: any_speed(),
        now: kani::any(),
        quiet: kani::any(),
        silence: kani::any(),
        in_row: kani::any(),
        approached: kani::any(),
        has_frame: kani::any(),
        had_frame: kani::any(),
        demands: kani::any(),
        axes: [(); AXES].map(|()| Axis {
            position: kani::any_where(|&position| position <= D::MOST),
            is_live: kani::any(),
            rises: kani::any(),
        }),
        clock_faults: kani::any(),
        late_polls: kani::any(),
        slow_frames: kani::any(),
    };
    kani::assume(failsafe.satisfies_invariant());
    failsafe
}

impl<D: Demand, const AXES: usize> Failsafe<D, AXES> {
    fn follows(&self) -> bool {
        self.in_row >= self.parameters.frames_to_start
    }

    /// An axis is within its travel, and live only in a long enough approach. Without frames, `approached` is 0.
    fn satisfies_invariant(&self) -> bool {
        let is_long = self.approached >= self.parameters.approach_for;
        let may_be_live = self.follows() && is_long;
        self.axes
            .iter()
            .all(|axis| axis.position <= D::MOST && (may_be_live || !axis.is_live))
            && (self.follows() || self.approached == 0)
    }

    /// Returns whether a poll after `elapsed` ticks finds the last frame `hold_after` or more ago.
    fn is_silent(&self, elapsed: u32) -> bool {
        self.quiet.saturating_add(elapsed) >= self.parameters.hold_after
    }
}

/// The states before and after a poll, the time that the poll counts, the most that a slow and a fast axis move in this
/// time, and the output.
struct Step<D, const AXES: usize> {
    before: Failsafe<D, AXES>,
    after: Failsafe<D, AXES>,
    elapsed: u32,
    slow: u32,
    fast: u32,
    output: Output<D, AXES>,
}

/// Polls a failsafe in any state, at any time. Instead of multiplying the time by the speeds, it takes any `slow` and
/// `fast`.
fn any_step<D: Demand + kani::Arbitrary, const AXES: usize>() -> Step<D, AXES> {
    let before = any_failsafe::<D, AXES>();
    let mut after = before;
    let passed: u32 = kani::any();
    let elapsed = if passed >> 31 == 0 { passed } else { 0 };
    let (slow, fast): (u32, u32) = kani::any();
    let counted = after.pass(before.now.wrapping_add(passed));
    assert!(counted == elapsed);
    let output = after.step([slow, fast]);
    Step {
        before,
        after,
        elapsed,
        slow,
        fast,
        output,
    }
}

/// A step moves an axis towards its target by its speed, and not beyond the target.
#[kani::proof]
fn axis_moves_to_its_target() {
    let before = Axis {
        position: kani::any(),
        is_live: kani::any(),
        rises: kani::any(),
    };
    let (target, slow, fast): (u32, u32, u32) = kani::any();
    let mut axis = before;
    axis.step(target, [slow, fast], kani::any());
    let way = before.position.abs_diff(target);
    let moved = way.min(if axis.is_live { fast } else { slow });
    assert!(axis.position.abs_diff(before.position) == moved);
    assert!(axis.position.abs_diff(target) == way - moved);
    assert!(axis.is_live || !before.is_live);
    kani::cover!(moved > 0 && moved < way && axis.is_live, "on its way");
    kani::cover!(moved > 0 && moved == way, "at its target");
}

/// From `ramp_after` on, every axis is at park within `parked_after - ramp_after` ticks, however the polls divide the
/// time up. The bound is exact: an axis that begins as far from park as possible is not at park one tick earlier.
fn parks_in_time<D: Demand + kani::Arbitrary>(approach_travel: u32) {
    let mut failsafe = any_slow_failsafe::<D>(approach_travel);
    kani::assume(!failsafe.follows() && !failsafe.has_frame);
    kani::assume(failsafe.silence >= failsafe.parameters.ramp_after);
    let is_farthest: bool = kani::any();
    if is_farthest {
        let park = failsafe.parameters.park[0].position();
        failsafe.axes[0].position = if park > D::MOST / 2 { 0 } else { D::MOST };
    }
    let parked_after = failsafe.parameters.parked_after();
    let mut left = parked_after - u64::from(failsafe.parameters.ramp_after);
    while left > 0 {
        let elapsed = any_step_within(&failsafe, left);
        left -= u64::from(elapsed);
        let output = failsafe.poll(failsafe.now.wrapping_add(elapsed));
        assert!(!is_farthest || left == 0 || output.phase == Phase::Ramp);
        assert!(left > 0 || output.phase == Phase::Parked);
    }
    kani::cover!(is_farthest, "as late as can be");
    kani::cover!(!is_farthest, "earlier");
}

/// Every axis is live `live_after` ticks after the poll that started the approach, however the demands move and however
/// the polls divide the time up. No axis is live until `approach_for` has passed.
fn goes_live_in_time<D: Demand + kani::Arbitrary>(approach_travel: u32) {
    let mut failsafe = any_slow_failsafe::<D>(approach_travel);
    failsafe.parameters.approach_for = kani::any_where(|&ticks| 0 < ticks && ticks <= 2);
    failsafe.approached = 0;
    failsafe.axes[0].is_live = false;
    failsafe.quiet = 0;
    kani::assume(failsafe.follows());
    // Each poll takes a frame and comes within `longest_step`, so there is no silence.
    kani::assume(failsafe.parameters.longest_step < failsafe.parameters.hold_after);
    let live_after = failsafe.parameters.live_after();
    let mut left = live_after;
    let mut was_late = false;
    while left > 0 {
        let elapsed = any_step_within(&failsafe, left);
        left -= u64::from(elapsed);
        let demand: D = kani::any();
        failsafe.frame([demand]);
        let output = failsafe.poll(failsafe.now.wrapping_add(elapsed));
        let is_early = live_after - left < u64::from(failsafe.parameters.approach_for);
        assert!(!is_early || output.phase == Phase::Approach);
        assert!(left > 0 || output.phase == Phase::Live);
        was_late |= left == 2 && output.phase == Phase::Approach;
    }
    kani::cover!(was_late, "as late as can be");
    kani::cover!(!was_late, "earlier");
}

/// Returns a failsafe in any state, with this `approach_travel`. Its longest step may even be longer than
/// [`check`](FailsafeParameters::check) allows for this travel.
fn any_slow_failsafe<D: Demand + kani::Arbitrary>(approach_travel: u32) -> Failsafe<D, 1> {
    let mut failsafe = any_failsafe::<D, 1>();
    failsafe.parameters.approach_travel = approach_travel;
    failsafe.parameters.longest_step = kani::any_where(|&ticks| 0 < ticks && ticks <= 3);
    kani::assume(failsafe.parameters.longest_step <= failsafe.parameters.hold_after);
    failsafe.slow = failsafe.parameters.slow();
    failsafe
}

/// Returns any time until the next poll, which is at most `longest_step` and at most the time left.
fn any_step_within<D: Demand, const AXES: usize>(failsafe: &Failsafe<D, AXES>, left: u64) -> u32 {
    kani::any_where(|&elapsed| {
        0 < elapsed && elapsed <= failsafe.parameters.longest_step && u64::from(elapsed) <= left
    })
}

/// The whole travel takes at least `approach_travel` in an approach, and `live_travel` when live. An approach is no
/// faster than a live axis. One poll moves an axis by at most a quarter of its travel. Checked for times below 32.
fn speed_is_stated<D: Demand + kani::Arbitrary>() {
    let mut parameters = any_parameters::<D, 1>();
    parameters.live_travel = kani::any_where(|&travel| travel < 1 << 5);
    parameters.approach_travel = kani::any_where(|&travel| travel < 1 << 5);
    kani::assume(parameters.check().is_ok());
    let (slow, fast) = (parameters.slow(), parameters.fast());
    for (speed, travel) in [
        (slow, parameters.approach_travel),
        (fast, parameters.live_travel),
    ] {
        assert!(u64::from(speed.per_tick) * u64::from(travel) <= u64::from(D::MOST));
        assert!((u64::from(speed.per_tick) + 1) * u64::from(travel) > u64::from(D::MOST));
    }
    assert!(slow.per_tick > 0 && slow.per_tick <= fast.per_tick);
    assert!(slow.per_poll <= fast.per_poll && fast.per_poll <= D::MOST / 4);
    let most = parameters.most_per_poll();
    assert!(most == fast.units_per_poll::<D>());
    assert!(u64::from(most) * 4 <= u64::from(D::MOST / D::UNIT) + 1);
    kani::cover!(fast.per_tick > 1 << 20, "fast");
    kani::cover!(
        slow.per_tick == fast.per_tick,
        "an approach as fast as live"
    );
}

/// Defines a harness for three axes with demands of 8 bits. If a number follows the name, also defines a harness for
/// this many axes with demands of 16 bits.
macro_rules! for_demands {
    ($($module:ident $($axes:literal)?)*) => {
        $(mod $module {
            #[kani::proof]
            #[kani::unwind(4)]
            fn of_8_bits() {
                super::check::$module::<u8, 3>();
            }

            $(
                // The bound of the loops counts bytes, because Kani compares arrays of demands byte by byte.
                #[kani::proof]
                #[kani::unwind(5)]
                fn of_16_bits() {
                    super::check::$module::<u16, $axes>();
                }
            )?
        })*
    };
}

/// Defines one harness for demands of 8 bits and one for 16 bits, each with an `approach_travel`. `$polls` bounds the
/// number of polls.
macro_rules! in_time {
    ($($module:ident = $check:ident($eight:literal, $sixteen:literal) in $polls:literal)*) => {
        $(mod $module {
            #[kani::proof]
            #[kani::unwind($polls)]
            fn of_8_bits() {
                super::$check::<u8>($eight);
            }

            #[kani::proof]
            #[kani::unwind($polls)]
            fn of_16_bits() {
                super::$check::<u16>($sixteen);
            }
        })*
    };
}

in_time! {
    parked_in_time = parks_in_time(4, 3) in 6
    live_in_time = goes_live_in_time(4, 3) in 8
}

mod stated_speed {
    #[kani::proof]
    #[kani::unwind(3)]
    fn of_8_bits() {
        super::speed_is_stated::<u8>();
    }

    #[kani::proof]
    #[kani::unwind(3)]
    fn of_16_bits() {
        super::speed_is_stated::<u16>();
    }
}

// The harnesses without a number count frames and ticks, which do not depend on the demands.
for_demands!(
    output_is_bounded 2 speed_is_bounded 2 approach_is_slow 2 approach_ends 2 no_panic 2
    clock_is_checked slow_frames_are_counted only_a_row_starts few_frames_change_nothing silence_stops
);

mod check {
    use super::{Demand, Failsafe, Phase, Speed, Step, any_failsafe, any_parameters, any_step};

    /// Two consecutive outputs of an axis differ by at most `most_per_poll` units, whatever the state, the time and the
    /// frame. If the axis is not live, the bound of the slow speed holds.
    pub(super) fn output_is_bounded<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let mut failsafe = any_failsafe::<D, AXES>();
        let before = failsafe;
        let output = failsafe.poll(kani::any());
        let mut axis = 0;
        while axis < AXES {
            let from = D::at(before.axes[axis].position).into();
            let units = u32::from(output.axes[axis].into().abs_diff(from));
            let [slow, fast] = [before.slow, before.fast].map(Speed::units_per_poll::<D>);
            // `most_per_poll` is the larger of these two numbers.
            assert!(
                units
                    <= if failsafe.axes[axis].is_live {
                        fast
                    } else {
                        slow
                    }
            );
            assert!(output.axes[axis] == D::at(failsafe.axes[axis].position));
            axis += 1;
        }
        assert!(failsafe.satisfies_invariant());
        kani::cover!(
            output.phase == Phase::Live && output.axes[0] != D::at(before.axes[0].position),
            "moves"
        );
        kani::cover!(
            output.phase == Phase::Ramp && output.axes[0] != D::at(before.axes[0].position),
            "moves to park"
        );
    }

    /// An axis moves no further than the speed allows for the time that has passed.
    pub(super) fn speed_is_bounded<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let Step {
            before,
            after,
            slow,
            fast,
            output,
            ..
        } = any_step::<D, AXES>();
        let mut axis = 0;
        while axis < AXES {
            let (from, to) = (before.axes[axis], after.axes[axis]);
            assert!(from.position.abs_diff(to.position) <= if to.is_live { fast } else { slow });
            axis += 1;
        }
        kani::cover!(output.phase == Phase::Live, "live");
        kani::cover!(output.phase == Phase::Ramp, "ramp");
    }

    pub(super) fn clock_is_checked<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let Step {
            before,
            after,
            elapsed,
            ..
        } = any_step::<D, AXES>();
        let passed = after.now.wrapping_sub(before.now);
        let is_fault = passed > u32::MAX / 2;
        assert!(elapsed == if is_fault { 0 } else { passed });
        assert!(after.clock_faults.wrapping_sub(before.clock_faults) == u32::from(is_fault));
        let is_late = elapsed > before.parameters.longest_step;
        assert!(after.late_polls.wrapping_sub(before.late_polls) == u32::from(is_late));
        let quiet = if before.has_frame {
            0
        } else {
            before.quiet.saturating_add(elapsed)
        };
        assert!(after.quiet == quiet);
        let silence = if after.follows() {
            quiet
        } else {
            before.silence.saturating_add(elapsed)
        };
        assert!(after.silence == silence);
        kani::cover!(is_fault, "the time goes backwards");
        kani::cover!(after.now < before.now && !is_fault, "the time wraps");
    }

    /// Frames are counted, and a silence ends the row. Without a row of frames, an axis stays or moves to park.
    pub(super) fn only_a_row_starts<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let Step {
            before,
            after,
            elapsed,
            slow,
            fast,
            output,
        } = any_step::<D, AXES>();
        let is_silent = before.is_silent(elapsed);
        let row = if is_silent { 0 } else { before.in_row };
        assert!(after.in_row == row.saturating_add(u8::from(before.has_frame)));
        let follows = after.follows();
        assert!(follows == matches!(output.phase, Phase::Live | Phase::Approach));
        let stays = after.silence < before.parameters.ramp_after;
        assert!(follows || (output.phase == Phase::Hold) == stays);
        let mut axis = 0;
        while axis < AXES {
            let park = before.parameters.park[axis];
            let mut expected = before.axes[axis].position;
            if follows {
                let mut moved = before.axes[axis];
                moved.is_live &= !is_silent;
                let may_go_live = after.approached >= before.parameters.approach_for;
                moved.step(before.demands[axis].position(), [slow, fast], may_go_live);
                expected = moved.position;
            } else if !stays {
                let mut moved = before.axes[axis];
                moved.is_live = false;
                moved.step(park.position(), [slow, 0], false);
                expected = moved.position;
            }
            assert!(after.axes[axis].position == expected);
            assert!(output.phase != Phase::Parked || expected == park.position());
            axis += 1;
        }
        kani::cover!(follows && !before.follows(), "starts");
        kani::cover!(!follows && before.has_frame, "does not start");
    }

    /// A frame that comes `hold_after` or more after the frame before is counted as slow, whatever else happens.
    pub(super) fn slow_frames_are_counted<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let Step {
            before,
            after,
            elapsed,
            output,
            ..
        } = any_step::<D, AXES>();
        let since_last_frame = u64::from(before.quiet) + u64::from(elapsed);
        let is_slow = since_last_frame >= u64::from(before.parameters.hold_after);
        let counts = before.has_frame && before.had_frame && is_slow;
        assert!(after.slow_frames.wrapping_sub(before.slow_frames) == u32::from(counts));
        assert!(after.had_frame == (before.had_frame || before.has_frame));
        assert!(!after.has_frame);
        // A frame that counts as slow does not start an approach.
        assert!(!counts || !matches!(output.phase, Phase::Live | Phase::Approach));
        kani::cover!(counts, "a slow frame");
        kani::cover!(
            before.has_frame && !before.had_frame && is_slow,
            "the first frame"
        );
    }

    /// A single frame after a silence never starts an approach. Until `frames_to_start` frames have come in a row, the
    /// axes and the phase do not depend on whether and when frames come.
    pub(super) fn few_frames_change_nothing<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let before = any_failsafe::<D, AXES>();
        let (mut one, mut other) = (before, before);
        other.has_frame = kani::any();
        other.demands = kani::any();
        if !before.follows() {
            other.quiet = kani::any();
            other.in_row = kani::any();
            kani::assume(!other.follows());
        }
        let (now, ways): (u32, [u32; 2]) = kani::any();
        let elapsed = one.pass(now);
        assert!(other.pass(now) == elapsed);
        let is_silent = before.is_silent(elapsed);
        assert!(!is_silent || !one.follows());
        kani::assume(!one.follows() && !other.follows());
        let (output, expected) = (one.step(ways), other.step(ways));
        assert!(output == expected && one.axes == other.axes);
        assert!((one.silence, one.approached) == (other.silence, other.approached));
        kani::cover!(
            is_silent && before.has_frame && before.follows(),
            "after a silence"
        );
        kani::cover!(one.in_row > 1 && other.in_row == 0, "nearly a row");
    }

    /// After a silence no axis is live.
    pub(super) fn silence_stops<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let Step {
            before,
            after,
            elapsed,
            output,
            ..
        } = any_step::<D, AXES>();
        kani::assume(before.is_silent(elapsed));
        let mut axis = 0;
        while axis < AXES {
            assert!(!after.axes[axis].is_live);
            axis += 1;
        }
        assert!(after.approached == 0);
        kani::cover!(
            before.axes[0].is_live && output.phase == Phase::Hold,
            "holds"
        );
        kani::cover!(before.axes[0].is_live && before.has_frame, "frame");
    }

    /// An axis is live only if the approach has lasted long enough. An approach begins when a poll takes the last of
    /// the `frames_to_start` frames. Each later poll adds its elapsed time, but at most `longest_step`.
    pub(super) fn approach_is_slow<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let Step {
            before,
            after,
            elapsed,
            output,
            ..
        } = any_step::<D, AXES>();
        let is_long = after.approached >= before.parameters.approach_for;
        let mut axis = 0;
        while axis < AXES {
            assert!(!after.axes[axis].is_live || is_long);
            axis += 1;
        }
        let ticks = elapsed.min(before.parameters.longest_step);
        let goes_on = before.follows() && !before.is_silent(elapsed);
        let approached = before.approached.saturating_add(ticks);
        assert!(after.approached == if goes_on { approached } else { 0 });
        let all = after.axes.iter().all(|axis| axis.is_live);
        assert!((output.phase == Phase::Live) == (all && after.follows()));
        kani::cover!(!before.axes[0].is_live && after.axes[0].is_live, "live");
        kani::cover!(output.phase == Phase::Approach && !goes_on, "begins");
    }

    /// If the approach has lasted long enough, an axis becomes live, or moves on in the same direction as far as the
    /// slow speed allows. It cannot move on for longer than its whole travel takes.
    pub(super) fn approach_ends<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let Step {
            before,
            after,
            elapsed,
            slow,
            ..
        } = any_step::<D, AXES>();
        kani::assume(!before.is_silent(elapsed));
        kani::assume(after.approached >= before.parameters.approach_for);
        let (from, to) = (before.axes[0], after.axes[0]);
        let way = if to.rises {
            to.position.checked_sub(from.position)
        } else {
            from.position.checked_sub(to.position)
        };
        let goes_on = to.rises == from.rises && way == Some(slow);
        assert!(to.is_live || goes_on);
        let demand = before.demands[0].position();
        assert!(!to.is_live || to.position.abs_diff(demand) <= from.position.abs_diff(demand));
        kani::cover!(!to.is_live, "goes on");
        kani::cover!(
            !from.is_live && to.is_live && to.position == demand,
            "meets"
        );
        kani::cover!(
            !from.is_live && to.is_live && to.rises != from.rises,
            "passes"
        );
    }

    /// Nothing panics, for any parameters, states and times.
    pub(super) fn no_panic<D: Demand + kani::Arbitrary, const AXES: usize>() {
        let parameters = any_parameters::<D, AXES>();
        let output: [D; AXES] = kani::any();
        let now: u32 = kani::any();
        let is_valid = parameters.check().is_ok();
        let built = Failsafe::resumed(parameters, now, output);
        assert!(built.is_ok() == is_valid);
        if let Ok(mut failsafe) = built {
            assert!(failsafe.satisfies_invariant());
            let first = failsafe.poll(now);
            assert!(first.axes == output && !matches!(first.phase, Phase::Live | Phase::Approach));
        }
        let mut failsafe = any_failsafe::<D, AXES>();
        let demands: [D; AXES] = kani::any();
        failsafe.frame(demands);
        assert!(failsafe.has_frame && failsafe.demands == demands);
        failsafe.poll(kani::any());
        kani::cover!(is_valid, "built");
    }
}
