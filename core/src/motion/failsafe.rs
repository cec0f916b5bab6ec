//! The failsafe: moves the actuators safely when setpoints stop coming, and when they come again.
//!
//! ```text
//!                      frame                           silence >= hold_after
//!            ┌───────────────────────── HOLD ◄──────────────────────────────┐
//!            ▼                            │ silence >= ramp_after           │
//!  ┌──────────────────┐                   ▼                                 │
//!  │     APPROACH     │     frame       RAMP ── every axis at park ──► PARKED
//!  │ bounded rate to  │◄──────────────────┴────────── frame ─────────────┘
//!  │    the demand    │
//!  └────────┬─────────┘
//!           │ every axis at the demand
//!           ▼
//!         LIVE: output = demand, frame by frame        (at reset: PARKED)
//! ```

use core::fmt::{self, Debug};
use core::num::NonZeroU32;

#[cfg(kani)]
mod verification;

/// The demand that a frame carries for one axis: a `u8` or `u16` whose range covers the whole travel of the axis. The
/// trait is sealed.
pub trait Demand: Copy + Eq + Debug + Default + Into<u16> + TryFrom<u16> + sealed::Bits {}

impl Demand for u8 {}
impl Demand for u16 {}

mod sealed {
    pub trait Bits {
        const BITS: u32;
    }

    impl Bits for u8 {
        const BITS: u32 = Self::BITS;
    }

    impl Bits for u16 {
        const BITS: u32 = Self::BITS;
    }
}

/// The parameters of a [`Failsafe`]. Times are in ticks of the clock whose time the program passes to the failsafe.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FailsafeParameters<D, const AXES: usize> {
    /// The length of the silence after which the failsafe holds the output. It is at least 1 tick. Choose it longer
    /// than any pause of the line in normal use.
    pub hold_after: u32,
    /// The length of the silence after which the failsafe moves the output to park. It is at least `hold_after`.
    pub ramp_after: u32,
    /// The position of each axis when no frames come.
    pub park: [D; AXES],
    /// The time in ticks that each axis takes to move by one unit of demand. This time bounds the axis's speed. For
    /// demands of 16 bits use a clock of microseconds: with 30 ticks per unit, the whole travel takes two seconds.
    pub ticks_per_unit: [NonZeroU32; AXES],
}

impl<D: Demand, const AXES: usize> FailsafeParameters<D, AXES> {
    /// Returns the longest possible time in ticks from the last frame until every axis is at park.
    #[must_use]
    pub fn parked_after(&self) -> u64 {
        let most = u16::MAX.wrapping_shr(u16::BITS.saturating_sub(D::BITS));
        let axes = self.park.into_iter().zip(self.ticks_per_unit);
        let ticks = axes.map(|(park, rate)| {
            let park = park.into();
            u64::from(rate.get()).saturating_mul(park.max(most.abs_diff(park)).into())
        });
        let longest = ticks.max().unwrap_or(0);
        longest.saturating_add(self.ramp_after.into())
    }
}

/// The reason why a [`Failsafe`] cannot be built.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FailsafeError {
    /// `hold_after` is 0, so the failsafe would engage between any two frames.
    HoldAtOnce,
    /// `ramp_after` is less than `hold_after`.
    RampBeforeHold,
}

impl fmt::Display for FailsafeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::HoldAtOnce => "hold_after is 0 ticks; it must be at least 1",
            Self::RampBeforeHold => "ramp_after is less than hold_after",
        })
    }
}

impl core::error::Error for FailsafeError {}

/// The current behaviour of the failsafe.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Phase {
    /// The output is the last frame's demands.
    Live,
    /// Frames come again: the output moves to the demands at the bounded rate.
    Approach,
    /// Silence: the output stays where it is.
    Hold,
    /// Longer silence: the output moves to park at the bounded rate.
    Ramp,
    /// Every axis is at park.
    Parked,
}

impl fmt::Display for Phase {
    /// Writes the phase in one word, in lower case.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Live => "live",
            Self::Approach => "approach",
            Self::Hold => "hold",
            Self::Ramp => "ramp",
            Self::Parked => "parked",
        })
    }
}

