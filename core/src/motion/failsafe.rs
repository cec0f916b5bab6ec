//! The failsafe: bounds the speed of the actuators, and moves the actuators slowly when frames stop or come again.
//!
//! ```text
//!    silence >= hold_after          silence >= ramp_after          every axis at park
//!   ┌─────────────────────► HOLD ────────────────────────► RAMP ────────────────────► PARKED   (at reset)
//!   │                        │                              │                            │
//!   │                        └──────────────┬───────────────┴────────────────────────────┘
//!   │                                       │ frames_to_start frames in a row
//!   │                                       ▼
//!   ├──────────────────────────────────  APPROACH   slow, for at least approach_for,
//!   │                                       │       and then until each axis has met its demand
//!   │                                       ▼
//!   └──────────────────────────────────   LIVE      fast
//! ```

use core::fmt::{self, Debug};
use core::mem;

#[cfg(kani)]
mod verification;

/// The demand that a frame carries for one axis: a `u8` or `u16` whose range covers the whole travel of the axis. The
/// trait is sealed.
pub trait Demand:
    Copy + Eq + Debug + Default + Into<u16> + TryFrom<u16> + sealed::Position
{
}

impl Demand for u8 {}
impl Demand for u16 {}

mod sealed {
    /// Positions have 32 bits. Their highest bytes are the demand.
    pub trait Position {
        /// One unit of demand.
        const UNIT: u32;
        /// The position of the largest demand.
        const MOST: u32 = u32::MAX - (Self::UNIT - 1);

        fn position(self) -> u32;

        fn at(position: u32) -> Self;
    }

    impl Position for u8 {
        const UNIT: u32 = 1 << 24;

        fn position(self) -> u32 {
            u32::from_be_bytes([self, 0, 0, 0])
        }

        fn at(position: u32) -> Self {
            let [demand, ..] = position.to_be_bytes();
            demand
        }
    }

    impl Position for u16 {
        const UNIT: u32 = 1 << 16;

        fn position(self) -> u32 {
            let [high, low] = self.to_be_bytes();
            u32::from_be_bytes([high, low, 0, 0])
        }

        fn at(position: u32) -> Self {
            let [high, low, ..] = position.to_be_bytes();
            Self::from_be_bytes([high, low])
        }
    }
}

/// The parameters of a [`Failsafe`]. Times are in ticks of the clock whose time the program passes to
/// [`poll`](Failsafe::poll).
///
/// # Examples
/// Parameters that contradict each other do not compile if you check them in a constant:
/// ```
/// use framelock::motion::FailsafeParameters;
/// // The clock counts microseconds, and the program polls every 2 ms.
/// const PARAMETERS: FailsafeParameters<u8, 3> = FailsafeParameters {
///     hold_after: 200_000,
///     ..FailsafeParameters::for_clock(1_000_000, 2_000, [128; 3])
/// };
/// const _: () = match PARAMETERS.check() {
///     Ok(()) => (),
///     Err(error) => panic!("{}", error.message()),
/// };
/// assert_eq!(PARAMETERS.most_per_poll(), 6);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FailsafeParameters<D, const AXES: usize> {
    /// The position of each axis when no frames come.
    pub park: [D; AXES],
    /// The longest time for which one poll moves an axis. If a poll comes later, the rest of the time moves nothing.
    /// Choose twice the time between two polls.
    pub longest_step: u32,
    /// The length of the silence after which the failsafe holds the output. It is at least `longest_step`. Choose it
    /// longer than any pause of the line in normal use.
    pub hold_after: u32,
    /// The length of the silence after which the failsafe moves the output to park. It is at least `hold_after`.
    pub ramp_after: u32,
    /// The number of frames in a row that end a silence, at least 2, so a single frame moves nothing. Frames are in a
    /// row if no silence of `hold_after` is between them. Frames between the same two polls count as one.
    pub frames_to_start: u8,
    /// The shortest time of an approach, at least 1 tick. Late polls make the approach longer.
    pub approach_for: u32,
    /// The time that an axis takes for its whole travel in an approach, and on its way to park. It is at least
    /// `live_travel`, and at most half the clock's range.
    pub approach_travel: u32,
    /// The time that an axis takes for its whole travel when it is live. It is at least four times `longest_step`, so
    /// no poll moves an axis by more than a quarter of its travel, rounded up.
    pub live_travel: u32,
}

