//! What the actuators do when setpoints stop coming, and when they come again.
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

use core::num::NonZeroU32;

use crate::Setpoint;

#[cfg(kani)]
mod verification;

/// How a [`Failsafe`] behaves. Times are in ticks of whatever clock the program passes in.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FailsafeParameters {
    /// Silence after which the output is held: how long the line may be quiet in normal use.
    /// At least 1.
    pub hold_after: u32,
    /// Silence after which the output moves to park. At least `hold_after`.
    pub ramp_after: u32,
    /// Where each axis goes when nobody says where to go.
    pub park: Setpoint,
    /// The bounded rate of each axis (pitch, roll, yaw): ticks for one unit of demand.
    pub ticks_per_unit: [NonZeroU32; 3],
}

impl FailsafeParameters {
    /// Ticks from the last frame until every axis is at park, whatever the setpoint was.
    #[must_use]
    pub fn parked_after(&self) -> u64 {
        let parks: [u8; 3] = self.park.into();
        let longest =
            parks
                .iter()
                .zip(self.ticks_per_unit)
                .fold(0, |longest: u64, (&park, rate)| {
                    let way = park.max(u8::MAX.abs_diff(park));
                    longest.max(u64::from(way).saturating_mul(u64::from(rate.get())))
                });
        longest.saturating_add(u64::from(self.ramp_after))
    }
}

/// Why a [`Failsafe`] cannot be built.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FailsafeError {
    /// `hold_after` is 0: the failsafe would engage between any two frames.
    HoldAtOnce,
    /// `ramp_after` is less than `hold_after`.
    RampBeforeHold,
}

impl core::fmt::Display for FailsafeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::HoldAtOnce => "hold_after is 0 ticks; it must be at least 1",
            Self::RampBeforeHold => "ramp_after is less than hold_after",
        })
    }
}

impl core::error::Error for FailsafeError {}

/// What the failsafe is doing.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Phase {
    /// The output is the last frame's setpoint.
    Live,
    /// Frames come again; the output moves to the demand at the bounded rate.
    Approach,
    /// Silence: the output stays where it is.
    Hold,
    /// Longer silence: the output moves to park at the bounded rate.
    Ramp,
    /// Every axis is at park.
    Parked,
}

/// What the actuators are to do now.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Output {
    /// Where each axis is to be.
    pub setpoint: Setpoint,
    /// Why.
    pub phase: Phase,
}

/// Sits between the receiver and the actuators. Time is passed in, as a counter that may wrap.
///
/// Tell it of each [`frame`](Self::frame) and [`poll`](Self::poll) it for the output, both with
/// the time now; call it more often than the counter wraps. Should the time go backwards, that
/// reads as a long silence: the safe way to be wrong.
///
/// Outside [`Phase::Live`] an axis moves at most one unit in each `ticks_per_unit`, also on the
/// way back: the first frame after a silence is approached, never jumped to. Live, the output is
/// the demand itself, since smoothing it is the sender's business.
///
/// # Examples
/// ```
/// use core::num::NonZeroU32;
/// use framelock::{Failsafe, FailsafeParameters, Phase, Setpoint};
/// // A clock of 1 ms: hold after 100 ms, to the middle after 500 ms at 100 units a second.
/// let mut failsafe = Failsafe::new(
///     FailsafeParameters {
///         hold_after: 100,
///         ramp_after: 500,
///         park: Setpoint { pitch: 128, roll: 128, yaw: 128 },
///         ticks_per_unit: [NonZeroU32::new(10).unwrap(); 3],
///     },
///     0,
/// )?;
/// assert_eq!(failsafe.poll(5).phase, Phase::Parked);
///
/// failsafe.frame(10, Setpoint { pitch: 130, roll: 128, yaw: 128 });
/// assert_eq!(failsafe.poll(25).phase, Phase::Approach);
/// assert_eq!(failsafe.poll(25).setpoint.pitch, 129);
/// assert_eq!(failsafe.poll(30).phase, Phase::Live);
/// assert_eq!(failsafe.poll(110).phase, Phase::Hold);
/// assert_eq!(failsafe.poll(510).phase, Phase::Ramp);
/// assert_eq!(failsafe.poll(530).phase, Phase::Parked);
/// # Ok::<(), framelock::FailsafeError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Failsafe {
    parameters: FailsafeParameters,
    /// When it was last called.
    now: u32,
    /// Ticks since the last frame, as far as it matters: stays at the top once there.
    silence: u32,
    demand: Setpoint,
    axes: [Axis; 3],
}

/// One axis that moves at a bounded rate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Axis {
    position: u8,
    /// Ticks since the last unit of the way; fewer than one unit takes.
    since_unit: u32,
}

