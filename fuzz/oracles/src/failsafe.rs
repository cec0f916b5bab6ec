//! Target `failsafe`: schedules of frames and time, the wrap of the clock included.
//!
//! What is checked are bounds that follow from the protocol's clauses (S1, S2, S3), on a clock of 64
//! bits that does not wrap: not a second implementation.

use std::num::NonZeroU32;

use arbitrary::{Arbitrary, Unstructured};
use framelock::{Failsafe, FailsafeError, FailsafeParameters, Output, Phase, Setpoint};

/// What happens next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Step {
    /// So many ticks pass, and the output is asked for.
    Wait(u32),
    Frame([u8; 3]),
}

impl<'a> Arbitrary<'a> for Step {
    /// One byte says what it is, by its remainder of 4. 0 and 1: a wait of as many ticks as the
    /// next two bytes say. 2: of as many as the next four say. 3: a frame, the setpoint follows.
    /// Numbers have their lowest byte first.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(match u8::arbitrary(u)? % 4 {
            0 | 1 => Self::Wait(u16::arbitrary(u)?.into()),
            2 => Self::Wait(u.arbitrary()?),
            _ => Self::Frame(u.arbitrary()?),
        })
    }
}

/// An input: the parameters, the clock's value at the start, and [`Step`]s.
#[derive(Debug)]
struct Schedule {
    parameters: FailsafeParameters,
    start: u32,
    steps: Vec<Step>,
}

impl<'a> Arbitrary<'a> for Schedule {
    /// The first byte says how wide the four times are: where its bit is set, the time (to hold, to
    /// ramp, for a unit of pitch, of roll and yaw) has four bytes, else one. Then come the times,
    /// park, the clock, the steps.
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
        let park: [u8; 3] = u.arbitrary()?;
        let start = u.arbitrary()?;
        let mut steps = Vec::new();
        while !u.is_empty()
            && let Ok(step) = u.arbitrary()
        {
            steps.push(step);
        }
        Ok(Self {
            parameters: FailsafeParameters {
                hold_after,
                ramp_after,
                park: park.into(),
                ticks_per_unit,
            },
            start,
            steps,
        })
    }
}

/// A `Schedule`. Contradictory parameters are refused by name. At every time:
///
/// * the phase is what the silence and the output say it is;
/// * outside of [`Phase::Live`] no axis is ever faster than its rate, counted over all of that time;
///   in hold none moves;
/// * no tick is lost: an axis under way to park or to the demand comes closer by the units that its
///   rate allows, and every axis is at park [`FailsafeParameters::parked_after`] the last frame;
/// * a frame moves nothing at once unless the output was live;
/// * asking twice gives the same, and asking seldom gives what asking often does.
///
/// # Panics
/// If one of these does not hold.
pub fn failsafe(data: &[u8]) {
    let Ok(schedule) = Schedule::arbitrary_take_rest(Unstructured::new(data)) else {
        return;
    };
    let parameters = schedule.parameters;
    let refusal = if parameters.hold_after == 0 {
        Some((FailsafeError::HoldAtOnce, "hold_after"))
    } else if parameters.ramp_after < parameters.hold_after {
        Some((FailsafeError::RampBeforeHold, "ramp_after"))
    } else {
        None
    };
    match Failsafe::new(parameters, schedule.start) {
        Err(error) => {
            let (expected, named) = refusal.unwrap_or_else(|| panic!("{error}: {parameters:?}"));
            assert_eq!(error, expected, "{parameters:?}");
            assert!(error.to_string().contains(named), "{error}");
        }
        Ok(failsafe) => {
            assert_eq!(refusal, None, "{parameters:?}");
            Watch::new(failsafe, &schedule).run();
        }
    }
}

/// A failsafe that is asked at every step, one that is asked at frames only, and what is known of
/// both on a clock that does not wrap.
struct Watch<'a> {
    schedule: &'a Schedule,
    often: Failsafe,
    seldom: Failsafe,
    /// When `seldom` was last asked.
    seldom_asked: u64,
    now: u64,
    last_frame: Option<u64>,
    demand: Setpoint,
    output: Output,
    /// Since the output was live: from when on, and of each axis the units it has moved.
    not_live_since: u64,
    moved: [u64; 3],
}

impl<'a> Watch<'a> {
    fn new(mut failsafe: Failsafe, schedule: &'a Schedule) -> Self {
        let park = schedule.parameters.park;
        let output = failsafe.poll(schedule.start);
        let parked = Output {
            setpoint: park,
            phase: Phase::Parked,
        };
        assert_eq!(output, parked, "at the start: {schedule:?}");
        Self {
            schedule,
            often: failsafe,
            seldom: failsafe,
            seldom_asked: schedule.start.into(),
            now: schedule.start.into(),
            last_frame: None,
            demand: park,
            output,
            not_live_since: schedule.start.into(),
            moved: [0; 3],
        }
    }

    fn run(mut self) {
        for step in &self.schedule.steps {
            match *step {
                Step::Wait(ticks) => self.wait(ticks),
                Step::Frame(setpoint) => self.frame(setpoint.into()),
            }
        }
    }

    /// The clock as the failsafe is told it.
    fn clock(&self) -> u32 {
        let [.., a, b, c, d] = self.now.to_be_bytes();
        u32::from_be_bytes([a, b, c, d])
    }

    fn silence(&self, now: u64) -> u64 {
        self.last_frame.map_or(u64::MAX, |last| now - last)
    }