impl<D: Demand, const AXES: usize> FailsafeParameters<D, AXES> {
    /// Returns the usual parameters, for a clock with `ticks_per_second` and polls `poll_every` ticks apart. The
    /// failsafe holds after 0.1 s of silence, and moves the output to park after 0.5 s. Three frames start an approach,
    /// which takes at least a second. The whole travel takes 1 s in an approach, and 0.2 s when live. If polls are more
    /// than 25 ms apart, choose a longer `live_travel`.
    #[must_use]
    pub const fn for_clock(ticks_per_second: u32, poll_every: u32, park: [D; AXES]) -> Self {
        Self {
            park,
            longest_step: poll_every.saturating_mul(2),
            hold_after: ticks_per_second / 10,
            ramp_after: ticks_per_second / 2,
            frames_to_start: 3,
            approach_for: ticks_per_second,
            approach_travel: ticks_per_second,
            live_travel: ticks_per_second / 5,
        }
    }

    /// Checks that the parameters do not contradict each other.
    ///
    /// # Errors
    /// Returns the first contradiction.
    pub const fn check(&self) -> Result<(), FailsafeError> {
        Err(if self.longest_step == 0 {
            FailsafeError::NoStep
        } else if self.hold_after < self.longest_step {
            FailsafeError::HoldWithinStep
        } else if self.ramp_after < self.hold_after {
            FailsafeError::RampBeforeHold
        } else if self.frames_to_start < 2 {
            FailsafeError::SingleFrame
        } else if self.approach_for == 0 {
            FailsafeError::NoApproach
        } else if self.live_travel / 4 < self.longest_step {
            FailsafeError::LiveTooFast
        } else if self.approach_travel < self.live_travel {
            FailsafeError::ApproachFasterThanLive
        } else if self.approach_travel > u32::MAX / 2 {
            FailsafeError::ApproachTooSlow
        } else {
            return Ok(());
        })
    }

    /// Returns the largest number of units by which two consecutive outputs of an axis differ, whatever happens.
    #[must_use]
    pub const fn most_per_poll(&self) -> u32 {
        // For parameters that pass `check`, `fast` is at least `slow`, but the prover cannot compare the divisions.
        let [slow, fast] = [
            self.slow().units_per_poll::<D>(),
            self.fast().units_per_poll::<D>(),
        ];
        if slow > fast { slow } else { fast }
    }

    /// Returns a bound in ticks on the time from the poll that takes the last frame until every axis is at park, if no
    /// two polls are more than `longest_step` apart. The first poll after this time finds every axis at park.
    #[must_use]
    pub fn parked_after(&self) -> u64 {
        let ways = self.park.into_iter().map(|park| {
            let park = park.position();
            park.max(D::MOST.saturating_sub(park))
        });
        let longest = ways.max().unwrap_or(0);
        let ticks = longest.div_ceil(self.slow().per_tick.max(1));
        u64::from(ticks).saturating_add(self.ramp_after.into())
    }

    /// Returns a bound in ticks on the time from the poll that starts an approach until every axis is live, however the
    /// demands move, if frames keep coming and no two polls are more than `longest_step` apart. The first poll after
    /// this time finds every axis live.
    #[must_use]
    pub const fn live_after(&self) -> u64 {
        let per_tick = self.slow().per_tick;
        let ticks = D::MOST.div_ceil(if per_tick == 0 { 1 } else { per_tick });
        (self.approach_for as u64).saturating_add(ticks as u64)
    }

    /// Returns the speed in an approach, and on the way to park.
    const fn slow(&self) -> Speed {
        Speed::new::<D>(self.approach_travel, self.longest_step)
    }

    /// Returns the speed of a live axis.
    const fn fast(&self) -> Speed {
        Speed::new::<D>(self.live_travel, self.longest_step)
    }
}

/// The speed of an axis: the most that the axis moves in a tick, and in a poll.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Speed {
    per_tick: u32,
    per_poll: u32,
}

