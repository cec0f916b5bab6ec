//! Target `failsafe`: schedules of frames and time, including the wrap of the clock.

use std::num::NonZeroU32;

use arbitrary::{Arbitrary, Unstructured};
use framelock::motion::{Demand, Failsafe, FailsafeError, FailsafeParameters, Output, Phase};

use crate::rest;

/// The parameters of a failsafe, and the events that it gets.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Schedule {
    /// The failsafe's parameters, which may contradict each other.
    pub parameters: FailsafeParameters<u8, 3>,
    /// The clock's value at the start.
    pub start: u32,
    /// The events in order.
    pub steps: Vec<ScheduleStep>,
}

/// One event of a schedule.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ScheduleStep {
    /// This number of ticks passes, and then the output is read.
    Wait(u32),
    /// A frame with these demands arrives.
    Frame([u8; 3]),
}

impl<'a> Arbitrary<'a> for Schedule {
    /// The first byte contains a bit for each of four times: until the hold, until the ramp, per unit of pitch, and per
    /// unit of roll and yaw. If the bit is set, the time has four bytes, otherwise one byte. The times follow the first
    /// byte. After the times come park, the clock and the steps.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let wide = u8::arbitrary(u)?;
        let mut time = |bit: u32| {
            Ok(if wide >> bit & 1 == 1 {
                u.arbitrary()?
            } else {
                u32::from(u8::arbitrary(u)?)
            })
        };
        let (hold_after, ramp_after) = (time(0)?, time(1)?);
        let rate = |ticks| NonZeroU32::new(ticks).unwrap_or(NonZeroU32::MIN);
        let ticks_per_unit = [rate(time(2)?), rate(time(3)?), rate(time(3)?)];
        let park = u.arbitrary()?;
        Ok(Self {
            parameters: FailsafeParameters {
                hold_after,
                ramp_after,
                park,
                ticks_per_unit,
            },
            start: u.arbitrary()?,
            steps: rest(u),
        })
    }
}

impl<'a> Arbitrary<'a> for ScheduleStep {
    /// The first byte modulo 4 determines the event. Numbers are little-endian.
    ///
    /// * 0 and 1: a wait. The next two bytes are the number of ticks.
    /// * 2: a wait. The next four bytes are the number of ticks.
    /// * 3: a frame. The next three bytes are the frame's demands.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(match u8::arbitrary(u)? % 4 {
            0 | 1 => Self::Wait(u16::arbitrary(u)?.into()),
            2 => Self::Wait(u.arbitrary()?),
            _ => Self::Frame(u.arbitrary()?),
        })
    }
}

/// Checks that contradictory parameters give an error that names one of these parameters. At every time the output must
/// equal the model's output. Every axis must be at park when [`FailsafeParameters::parked_after`] ticks have passed
/// since the last frame. The output must not depend on how often it is read. Uses three axes of eight bits, and also
/// six axes of sixteen bits, which get each of a frame's three demands twice.
///
/// Returns the phase after each step with three axes.
///
/// # Errors
/// Returns the error with which contradictory parameters were rejected.
///
/// # Panics
/// Panics if the schedule shows a bug.
pub fn failsafe(schedule: &Schedule) -> Result<Vec<Phase>, FailsafeError> {
    let parameters = schedule.parameters;
    let [pitch, roll, yaw] = parameters.ticks_per_unit;
    let wide = |[a, b, c]: [u8; 3]| {
        [a, b, c, c, a, b].map(|demand| u16::from(demand).wrapping_mul(0x1_01) ^ 0x2C)
    };
    let six_axes = FailsafeParameters {
        hold_after: parameters.hold_after,
        ramp_after: parameters.ramp_after,
        park: wide(parameters.park),
        ticks_per_unit: [pitch, roll, yaw, pitch, roll, yaw],
    };
    let _ = check(schedule, six_axes, wide);
    check(schedule, parameters, |demands| demands)
}

/// Checks the schedule with these axes. `demands` converts a frame's demands to demands for these axes. Returns the
/// phases of the outputs.
fn check<D: Demand + Into<u16>, const AXES: usize>(
    schedule: &Schedule,
    parameters: FailsafeParameters<D, AXES>,
    demands: impl Fn([u8; 3]) -> [D; AXES],
) -> Result<Vec<Phase>, FailsafeError> {
    let rejection = if parameters.hold_after == 0 {
        Some((FailsafeError::HoldAtOnce, "hold_after"))
    } else if parameters.ramp_after < parameters.hold_after {
        Some((FailsafeError::RampBeforeHold, "ramp_after"))
    } else {
        None
    };
    match Failsafe::new(parameters, schedule.start) {
        Err(error) => {
            let (expected, named) = rejection.unwrap_or_else(|| panic!("{error}: {parameters:?}"));
            assert_eq!(error, expected, "{parameters:?}");
            assert!(error.to_string().contains(named), "{error}");
            Err(error)
        }
        Ok(failsafe) => {
            assert_eq!(rejection, None, "{parameters:?}");
            Ok(run(failsafe, schedule, parameters, demands))
        }
    }
}

