//! Tests that the failsafe in C behaves like the failsafe in Rust: each poll returns the same output and phase, and
//! counts the same faults.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use framelock::motion::{Demand, Failsafe, FailsafeParameters, Phase};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::compilers::{CLANGXX, GCC};

/// Steps for `failsafe.c`, and the expected output, which is that of the Rust failsafe.
#[derive(Default)]
struct Trial {
    steps: Vec<u8>,
    said: String,
    /// The number of polls in each phase.
    phases: [usize; 5],
    /// The numbers of clock faults, late polls and slow frames that the failsafe counted.
    faults: [u32; 3],
    /// The reasons for which contradictory parameters were refused.
    refusals: BTreeSet<String>,
}

impl Trial {
    fn add<D: Into<u16>>(&mut self, demands: impl IntoIterator<Item = D>) {
        let bytes = demands
            .into_iter()
            .flat_map(|demand| demand.into().to_le_bytes());
        self.steps.extend(bytes);
    }

    fn add_times(&mut self, times: impl IntoIterator<Item = u32>) {
        self.steps
            .extend(times.into_iter().flat_map(u32::to_le_bytes));
    }

    fn add_parameters<D: Demand, const AXES: usize>(&mut self, p: FailsafeParameters<D, AXES>) {
        self.add(p.park);
        self.add_times([p.longest_step, p.hold_after, p.ramp_after]);
        self.steps.push(p.frames_to_start);
        self.add_times([p.approach_for, p.approach_travel, p.live_travel]);
    }

    /// Returns a trial with random parameters and steps.
    fn new<D: Demand, const AXES: usize>(random: &mut ChaCha8Rng) -> Self {
        let most = D::try_from(u16::MAX).map_or(u16::from(u8::MAX), |_| u16::MAX);
        let demands = |random: &mut ChaCha8Rng| {
            [(); AXES].map(|()| {
                let any = random.random_range(0..=most);
                let demand = *[0, 1, most, any, any, any].choose(random).unwrap();
                D::try_from(demand).ok().unwrap()
            })
        };
        let p = parameters(demands(random), most.into(), random);
        let mut now: u32 = if random.random() {
            random.random()
        } else {
            u32::MAX - 500
        };

        let mut trial = Self::default();
        trial.add_parameters(p);
        trial.add_times([now]);
        let Ok(mut failsafe) = Failsafe::new(p, now) else {
            trial.said.push_str("contradiction\n");
            return trial;
        };
        writeln!(trial.said, "{}", p.most_per_poll()).unwrap();
        let mut frame = demands(random);
        for _ in 0..600 {
            match random.random_range(0..200) {
                0..100 => {
                    if random.random_range(0..12) == 0 {
                        frame = demands(random);
                    }
                    trial.steps.push(0);
                    trial.add(frame);
                    failsafe.frame(frame);
                }
                100 => {
                    let output = demands(random);
                    trial.steps.push(2);
                    trial.add_times([now]);
                    trial.add(output);
                    failsafe = Failsafe::resumed(p, now, output).unwrap();
                }
                101 => {
                    let wrong = contradiction(p, random);
                    let refusal = wrong.check().unwrap_err();
                    trial.refusals.insert(refusal.to_string());
                    trial.steps.push(3);
                    trial.add_parameters(wrong);
                    trial.said.push_str("refused\n");
                }
                _ => {
                    let mut below = |most: u32| random.random_range(0..most.max(1));
                    let elapsed = match below(60) {
                        0 => below(u32::MAX),
                        1 => 0_u32.wrapping_sub(below(5)),
                        2 => below(p.hold_after.saturating_mul(2)),
                        3 => below(p.ramp_after.saturating_mul(2)),
                        _ => below(p.longest_step.saturating_add(1)),
                    };
                    now = now.wrapping_add(elapsed);
                    trial.steps.push(1);
                    trial.add_times([now]);
                    trial.poll(&mut failsafe, now);
                }
            }
        }
        trial
    }

    /// Polls the failsafe in Rust, and notes the expected line.
    fn poll<D: Demand, const AXES: usize>(&mut self, failsafe: &mut Failsafe<D, AXES>, now: u32) {
        let output = failsafe.poll(now);
        let phase = match output.phase {
            Phase::Live => 0,
            Phase::Approach => 1,
            Phase::Hold => 2,
            Phase::Ramp => 3,
            _ => 4,
        };
        self.phases[phase] += 1;
        let axes = output.axes.map(|axis| format!(" {}", axis.into()));
        let (clock, late, slow) = (
            failsafe.clock_faults(),
            failsafe.late_polls(),
            failsafe.slow_frames(),
        );
        self.faults = [clock, late, slow];
        writeln!(self.said, "{phase}{}, {clock} {late} {slow}", axes.concat()).unwrap();
    }
}

