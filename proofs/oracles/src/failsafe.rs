//! Target `failsafe`: schedules of frames and time, including a clock that wraps or goes backwards.

use arbitrary::{Arbitrary, Unstructured};
use framelock::motion::{Demand, Failsafe, FailsafeError, FailsafeParameters, Phase};

use crate::outcome::Occurred;
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
    /// The clock moves on by this number of ticks, and then the output is read. If the number is more than half the
    /// clock's range, the time goes backwards.
    Wait(u32),
    /// A frame with these demands arrives.
    Frame([u8; 3]),
}

/// The names of special cases, which are counted. The checks of the outputs must hold in these cases, too.
const CASES: [&str; 7] = [
    "the clock goes back while live",
    "a late poll with a frame while live",
    "frames that waited for one poll start nothing",
    "a frame in a hold moves nothing",
    "an approach goes on at the demands",
    "after the stated time, an approach is over although the demands move",
    "a silence is longer than the clock's period",
];

const PHASES: [(&str, Phase); 5] = [
    ("live", Phase::Live),
    ("approach", Phase::Approach),
    ("hold", Phase::Hold),
    ("ramp", Phase::Ramp),
    ("parked", Phase::Parked),
];

const ERRORS: [(&str, FailsafeError); 8] = [
    ("no step", FailsafeError::NoStep),
    ("hold within step", FailsafeError::HoldWithinStep),
    ("ramp before hold", FailsafeError::RampBeforeHold),
    ("single frame", FailsafeError::SingleFrame),
    ("no approach", FailsafeError::NoApproach),
    ("live too fast", FailsafeError::LiveTooFast),
    (
        "approach faster than live",
        FailsafeError::ApproachFasterThanLive,
    ),
    ("approach too slow", FailsafeError::ApproachTooSlow),
];

impl<'a> Arbitrary<'a> for Schedule {
    /// The first byte contains a bit for each of six times, in the order of the parameters, except that `live_travel`
    /// precedes `approach_travel`. If the bit is set, the time has four bytes, otherwise one. The seventh bit has no
    /// meaning. If the last bit is clear, the times and the number of frames are raised, so that the parameters rarely
    /// contradict each other. After the times come the number of frames, park, the clock's first value and the steps.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let flags = u8::arbitrary(u)?;
        let has = |bit: u32| flags >> bit & 1 == 1;
        let mut times = [0_u32; 6];
        for (bit, time) in (0..).zip(&mut times) {
            *time = if has(bit) {
                u.arbitrary()?
            } else {
                u8::arbitrary(u)?.into()
            };
        }
        let [
            mut longest_step,
            mut hold_after,
            mut ramp_after,
            mut approach_for,
            mut live,
            mut approach_travel,
        ] = times;
        if !has(7) {
            longest_step = longest_step.max(1);
            hold_after = hold_after.saturating_add(longest_step);
            ramp_after = ramp_after.saturating_add(hold_after);
            approach_for = approach_for.max(1);
            live = live.saturating_add(longest_step.saturating_mul(4));
            approach_travel = approach_travel.saturating_add(live);
        }
        Ok(Self {
            parameters: FailsafeParameters {
                longest_step,
                hold_after,
                ramp_after,
                frames_to_start: u8::arbitrary(u)? % 5 + if has(7) { 0 } else { 2 },
                approach_for,
                approach_travel,
                live_travel: live,
                park: u.arbitrary()?,
            },
            start: u.arbitrary()?,
            steps: rest(u),
        })
    }
}

impl<'a> Arbitrary<'a> for ScheduleStep {
    /// The first byte modulo 4 determines the event. Numbers are little-endian.
    ///
    /// * 0: a wait. The next two bytes are the number of ticks.
    /// * 1: a wait. The next byte is the number of ticks.
    /// * 2: a wait. The next four bytes are the number of ticks.
    /// * 3: a frame. The next three bytes are the frame's demands.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(match u8::arbitrary(u)? % 4 {
            0 => Self::Wait(u16::arbitrary(u)?.into()),
            1 => Self::Wait(u8::arbitrary(u)?.into()),
            2 => Self::Wait(u.arbitrary()?),
            _ => Self::Frame(u.arbitrary()?),
        })
    }
}