/// Reads the output of one failsafe at every step. Reads the output of another failsafe only at frames, and before
/// waits after which the time since its last call would not fit into 32 bits. Returns the phase after each step.
fn run<D: Demand + Into<u16>, const AXES: usize>(
    failsafe: Failsafe<D, AXES>,
    schedule: &Schedule,
    parameters: FailsafeParameters<D, AXES>,
    demands: impl Fn([u8; 3]) -> [D; AXES],
) -> Vec<Phase> {
    let mut phases = Vec::new();
    let (mut often, mut seldom, mut unasked) = (failsafe, failsafe, 0_u32);
    let mut model = Model::new(parameters);
    let assert_is_the_models = |output: Output<D, AXES>, model: &Model<D, AXES>| {
        let axes = output.axes.map(Into::into);
        assert_eq!(
            (axes, output.phase),
            (model.position, model.phase()),
            "{schedule:?}"
        );
    };
    let mut clock = schedule.start;
    assert_is_the_models(often.poll(clock), &model);
    for &step in &schedule.steps {
        match step {
            ScheduleStep::Wait(ticks) => {
                if unasked.checked_add(ticks).is_none() {
                    seldom.poll(clock);
                    unasked = 0;
                }
                unasked += ticks;
                clock = clock.wrapping_add(ticks);
                // Step the model tick by tick if there are few ticks.
                match ticks {
                    0..100 => (0..ticks).for_each(|_| model.wait(1)),
                    _ => model.wait(ticks.into()),
                }
            }
            ScheduleStep::Frame(asked) => {
                often.frame(clock, demands(asked));
                seldom.frame(clock, demands(asked));
                unasked = 0;
                model.frame(demands(asked).map(Into::into));
                assert_is_the_models(seldom.poll(clock), &model);
            }
        }
        for _ in 0..2 {
            assert_is_the_models(often.poll(clock), &model);
        }
        if model.silence >= parameters.parked_after() {
            assert_eq!(model.phase(), Phase::Parked, "{schedule:?}");
        }
        phases.push(model.phase());
    }
    phases
}

/// A model of the protocol's rules (S1, S2, S3), whose ticks do not wrap.
struct Model<D, const AXES: usize> {
    parameters: FailsafeParameters<D, AXES>,
    park: [u16; AXES],
    /// Ticks since the last frame. Before the first frame, this is the largest number.
    silence: u64,
    demand: [u16; AXES],
    position: [u16; AXES],
    /// For each axis, the ticks since it last moved by a unit.
    since_unit: [u64; AXES],
}

impl<D: Demand + Into<u16>, const AXES: usize> Model<D, AXES> {
    fn new(parameters: FailsafeParameters<D, AXES>) -> Self {
        let park = parameters.park.map(Into::into);
        Self {
            parameters,
            park,
            silence: u64::MAX,
            demand: park,
            position: park,
            since_unit: [0; AXES],
        }
    }

    fn wait(&mut self, ticks: u64) {
        let (hold, ramp) = (self.parameters.hold_after, self.parameters.ramp_after);
        let before = self.silence;
        self.silence = before.saturating_add(ticks);
        let approaching = self.silence.min(hold.into()).saturating_sub(before);
        let ramping = self.silence.saturating_sub(before.max(ramp.into()));
        self.approach(self.demand, approaching);
        self.approach(self.park, ramping);
    }

    /// Moves each axis towards the target, by one unit per `ticks_per_unit`. Keeps remaining ticks for the next unit,
    /// unless the axis has reached the target.
    fn approach(&mut self, target: [u16; AXES], ticks: u64) {
        if ticks == 0 {
            return;
        }
        let rates = self.parameters.ticks_per_unit;
        let axes = self.position.iter_mut().zip(&mut self.since_unit);
        for ((position, since_unit), (target, rate)) in axes.zip(target.into_iter().zip(rates)) {
            let (way, rate) = (position.abs_diff(target), u64::from(rate.get()));
            let time = *since_unit + ticks;
            let units = u16::try_from(time / rate).unwrap_or(u16::MAX).min(way);
            *since_unit = if units == way { 0 } else { time % rate };
            if target > *position {
                *position += units;
            } else {
                *position -= units;
            }
        }
    }

    fn frame(&mut self, demand: [u16; AXES]) {
        if self.phase() == Phase::Live {
            self.position = demand;
        }
        (self.silence, self.demand) = (0, demand);
    }

    fn phase(&self) -> Phase {
        if self.silence < self.parameters.hold_after.into() {
            if self.position == self.demand {
                Phase::Live
            } else {
                Phase::Approach
            }
        } else if self.silence < self.parameters.ramp_after.into() {
            Phase::Hold
        } else if self.position == self.park {
            Phase::Parked
        } else {
            Phase::Ramp
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The files of the corpus have this layout.
    #[test]
    fn bytes_are_read_as_a_schedule() {
        let bytes = b"\x05\x14\x00\x00\x00\x32\x01\x02\x00\x00\x0A\x0B\xAAbc\xFF\xFF\xFF\xFF\
            \x03xyz\x00\x02\x01\x02\x05\x06\x07\x08";
        let schedule =
            Schedule::arbitrary_take_rest(Unstructured::new(bytes)).expect("enough bytes");
        let parameters = schedule.parameters;
        assert_eq!((parameters.hold_after, parameters.ramp_after), (20, 50));
        assert_eq!(
            parameters.ticks_per_unit.map(NonZeroU32::get),
            [0x201, 10, 11]
        );
        assert_eq!(parameters.park, *b"\xAAbc");
        assert_eq!(schedule.start, u32::MAX);
        assert_eq!(
            schedule.steps,
            [
                ScheduleStep::Frame(*b"xyz"),
                ScheduleStep::Wait(0x102),
                ScheduleStep::Wait(0x0807_0605)
            ]
        );
    }
}