impl Speed {
    /// Returns the speed of an axis that takes this time for its whole travel.
    const fn new<D: Demand>(travel: u32, longest_step: u32) -> Self {
        let per_tick = match D::MOST.checked_div(travel) {
            Some(way) => way,
            None => u32::MAX,
        };
        Self {
            per_tick,
            per_poll: per_tick.saturating_mul(longest_step),
        }
    }

    /// Returns the largest difference between two consecutive outputs.
    const fn units_per_poll<D: Demand>(self) -> u32 {
        self.per_poll.div_ceil(D::UNIT)
    }

    /// Returns the most that an axis moves in a poll that comes `elapsed` ticks after the poll before.
    fn way(self, elapsed: u32) -> u32 {
        self.per_tick.saturating_mul(elapsed).min(self.per_poll)
    }
}

/// The reason why a [`Failsafe`] cannot be built.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FailsafeError {
    /// `longest_step` is 0, so no poll would move an axis.
    NoStep,
    /// `hold_after` is less than `longest_step`, so the failsafe would hold between two polls.
    HoldWithinStep,
    /// `ramp_after` is less than `hold_after`.
    RampBeforeHold,
    /// `frames_to_start` is 0 or 1, so a single false frame would move a parked axis.
    SingleFrame,
    /// `approach_for` is 0.
    NoApproach,
    /// `live_travel` is less than four times `longest_step`, so one poll would move an axis too far.
    LiveTooFast,
    /// `approach_travel` is less than `live_travel`.
    ApproachFasterThanLive,
    /// `approach_travel` is more than half the clock's range.
    ApproachTooSlow,
}

impl FailsafeError {
    /// Returns the error in words.
    #[must_use]
    pub const fn message(self) -> &'static str {
        match self {
            Self::NoStep => "longest_step is 0 ticks; it must be at least 1",
            Self::HoldWithinStep => "hold_after is less than longest_step",
            Self::RampBeforeHold => "ramp_after is less than hold_after",
            Self::SingleFrame => "frames_to_start is less than 2",
            Self::NoApproach => "approach_for is 0 ticks; it must be at least 1",
            Self::LiveTooFast => "live_travel is less than four times longest_step",
            Self::ApproachFasterThanLive => "approach_travel is less than live_travel",
            Self::ApproachTooSlow => "approach_travel is more than half the clock's range",
        }
    }
}

impl fmt::Display for FailsafeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message())
    }
}

impl core::error::Error for FailsafeError {}

/// The current behaviour of the failsafe.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Phase {
    /// The output follows the last frame's demands, at most as fast as `live_travel` says.
    Live,
    /// Frames come again: the speed of at least one axis is still limited by `approach_travel`.
    Approach,
    /// Silence: the output stays where it is.
    Hold,
    /// Longer silence: the output moves to park slowly.
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