/// Checks that contradictory parameters give an error, and that the output always equals the model's output. Also
/// checks the promises to users, from the outputs alone: two consecutive outputs differ by at most `most_per_poll`, no
/// axis moves in a hold or while parked, an approach does not go live before `approach_for`, but within `live_after` if
/// no poll is late, and every axis is at park within `parked_after`. Uses three axes of eight bits, and also six axes
/// of sixteen bits, which get each of a frame's three demands twice.
///
/// Counts the errors, the phases, the counters and some special cases.
///
/// # Panics
/// Panics if the schedule shows a bug.
pub fn failsafe(schedule: &Schedule, occurred: &mut Occurred) {
    let p = schedule.parameters;
    let wide = |[a, b, c]: [u8; 3]| {
        [a, b, c, c, a, b].map(|demand| u16::from(demand).wrapping_mul(0x1_01) ^ 0x2C)
    };
    let six_axes = FailsafeParameters {
        park: wide(p.park),
        longest_step: p.longest_step,
        hold_after: p.hold_after,
        ramp_after: p.ramp_after,
        frames_to_start: p.frames_to_start,
        approach_for: p.approach_for,
        approach_travel: p.approach_travel,
        live_travel: p.live_travel,
    };
    check(schedule, six_axes, 16, wide, occurred);
    check(schedule, p, 8, |demands| demands, occurred);
}

/// Returns whether the parameters contradict each other.
fn contradict<D, const AXES: usize>(p: &FailsafeParameters<D, AXES>) -> bool {
    let in_order = [1, p.longest_step, p.hold_after, p.ramp_after, u32::MAX].is_sorted()
        && u64::from(p.longest_step) * 4 <= u64::from(p.live_travel)
        && p.live_travel <= p.approach_travel
        && p.approach_travel <= u32::MAX / 2;
    !in_order || p.frames_to_start < 2 || p.approach_for == 0
}

/// Checks the schedule with these parameters. `demands` converts a frame's demands to one demand of `bits` bits for
/// each axis.
fn check<D: Demand + Into<u16>, const AXES: usize>(
    schedule: &Schedule,
    parameters: FailsafeParameters<D, AXES>,
    bits: u32,
    demands: impl Fn([u8; 3]) -> [D; AXES],
    occurred: &mut Occurred,
) {
    let built = Failsafe::new(parameters, schedule.start);
    assert_eq!(built.is_err(), contradict(&parameters), "{parameters:?}");
    assert_eq!(built.err(), parameters.check().err());
    for (name, error) in ERRORS {
        occurred.count(name, built.err() == Some(error));
    }
    if let Ok(failsafe) = built {
        let model = Model::new(parameters, bits);
        run(failsafe, schedule, model, demands, occurred);
    }
}