impl Failsafe {
    /// Parked, with no frame received. `now` is the time.
    ///
    /// # Errors
    /// If the parameters contradict themselves: see [`FailsafeError`].
    pub fn new(parameters: FailsafeParameters, now: u32) -> Result<Self, FailsafeError> {
        Self::resumed(parameters, now, parameters.park)
    }

    /// As [`new`](Self::new), but the output begins at `output` and moves to park from there: for
    /// actuators that are known to be elsewhere, as after a reset.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn resumed(
        parameters: FailsafeParameters,
        now: u32,
        output: Setpoint,
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
            demand: parameters.park,
            axes: setpoint_axes(output),
        })
    }

    /// A frame was committed at the time `now`.
    pub fn frame(&mut self, now: u32, setpoint: Setpoint) {
        let live = self.poll(now).phase == Phase::Live;
        self.silence = 0;
        self.demand = setpoint;
        if live {
            self.axes = setpoint_axes(setpoint);
        }
    }

    /// The output at the time `now`. However often it is called, the output at a given time is
    /// the same. Two divisions an axis at most.
    pub fn poll(&mut self, now: u32) -> Output {
        let FailsafeParameters {
            hold_after,
            ramp_after,
            park,
            ..
        } = self.parameters;
        let elapsed = now.wrapping_sub(self.now);
        let before = self.silence;
        self.now = now;
        self.silence = before.saturating_add(elapsed);

        let held_for = hold_after.saturating_sub(before);
        self.approach(self.demand, elapsed.min(held_for));
        let setpoint = self.position();
        if self.silence < hold_after {
            let phase = if setpoint == self.demand {
                Phase::Live
            } else {
                Phase::Approach
            };
            return Output { setpoint, phase };
        }
        if self.silence < ramp_after {
            return Output {
                setpoint: self.position(),
                phase: Phase::Hold,
            };
        }
        self.approach(
            park,
            elapsed.saturating_sub(ramp_after.saturating_sub(before)),
        );
        let setpoint = self.position();
        Output {
            setpoint,
            phase: if setpoint == park {
                Phase::Parked
            } else {
                Phase::Ramp
            },
        }
    }

    fn position(&self) -> Setpoint {
        self.axes.map(|axis| axis.position).into()
    }

    fn approach(&mut self, target: Setpoint, ticks: u32) {
        let ways = <[u8; 3]>::from(target)
            .into_iter()
            .zip(self.parameters.ticks_per_unit);
        for (axis, (target, ticks_per_unit)) in self.axes.iter_mut().zip(ways) {
            axis.approach(target, ticks, ticks_per_unit);
        }
    }
}

/// Every axis where the setpoint wants it.
fn setpoint_axes(setpoint: Setpoint) -> [Axis; 3] {
    <[u8; 3]>::from(setpoint).map(|position| Axis {
        position,
        since_unit: 0,
    })
}

impl Axis {
    /// Moves for that many ticks, a unit in each `ticks_per_unit`; stops at the target.
    fn approach(&mut self, target: u8, ticks: u32, ticks_per_unit: NonZeroU32) {
        if ticks == 0 {
            return;
        }
        let mut left = u64::from(ticks).saturating_add(u64::from(self.since_unit));
        // Long division: a way has at most 255 units, so eight steps tell how many are made. Mostly
        // it is none.
        let mut units = 0;
        if left < u64::from(ticks_per_unit.get()) {
            return self.advance(target, units, left);
        }
        for bit in (0..8).rev() {
            (units, left) = division_step(units, left, ticks_per_unit, bit);
        }
        self.advance(target, units, left);
    }

    /// Moves that many units, which leaves that many ticks; stops at the target.
    fn advance(&mut self, target: u8, units: u8, left: u64) {
        if units >= self.position.abs_diff(target) {
            *self = Self {
                position: target,
                since_unit: 0,
            };
            return;
        }
        self.position = if target > self.position {
            self.position.saturating_add(units)
        } else {
            self.position.saturating_sub(units)
        };
        // Less than a unit's, or the target were reached.
        self.since_unit = u32::try_from(left).unwrap_or(u32::MAX);
    }
}

/// One step of the long division: if the ticks left are enough for `1 << bit` units, these are
/// counted and their ticks taken.
fn division_step(units: u8, left: u64, ticks_per_unit: NonZeroU32, bit: u32) -> (u8, u64) {
    let taken = u64::from(ticks_per_unit.get()).wrapping_shl(bit);
    match left.checked_sub(taken) {
        Some(left) => (units | 1_u8.wrapping_shl(bit), left),
        None => (units, left),
    }
}