/// Returns the usual parameters, or random ones. Some random parameters contradict each other.
fn parameters<D: Demand, const AXES: usize>(
    park: [D; AXES],
    most: u32,
    random: &mut ChaCha8Rng,
) -> FailsafeParameters<D, AXES> {
    if random.random_range(0..4) == 0 {
        return FailsafeParameters::for_clock(1_000_000, 2_000, park);
    }
    // At least half of these trials have short times.
    let unit = *[1, 1, most / 50, 10_000_000].choose(random).unwrap();
    let mut time = |least: u32, most: u32| match random.random_range(0..60) {
        0 => least.saturating_sub(1),
        _ => least.saturating_add(random.random_range(0..most) * unit),
    };
    let longest_step = time(1, 10);
    let hold_after = time(longest_step, 60);
    let live_travel = time(longest_step.saturating_mul(4), 40);
    FailsafeParameters {
        park,
        longest_step,
        hold_after,
        ramp_after: time(hold_after, 200),
        approach_for: time(1, 100),
        approach_travel: time(live_travel, 200),
        live_travel,
        frames_to_start: match random.random_range(0..60) {
            0 => random.random_range(0..2),
            _ => random.random_range(2..6),
        },
    }
}

/// Changes the parameters so that they are invalid, and returns them.
fn contradiction<D: Demand, const AXES: usize>(
    mut p: FailsafeParameters<D, AXES>,
    random: &mut ChaCha8Rng,
) -> FailsafeParameters<D, AXES> {
    match random.random_range(0..8) {
        0 => p.longest_step = 0,
        1 => p.hold_after = p.longest_step - 1,
        2 => p.ramp_after = p.hold_after - 1,
        3 => p.frames_to_start = random.random_range(0..2),
        4 => p.approach_for = 0,
        5 => p.live_travel = 4 * p.longest_step - 1,
        6 => p.approach_travel = p.live_travel - 1,
        _ => p.approach_travel = u32::MAX / 2 + 1,
    }
    p
}

fn check<D: Demand, const AXES: usize>(demand: &str) {
    let axes = format!("-DFAILSAFE_AXES={AXES}");
    let demand = format!("-DFAILSAFE_DEMAND={demand}");
    let programs =
        [GCC, CLANGXX].map(|compiler| compiler.program("failsafe.c", &[], &[&axes, &demand]));
    let mut random = ChaCha8Rng::seed_from_u64(17);
    let mut trials: Vec<Trial> = Vec::new();
    for number in 0..150 {
        let trial = Trial::new::<D, AXES>(&mut random);
        assert_eq!(programs[number % 2].run(&trial.steps), trial.said);
        trials.push(trial);
    }
    for phase in 0..5 {
        let polls: usize = trials.iter().map(|trial| trial.phases[phase]).sum();
        assert!(polls > 100, "{polls} polls in phase {phase}");
    }
    for fault in 0..3 {
        let faults: u32 = trials.iter().map(|trial| trial.faults[fault]).sum();
        assert!(faults > 100, "{faults} of fault {fault}");
    }
    let refusals = trials.iter().flat_map(|trial| &trial.refusals);
    assert_eq!(refusals.collect::<BTreeSet<_>>().len(), 8);
    let is_contradiction = |trial: &&Trial| trial.said == "contradiction\n";
    let contradictions = trials.iter().filter(is_contradiction).count();
    assert!(contradictions > 2, "{contradictions}");
}

#[test]
fn three_axes_of_8_bits() {
    check::<u8, 3>("uint8_t");
}

#[test]
fn six_axes_of_16_bits() {
    check::<u16, 6>("uint16_t");
}

#[test]
fn one_axis_of_8_bits() {
    check::<u8, 1>("uint8_t");
}

/// `FAILSAFE_USUAL` gives the same parameters as `for_clock` in Rust.
#[test]
fn the_usual_parameters_are_those_of_rust() {
    let clocks = [1_000_u32, 1_024, 32_768, 62_500, 16_000_000];
    let mut text = String::from("#include \"failsafe.h\"\n#include <stdio.h>\nint main(void)\n{\n");
    let mut expected = String::new();
    for clock in clocks {
        let poll_every = clock / 50;
        writeln!(
            text,
            "    {{ const uint32_t all[7] = {{FAILSAFE_USUAL({clock}U, {poll_every}U)}}; uint8_t i;\n\
             for (i = 0U; i < 7U; i++) {{ printf(\"%lu\\n\", (unsigned long)all[i]); }} }}"
        )
        .unwrap();
        let p = FailsafeParameters::for_clock(clock, poll_every, [0_u8; 1]);
        let frames = u32::from(p.frames_to_start);
        let first = [p.longest_step, p.hold_after, p.ramp_after, frames];
        let last = [p.approach_for, p.approach_travel, p.live_travel];
        for number in [&first[..], &last].concat() {
            writeln!(expected, "{number}").unwrap();
        }
    }
    let text = text + "    return 0;\n}\n";
    let program = GCC.program("usual.c", &[("usual.c", &text)], &[]);
    assert_eq!(program.run(&[]), expected);
}