/// Runs the failsafe and the model through the schedule.
fn run<D: Demand + Into<u16>, const AXES: usize>(
    mut failsafe: Failsafe<D, AXES>,
    schedule: &Schedule,
    mut model: Model<D, AXES>,
    demands: impl Fn([u8; 3]) -> [D; AXES],
    occurred: &mut Occurred,
) {
    let most_per_poll = model.parameters.most_per_poll();
    // The bound is at most a quarter of the travel, rounded up.
    assert!(
        u64::from(most_per_poll) * 4 <= (1 << 32) / model.unit,
        "{schedule:?}"
    );
    let mut phases = [0_u32; PHASES.len()];
    let mut clock = schedule.start;
    let (mut faults, mut late) = (0, 0);
    // The ticks since the last approach began, and whether a poll was late since then.
    let (mut approached, mut is_late) = (0, false);
    // The number of frames since the last poll, the last frame's demands, and the ticks since the last poll that took a
    // frame.
    let (mut waiting, mut demanded, mut silence) = (0_u8, model.parameters.park, 0);
    let mut cases = [false; CASES.len()];
    let mut last = failsafe.poll(clock);
    model.poll(0);
    for &step in &schedule.steps {
        let ticks = match step {
            ScheduleStep::Wait(ticks) => ticks,
            ScheduleStep::Frame(asked) => {
                demanded = demands(asked);
                waiting = waiting.saturating_add(1);
                failsafe.frame(demanded);
                model.frame(demanded.map(Into::into));
                continue;
            }
        };
        clock = clock.wrapping_add(ticks);
        let counted = if ticks > u32::MAX / 2 { 0 } else { ticks };
        faults += u32::from(counted != ticks);
        late += u32::from(counted > model.parameters.longest_step);
        model.poll(counted);
        let output = failsafe.poll(clock);
        assert_eq!(
            (output.axes.map(Into::into), output.phase),
            model.output(),
            "{schedule:?}"
        );
        let slow = failsafe.slow_frames();
        let counters = [failsafe.clock_faults(), failsafe.late_polls(), slow];
        assert_eq!(counters, [faults, late, model.slow_frames]);
        // The promises, from the outputs alone.
        for (from, to) in last.axes.into_iter().zip(output.axes) {
            let (from, to): (u16, u16) = (from.into(), to.into());
            assert!(
                u32::from(from.abs_diff(to)) <= most_per_poll,
                "{schedule:?}"
            );
        }
        if counted == 0
            || matches!(output.phase, Phase::Hold)
            || (last.phase, output.phase) == (Phase::Parked, Phase::Parked)
        {
            assert_eq!(last.axes, output.axes, "{schedule:?}");
        }
        let [follows, followed] =
            [output, last].map(|output| matches!(output.phase, Phase::Approach | Phase::Live));
        if follows && followed {
            approached += u64::from(counted);
            is_late |= counted > model.parameters.longest_step;
            let is_early = approached < model.parameters.approach_for.into();
            assert!(!is_early || output.phase == Phase::Approach, "{schedule:?}");
            let is_over = !is_late && approached >= model.parameters.live_after();
            assert!(!is_over || output.phase == Phase::Live, "{schedule:?}");
        } else {
            (approached, is_late) = (0, false);
            assert!(output.phase != Phase::Live, "{schedule:?}");
        }
        silence += u64::from(counted);
        let was_live = last.phase == Phase::Live;
        let both = (last.phase, output.phase);
        let is_over = !is_late && approached >= model.parameters.live_after();
        let now = [
            was_live && counted != ticks,
            was_live && waiting > 0 && counted > model.parameters.longest_step,
            waiting >= model.parameters.frames_to_start && output.phase == Phase::Parked,
            waiting > 0 && both == (Phase::Hold, Phase::Hold),
            both == (Phase::Approach, Phase::Approach) && output.axes == demanded,
            is_over && output.axes != demanded,
            silence > u32::MAX.into() && output.phase != Phase::Live,
        ];
        cases = std::array::from_fn(|case| cases[case] | now[case]);
        if std::mem::take(&mut waiting) > 0 {
            silence = 0;
        }
        for ((_, phase), count) in PHASES.iter().zip(&mut phases) {
            *count += u32::from(output.phase == *phase);
        }
        last = output;
    }
    parks_in_time(failsafe, clock, &model.parameters, schedule);
    for ((name, _), count) in PHASES.iter().zip(phases) {
        occurred.count(name, count);
    }
    for (name, is) in CASES.into_iter().zip(cases) {
        occurred.count(name, is);
    }
    occurred.count("clock fault", faults);
    occurred.count("late poll", late);
    occurred.count("slow frame", model.slow_frames);
}

/// Checks that every axis is at park within `parked_after` if no frames come, wherever the axes are now. Checks nothing
/// if `parked_after` is 2000 times `longest_step` or more, because this would take too many polls.
fn parks_in_time<D: Demand, const AXES: usize>(
    mut failsafe: Failsafe<D, AXES>,
    mut clock: u32,
    parameters: &FailsafeParameters<D, AXES>,
    schedule: &Schedule,
) {
    let (step, parked_after) = (parameters.longest_step, parameters.parked_after());
    if parked_after / u64::from(step) >= 2_000 {
        return;
    }
    clock = clock.wrapping_add(step);
    let mut last = failsafe.poll(clock); // takes the last frame
    for _ in 0..parked_after.div_ceil(step.into()) {
        clock = clock.wrapping_add(step);
        last = failsafe.poll(clock);
    }
    assert_eq!(
        (last.axes, last.phase),
        (parameters.park, Phase::Parked),
        "{schedule:?}"
    );
}