/// The failsafe between the receiver and the actuators, for any number of axes and demands of 8 or 16 bits. The program
/// passes the time to it, as a counter that may wrap.
///
/// Call [`frame`](Self::frame) for each frame. Call [`poll`](Self::poll) at regular times, and set the actuators to its
/// output. Only `poll` moves the output.
///
/// Two consecutive outputs of an axis differ by at most [`most_per_poll`](FailsafeParameters::most_per_poll) units, and
/// by no more than the axis's speed allows for the time that has passed. This holds in every phase, whatever bytes
/// come, whatever the clock does, and whenever `poll` is called. `most_per_poll` is at most a quarter of the travel,
/// rounded up, because `live_travel` is at least four times `longest_step`. If time stands still, nothing moves. After
/// a silence of `hold_after`, a single frame moves nothing, and several frames in a row start a slow approach. An
/// approach lasts at least `approach_for`, unless a silence ends it. If frames keep coming and no poll is late, every
/// axis is live within [`live_after`](FailsafeParameters::live_after) of the approach's start, whatever the demands.
///
/// The failsafe is no safety function: it cannot bound the output if the program crashes or an actuator fails.
///
/// `frame` and `poll` write the same memory, so neither may interrupt the other. If an interrupt receives frames and a
/// task of another priority polls, there are two ways: call each function in a critical section, or call both functions
/// from the task. In the second case, the interrupt puts the demands into a shared cell, which the task empties.
///
/// # Examples
/// ```
/// use framelock::motion::{Failsafe, FailsafeParameters, Phase, Setpoint};
/// // The clock ticks every millisecond, and the program polls every 20 ms.
/// let parameters = FailsafeParameters::for_clock(1_000, 20, [128_u8; 3]);
/// let mut failsafe = Failsafe::new(parameters, 0)?;
/// let mut phases = vec![];
/// for now in (20..=4000).step_by(20) {
///     if now < 3000 {
///         failsafe.frame(Setpoint { pitch: 255, roll: 128, yaw: 128 });
///     }
///     let output = failsafe.poll(now);
///     if phases.last() != Some(&output.phase) {
///         phases.push(output.phase);
///     }
/// }
/// assert_eq!(
///     phases,
///     [Phase::Parked, Phase::Approach, Phase::Live, Phase::Hold, Phase::Ramp, Phase::Parked]
/// );
/// # Ok::<(), framelock::motion::FailsafeError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Failsafe<D, const AXES: usize> {
    parameters: FailsafeParameters<D, AXES>,
    /// The speed in an approach, and on the way to park.
    slow: Speed,
    /// The speed of a live axis.
    fast: Speed,
    /// The time of the last poll.
    now: u32,
    /// Ticks since the last frame. Saturates at the largest number.
    quiet: u32,
    /// Ticks since the last frame whose demands the output followed. Saturates at the largest number.
    silence: u32,
    /// The number of polls that have taken a frame since the last silence. Saturates at the largest number.
    in_row: u8,
    /// Ticks since the poll that started the approach. A late poll counts as `longest_step`. Saturates at the largest
    /// number.
    approached: u32,
    /// Whether a frame has come since the last poll.
    has_frame: bool,
    /// Whether any poll has taken a frame yet.
    had_frame: bool,
    demands: [D; AXES],
    axes: [Axis; AXES],
    clock_faults: u32,
    late_polls: u32,
    slow_frames: u32,
}

/// One axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Axis {
    position: u32,
    is_live: bool,
    /// Whether the last target was above the axis's position.
    rises: bool,
}