/// The output for the actuators at the time of the call.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Output<D, const AXES: usize> {
    /// The position for each axis.
    pub axes: [D; AXES],
    /// The failsafe's phase, which explains the positions.
    pub phase: Phase,
}

/// The failsafe between the receiver and the actuators, for any number of axes and demands of 8 or 16 bits. The
/// program passes in the time, as a counter that may wrap.
///
/// Call [`frame`](Self::frame) for each frame, and [`poll`](Self::poll) to get the output. Pass the current time to
/// both. The time between two calls must be shorter than the counter's period. If the time goes backwards, the failsafe
/// assumes a long silence and moves the output to park, which is safe.
///
/// Outside [`Phase::Live`] an axis moves at most one unit per `ticks_per_unit` ticks. This bounds the return from park,
/// too, so after a silence the axis approaches the first frame's demand without a jump (theorem 10). In [`Phase::Live`]
/// the output is the demand itself. Smoothing the demands is the sender's task.
///
/// # Examples
/// ```
/// use core::num::NonZeroU32;
/// use framelock::motion::{Failsafe, FailsafeParameters, Phase, Setpoint};
/// // The clock ticks every millisecond. After 100 ms of silence hold the output. After 500 ms of silence move to the
/// // middle, at 100 units per second.
/// let rate = NonZeroU32::new(10).unwrap();
/// let parameters = FailsafeParameters {
///     hold_after: 100, ramp_after: 500, park: [128_u8; 3], ticks_per_unit: [rate; 3],
/// };
/// let mut failsafe = Failsafe::new(parameters, 0)?;
/// assert_eq!(failsafe.poll(5).phase, Phase::Parked);
///
/// failsafe.frame(10, Setpoint { pitch: 130, roll: 128, yaw: 128 });
/// assert_eq!(failsafe.poll(25).phase, Phase::Approach);
/// assert_eq!(Setpoint::from(failsafe.poll(25).axes).pitch, 129);
/// assert_eq!(failsafe.poll(30).phase, Phase::Live);
/// assert_eq!(failsafe.poll(110).phase, Phase::Hold);
/// assert_eq!(failsafe.poll(510).phase, Phase::Ramp);
/// assert_eq!(failsafe.poll(530).phase, Phase::Parked);
/// # Ok::<(), framelock::motion::FailsafeError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Failsafe<D, const AXES: usize> {
    parameters: FailsafeParameters<D, AXES>,
    /// The time of the last call.
    now: u32,
    /// Ticks since the last frame. Saturates at the largest number.
    silence: u32,
    demands: [D; AXES],
    axes: [Axis<D>; AXES],
}

/// One axis that moves at a bounded rate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Axis<D> {
    position: D,
    /// The ticks since the axis last moved by a unit, always fewer than the axis takes for one unit.
    since_unit: u32,
}

impl<D: Demand, const AXES: usize> Failsafe<D, AXES> {
    /// Creates a failsafe whose output is at park and that has received no frame. `now` is the current time.
    ///
    /// # Errors
    /// Returns an error if the parameters contradict each other: see [`FailsafeError`].
    pub fn new(parameters: FailsafeParameters<D, AXES>, now: u32) -> Result<Self, FailsafeError> {
        Self::resumed(parameters, now, parameters.park)
    }

    /// Creates a failsafe like [`new`](Self::new), but its output begins at `output` and moves from there to park. Use
    /// this function if you know that the actuators are not at park, for example after a reset.
    ///
    /// # Errors
    /// Returns the same errors as [`new`](Self::new).
    pub fn resumed(
        parameters: FailsafeParameters<D, AXES>,
        now: u32,
        output: impl Into<[D; AXES]>,
    ) -> Result<Self, FailsafeError> {
        if parameters.hold_after == 0 {
            return Err(FailsafeError::HoldAtOnce);
        }
        if parameters.ramp_after < parameters.hold_after {
            return Err(FailsafeError::RampBeforeHold);
        }
        Ok(Self {
            parameters,
            now,
            silence: u32::MAX,
            demands: parameters.park,
            axes: output.into().map(Axis::at),
        })
    }