/// A model of the failsafe, written from the protocol's clauses. The model's time does not wrap.
struct Model<D, const AXES: usize> {
    parameters: FailsafeParameters<D, AXES>,
    /// The difference between the positions of two adjacent demands, such as 7 and 8. The demands' whole range has 2^32
    /// positions.
    unit: u64,
    now: u64,
    /// The times of the polls that took frames, since the last silence.
    row: Vec<u64>,
    /// The time of the last poll that took a frame.
    last_frame: Option<u64>,
    slow_frames: u32,
    /// The time of the last poll that took a frame while the output followed the frames.
    obeyed: Option<u64>,
    approached: u64,
    has_frame: bool,
    axes: [ModelAxis; AXES],
}

#[derive(Clone, Copy)]
struct ModelAxis {
    park: u64,
    demand: u64,
    position: u64,
    was_above: bool,
    is_live: bool,
}

impl<D: Demand + Into<u16>, const AXES: usize> Model<D, AXES> {
    fn new(parameters: FailsafeParameters<D, AXES>, bits: u32) -> Self {
        let unit = 1 << (32 - bits);
        Self {
            parameters,
            unit,
            now: 0,
            row: vec![],
            last_frame: None,
            slow_frames: 0,
            obeyed: None,
            approached: 0,
            has_frame: false,
            axes: parameters.park.map(|park| {
                let park = u64::from(park.into()) * unit;
                ModelAxis {
                    park,
                    demand: park,
                    position: park,
                    was_above: false,
                    is_live: false,
                }
            }),
        }
    }

    fn frame(&mut self, demands: [u16; AXES]) {
        for (axis, demand) in self.axes.iter_mut().zip(demands) {
            axis.demand = u64::from(demand) * self.unit;
        }
        self.has_frame = true;
    }

    fn follows(&self) -> bool {
        self.row.len() >= self.parameters.frames_to_start.into()
    }

    /// Returns how far a poll after this number of ticks may move an axis whose whole travel takes `travel` ticks.
    fn way(&self, travel: u32, ticks: u64) -> u64 {
        let most = (1 << 32) - self.unit;
        most / u64::from(travel) * ticks.min(self.parameters.longest_step.into())
    }

    fn poll(&mut self, ticks: u32) {
        let p = self.parameters;
        let ticks = u64::from(ticks);
        self.now += ticks;
        if self
            .row
            .last()
            .is_none_or(|last| self.now - last >= p.hold_after.into())
        {
            self.row.clear();
        }
        if self.row.is_empty() {
            self.approached = 0;
            self.axes.iter_mut().for_each(|axis| axis.is_live = false);
        }
        if self.follows() {
            self.approached += ticks.min(p.longest_step.into());
        }
        if std::mem::take(&mut self.has_frame) {
            self.row.push(self.now);
            let last = self.last_frame.replace(self.now);
            if last.is_some_and(|last| self.now - last >= p.hold_after.into()) {
                self.slow_frames += 1;
            }
        }
        let may_go_live = self.approached >= p.approach_for.into();
        if self.follows() {
            self.obeyed = self.row.last().copied();
        }
        let holds = self.holds();
        let (slow, fast) = (
            self.way(p.approach_travel, ticks),
            self.way(p.live_travel, ticks),
        );
        let follows = self.follows();
        for axis in &mut self.axes {
            let target = match (follows, holds) {
                (true, _) => axis.demand,
                (_, true) => axis.position,
                _ => axis.park,
            };
            let is_above = target > axis.position;
            let way = target.abs_diff(axis.position);
            if may_go_live && (is_above != axis.was_above || way <= slow) {
                axis.is_live = true;
            }
            axis.was_above = is_above;
            let way = way.min(if axis.is_live { fast } else { slow });
            axis.position = if is_above {
                axis.position + way
            } else {
                axis.position - way
            };
        }
    }

    fn holds(&self) -> bool {
        self.obeyed
            .is_some_and(|last| self.now - last < self.parameters.ramp_after.into())
    }

    fn output(&self) -> ([u16; AXES], Phase) {
        let phase = if self.follows() {
            if self.axes.iter().all(|axis| axis.is_live) {
                Phase::Live
            } else {
                Phase::Approach
            }
        } else if self.holds() {
            Phase::Hold
        } else if self.axes.iter().all(|axis| axis.position == axis.park) {
            Phase::Parked
        } else {
            Phase::Ramp
        };
        let axes = self
            .axes
            .map(|axis| u16::try_from(axis.position / self.unit).expect("below the range"));
        (axes, phase)
    }
}