impl<D: Demand, const AXES: usize> Failsafe<D, AXES> {
    /// Creates a failsafe whose output is at park and that has received no frame. `now` is the current time.
    ///
    /// # Errors
    /// Returns an error if the parameters contradict each other: see [`FailsafeParameters::check`].
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
        parameters.check()?;
        Ok(Self {
            parameters,
            slow: parameters.slow(),
            fast: parameters.fast(),
            now,
            quiet: u32::MAX,
            silence: u32::MAX,
            in_row: 0,
            approached: 0,
            has_frame: false,
            had_frame: false,
            demands: parameters.park,
            axes: output.into().map(|output| Axis {
                position: output.position(),
                is_live: false,
                rises: false,
            }),
            clock_faults: 0,
            late_polls: 0,
            slow_frames: 0,
        })
    }

    /// Takes the demands of a frame. The frame counts as received at the time of the next poll.
    pub fn frame(&mut self, demands: impl Into<[D; AXES]>) {
        self.demands = demands.into();
        self.has_frame = true;
    }

    /// Returns the output at the time `now`.
    pub fn poll(&mut self, now: u32) -> Output<D, AXES> {
        let elapsed = self.pass(now);
        let ways = [self.slow.way(elapsed), self.fast.way(elapsed)];
        self.step(ways)
    }

    /// Returns the number of polls at which the time seemed to go backwards, because it was more than half the
    /// counter's range after the time of the poll before. Such a poll counts as no time: nothing moves, and a silence
    /// does not become longer. So poll at least once in half the counter's range.
    #[must_use]
    pub fn clock_faults(&self) -> u32 {
        self.clock_faults
    }

    /// Returns how many polls were more than `longest_step` after the poll before. Then axes move more slowly than the
    /// parameters say.
    #[must_use]
    pub fn late_polls(&self) -> u32 {
        self.late_polls
    }

    /// Returns how many frames came `hold_after` or more after the frame before. The first frame does not count.
    ///
    /// The number tells a slow sender from a silent line. If the phase is neither [`Live`](Phase::Live) nor
    /// [`Approach`](Phase::Approach) and the number keeps growing, frames arrive, but too far apart to start an
    /// approach. If the number does not change, no frames arrive, or too few in a row. See [`Pace`](super::Pace).
    #[must_use]
    pub fn slow_frames(&self) -> u32 {
        self.slow_frames
    }

    /// Counts the time since the last poll, and the frame if one has come. Returns the time, or 0 at a clock fault.
    fn pass(&mut self, now: u32) -> u32 {
        let parameters = &self.parameters;
        let mut elapsed = now.wrapping_sub(self.now);
        self.now = now;
        if elapsed > u32::MAX / 2 {
            elapsed = 0;
            self.clock_faults = self.clock_faults.wrapping_add(1);
        }
        if elapsed > parameters.longest_step {
            self.late_polls = self.late_polls.wrapping_add(1);
        }
        self.quiet = self.quiet.saturating_add(elapsed);
        self.silence = self.silence.saturating_add(elapsed);
        if self.quiet >= parameters.hold_after {
            self.in_row = 0;
            self.approached = 0;
            for axis in &mut self.axes {
                axis.is_live = false;
            }
        }
        if self.in_row >= parameters.frames_to_start {
            let ticks = elapsed.min(parameters.longest_step);
            self.approached = self.approached.saturating_add(ticks);
        }
        if mem::take(&mut self.has_frame) {
            if self.had_frame && self.quiet >= parameters.hold_after {
                self.slow_frames = self.slow_frames.wrapping_add(1);
            }
            self.had_frame = true;
            self.quiet = 0;
            self.in_row = self.in_row.saturating_add(1);
        }
        if self.in_row >= parameters.frames_to_start {
            self.silence = self.quiet;
        }
        elapsed
    }

    /// Moves each axis by at most the first distance in `ways`, or by at most the second if the axis is live. Returns
    /// the output.
    fn step(&mut self, ways: [u32; 2]) -> Output<D, AXES> {
        let FailsafeParameters {
            park,
            ramp_after,
            frames_to_start,
            approach_for,
            ..
        } = self.parameters;
        let follows = self.in_row >= frames_to_start;
        let holds = self.silence < ramp_after;
        let may_go_live = self.approached >= approach_for;
        let (mut are_live, mut are_parked) = (true, true);
        let mut axes = park;
        let targets = self.demands.iter().zip(&mut axes);
        for (axis, (demand, output)) in self.axes.iter_mut().zip(targets) {
            let park = output.position();
            let target = if follows {
                demand.position()
            } else if holds {
                axis.position
            } else {
                park
            };
            axis.step(target, ways, may_go_live);
            are_live &= axis.is_live;
            are_parked &= axis.position == park;
            *output = D::at(axis.position);
        }
        let phase = match (follows, holds) {
            (true, _) if are_live => Phase::Live,
            (true, _) => Phase::Approach,
            (false, true) => Phase::Hold,
            (false, false) if are_parked => Phase::Parked,
            (false, false) => Phase::Ramp,
        };
        Output { axes, phase }
    }
}

impl Axis {
    /// Moves the axis towards the target by at most `slow`, or by at most `fast` if the axis is live. If `may_go_live`,
    /// the axis goes live when it meets its target, or when the target has passed it.
    fn step(&mut self, target: u32, [slow, fast]: [u32; 2], may_go_live: bool) {
        if target == self.position {
            // The code below does the same, but takes longer. A parked axis always returns here.
            self.rises = false;
            self.is_live |= may_go_live;
            return;
        }
        let way = target.abs_diff(self.position);
        let rises = target > self.position;
        let has_met = way <= slow || rises != self.rises;
        self.rises = rises;
        self.is_live |= may_go_live && has_met;
        let way = way.min(if self.is_live { fast } else { slow });
        self.position = if rises {
            self.position.saturating_add(way)
        } else {
            self.position.saturating_sub(way)
        };
    }
}