    fn wait(&mut self, ticks: u32) {
        let (before, from) = (self.output, self.now);
        if self.now - self.seldom_asked + u64::from(ticks) > u64::from(u32::MAX) {
            // It must be called more often than the clock wraps.
            self.ask_seldom();
        }
        self.now += u64::from(ticks);
        let clock = self.clock();
        let output = self.often.poll(clock);
        let schedule = self.schedule;
        assert_eq!(self.often.poll(clock), output, "asked twice: {schedule:?}");
        self.check_phase(output);
        self.check_distance(from, before.setpoint, output.setpoint);
        self.check_rate(before.setpoint, output.setpoint);
        if output.phase == Phase::Live {
            self.not_live_since = self.now;
            self.moved = [0; 3];
        }
        self.output = output;
    }

    fn frame(&mut self, setpoint: Setpoint) {
        self.wait(0);
        let clock = self.clock();
        let was_live = self.output.phase == Phase::Live;
        self.often.frame(clock, setpoint);
        self.seldom.frame(clock, setpoint);
        self.last_frame = Some(self.now);
        self.demand = setpoint;
        let output = self.often.poll(clock);
        let schedule = self.schedule;
        assert_eq!(self.ask_seldom(), output, "asked seldom: {schedule:?}");
        let expected = if was_live {
            setpoint
        } else {
            self.output.setpoint
        };
        assert_eq!(output.setpoint, expected, "a frame: {schedule:?}");
        self.output = output;
        self.check_phase(output);
    }

    fn ask_seldom(&mut self) -> Output {
        self.seldom_asked = self.now;
        self.seldom.poll(self.clock())
    }

    fn check_phase(&self, output: Output) {
        let schedule = self.schedule;
        let parameters = &schedule.parameters;
        let silence = self.silence(self.now);
        let expected = if silence < parameters.hold_after.into() {
            if output.setpoint == self.demand {
                Phase::Live
            } else {
                Phase::Approach
            }
        } else if silence < parameters.ramp_after.into() {
            Phase::Hold
        } else if output.setpoint == parameters.park {
            Phase::Parked
        } else {
            Phase::Ramp
        };
        assert_eq!(output.phase, expected, "at {}: {schedule:?}", self.now);
        if silence >= parameters.parked_after() {
            assert_eq!(output.phase, Phase::Parked, "at {}: {schedule:?}", self.now);
        }
    }

    /// No tick is lost, and none is spent in hold.
    fn check_distance(&self, from: u64, before: Setpoint, after: Setpoint) {
        let schedule = self.schedule;
        let parameters = &schedule.parameters;
        let (hold, ramp) = (
            u64::from(parameters.hold_after),
            u64::from(parameters.ramp_after),
        );
        let (was, is) = (self.silence(from), self.silence(self.now));
        let approaching = is.min(hold).saturating_sub(was);
        // Before the first frame the silence is endless.
        let ramping = (self.now - from).min(is.saturating_sub(was.max(ramp)));
        let ramping = if self.last_frame.is_none() {
            self.now - from
        } else {
            ramping
        };
        let axes = parameters.ticks_per_unit.iter().zip(axes(before));
        for (axis, (rate, start)) in axes.enumerate() {
            let rate = u64::from(rate.get());
            let of =
                |setpoint| u64::from(<[u8; 3]>::from(setpoint).get(axis).copied().unwrap_or(0));
            // A distance left after so many ticks at that rate.
            let left = |distance: u64, ticks: u64| distance.saturating_sub(ticks / rate);
            let most_from_demand = left(u64::from(start).abs_diff(of(self.demand)), approaching);
            let message = || format!("axis {axis} from {from} to {}: {schedule:?}", self.now);
            if ramping == 0 {
                let distance = of(after).abs_diff(of(self.demand));
                let is_still = approaching == 0;
                assert!(!is_still || before == after, "{}", message());
                assert!(is_still || distance <= most_from_demand, "{}", message());
            } else {
                let apart = of(self.demand).abs_diff(of(parameters.park));
                let nearest = if approaching == 0 {
                    u64::from(start).abs_diff(of(parameters.park))
                } else {
                    most_from_demand + apart
                };
                let distance = of(after).abs_diff(of(parameters.park));
                assert!(distance <= left(nearest, ramping), "{}", message());
            }
        }
    }

    /// Never faster than the rate.
    fn check_rate(&mut self, before: Setpoint, after: Setpoint) {
        let schedule = self.schedule;
        let time = self.now - self.not_live_since;
        let ways = axes(before).into_iter().zip(axes(after));
        let rates = schedule.parameters.ticks_per_unit;
        for ((moved, (from, to)), rate) in self.moved.iter_mut().zip(ways).zip(rates) {
            *moved += u64::from(from.abs_diff(to));
            let bound = time / u64::from(rate.get());
            assert!(*moved <= bound, "at {}: {schedule:?}", self.now);
        }
    }
}

fn axes(setpoint: Setpoint) -> [u8; 3] {
    setpoint.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The seeds are written in this layout.
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
        assert_eq!(axes(parameters.park), *b"\xAAbc");
        assert_eq!(schedule.start, u32::MAX);
        assert_eq!(
            schedule.steps,
            [
                Step::Frame(*b"xyz"),
                Step::Wait(0x102),
                Step::Wait(0x0807_0605)
            ]
        );
    }
}