    /// Takes the demands of a frame that was delivered at the time `now`.
    pub fn frame(&mut self, now: u32, demands: impl Into<[D; AXES]>) {
        let live = self.poll(now).phase == Phase::Live;
        self.silence = 0;
        self.demands = demands.into();
        if live {
            self.axes = self.demands.map(Axis::at);
        }
    }

    /// Returns the output at the time `now`. The output at a given time does not depend on how often this function is
    /// called. Performs at most two long divisions per axis, with one step per bit of the demand.
    pub fn poll(&mut self, now: u32) -> Output<D, AXES> {
        let parameters = self.parameters;
        let (hold_after, ramp_after) = (parameters.hold_after, parameters.ramp_after);
        let elapsed = now.wrapping_sub(self.now);
        let before = self.silence;
        self.now = now;
        self.silence = before.saturating_add(elapsed);

        let held_for = hold_after.saturating_sub(before);
        self.approach(self.demands, elapsed.min(held_for));
        // The ticks of `elapsed` that come after `ramp_after`.
        let to_park = elapsed.saturating_sub(ramp_after.saturating_sub(before));
        self.approach(parameters.park, to_park);
        let axes = self.axes.map(|axis| axis.position);
        let phase = match self.silence {
            silence if silence < hold_after && axes == self.demands => Phase::Live,
            silence if silence < hold_after => Phase::Approach,
            silence if silence < ramp_after => Phase::Hold,
            _ if axes == parameters.park => Phase::Parked,
            _ => Phase::Ramp,
        };
        Output { axes, phase }
    }

    fn approach(&mut self, targets: [D; AXES], ticks: u32) {
        let ways = targets.into_iter().zip(self.parameters.ticks_per_unit);
        for (axis, (target, ticks_per_unit)) in self.axes.iter_mut().zip(ways) {
            axis.approach(target, ticks, ticks_per_unit);
        }
    }
}

impl<D: Demand> Axis<D> {
    /// Creates an axis at this position.
    fn at(position: D) -> Self {
        Self {
            position,
            since_unit: 0,
        }
    }

    /// Moves for `ticks` ticks, one unit per `ticks_per_unit` ticks. Stops at the target.
    fn approach(&mut self, target: D, ticks: u32, ticks_per_unit: NonZeroU32) {
        if ticks == 0 {
            return;
        }
        let mut left = u64::from(ticks).saturating_add(u64::from(self.since_unit));
        // Long division. The quotient is at most the largest demand, so the division needs one step per bit of a
        // demand. Usually the quotient is zero.
        let mut units = 0;
        if left >= u64::from(ticks_per_unit.get()) {
            for bit in (0..D::BITS).rev() {
                (units, left) = division_step(units, left, ticks_per_unit, bit);
            }
        }
        self.advance(target, units, left);
    }

    /// Moves by `units`, and keeps the `left` ticks for the next unit. Stops at the target.
    fn advance(&mut self, target: D, units: u16, left: u64) {
        let (position, goal): (u16, u16) = (self.position.into(), target.into());
        if units >= position.abs_diff(goal) {
            *self = Self::at(target);
            return;
        }
        let moved = if goal > position {
            position.saturating_add(units)
        } else {
            position.saturating_sub(units)
        };
        // `moved` lies between two valid demands, so it fits the demand's type.
        self.position = moved.try_into().unwrap_or(target);
        // At this point `left` is less than the time that the axis takes for a unit. Otherwise the axis would have
        // reached the target.
        self.since_unit = u32::try_from(left).unwrap_or(u32::MAX);
    }
}

/// Performs one step of the long division. If the remaining ticks suffice for `1 << bit` units, counts these units and
/// subtracts their ticks.
fn division_step(units: u16, left: u64, ticks_per_unit: NonZeroU32, bit: u32) -> (u16, u64) {
    let taken = u64::from(ticks_per_unit.get()).wrapping_shl(bit);
    match left.checked_sub(taken) {
        Some(left) => (units | 1_u16.wrapping_shl(bit), left),
        None => (units, left),
    }
}
