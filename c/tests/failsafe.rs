//! Tests that the failsafe in C behaves like the failsafe in Rust: each poll returns the same output and phase.

use std::fmt::Write as _;
use std::process::Command;

use framelock::motion::{Demand, Failsafe, FailsafeParameters, Phase};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::compilers::{CLANGXX, GCC, beside, succeeds};
use crate::headers;

/// Steps, and the expected output, which is that of the Rust failsafe.
struct Trial {
    steps: Vec<u8>,
    said: String,
    phases: [usize; 5],
}

impl Trial {
    /// Returns a trial with random parameters and steps.
    #[expect(clippy::too_many_lines, reason = "one draw after another")]
    fn new<D: Demand, const AXES: usize>(random: &mut ChaCha8Rng) -> Self {
        let most = D::try_from(u16::MAX).map_or(u16::from(u8::MAX), |_| u16::MAX);
        let demand = |random: &mut ChaCha8Rng| {
            let any = random.random_range(0..=most);
            *[0, 1, most, any, any, any].choose(random).unwrap()
        };
        let demands = |random: &mut ChaCha8Rng| [(); AXES].map(|()| demand(random));
        let of = |all: [u16; AXES]| all.map(|it| D::try_from(it).ok().unwrap());
        // Half of the trials have long times, and some have times of any length.
        let long = *[1, 1, u32::from(most) / 50, 10_000_000]
            .choose(random)
            .unwrap();
        let time = |random: &mut ChaCha8Rng, least: u32, most: u32| match random.random_range(0..60)
        {
            0 => least.saturating_sub(1),
            _ => least.saturating_add(random.random_range(0..most) * long),
        };
        let longest_step = time(random, 1, 10);
        let hold_after = time(random, longest_step, 60);
        let live = time(random, longest_step.saturating_mul(4), 40);
        let parameters = FailsafeParameters {
            park: of(demands(random)),
            longest_step,
            hold_after,
            ramp_after: time(random, hold_after, 200),
            frames_to_start: match random.random_range(0..60) {
                0 => random.random_range(0..2),
                _ => random.random_range(2..6),
            },
            approach_for: time(random, 1, 100),
            approach_travel: time(random, live, 200),
            live_travel: live,
        };
        let mut now: u32 = if random.random() {
            random.random()
        } else {
            u32::MAX - 500
        };
        let mut steps = vec![];
        let add = |steps: &mut Vec<u8>, all: [u16; AXES]| {
            steps.extend(all.iter().flat_map(|it| it.to_le_bytes()));
        };
        add(&mut steps, parameters.park.map(Into::into));
        for time in [longest_step, hold_after, parameters.ramp_after] {
            steps.extend(time.to_le_bytes());
        }
        steps.push(parameters.frames_to_start);
        for time in [
            parameters.approach_for,
            parameters.approach_travel,
            parameters.live_travel,
            now,
        ] {
            steps.extend(time.to_le_bytes());
        }
        let (mut said, mut phases) = (String::new(), [0; 5]);
        let Ok(mut failsafe) = Failsafe::new(parameters, now) else {
            said.push_str("contradiction\n");
            return Self {
                steps,
                said,
                phases,
            };
        };
        writeln!(said, "{}", parameters.most_per_poll()).unwrap();
        let mut all = demands(random);
        for _ in 0..600 {
            match random.random_range(0..200) {
                0..100 => {
                    if random.random_range(0..12) == 0 {
                        all = demands(random);
                    }
                    steps.push(0);
                    add(&mut steps, all);
                    failsafe.frame(of(all));
                }
                100 => {
                    let all = demands(random);
                    steps.push(2);
                    steps.extend(now.to_le_bytes());
                    add(&mut steps, all);
                    failsafe = Failsafe::resumed(parameters, now, of(all)).unwrap();
                }
                _ => {
                    now = now.wrapping_add(match random.random_range(0..60) {
                        0 => random.random(),
                        1 => 0_u32.wrapping_sub(random.random_range(0..5)),
                        2 => random.random_range(0..hold_after.saturating_mul(2).max(1)),
                        3 => random.random_range(0..parameters.ramp_after.saturating_mul(2).max(1)),
                        _ => random.random_range(0..=longest_step),
                    });
                    steps.push(1);
                    steps.extend(now.to_le_bytes());
                    let output = failsafe.poll(now);
                    let phase = match output.phase {
                        Phase::Live => 0,
                        Phase::Approach => 1,
                        Phase::Hold => 2,
                        Phase::Ramp => 3,
                        _ => 4,
                    };
                    phases[phase] += 1;
                    write!(said, "{phase}").unwrap();
                    for axis in output.axes {
                        write!(said, " {}", axis.into()).unwrap();
                    }
                    writeln!(
                        said,
                        ", {} {} {}",
                        failsafe.clock_faults(),
                        failsafe.late_polls(),
                        failsafe.slow_frames()
                    )
                    .unwrap();
                }
            }
        }
        Self {
            steps,
            said,
            phases,
        }
    }
}

fn check<D: Demand, const AXES: usize>(demand: &str) {
    let here = TempDir::new().unwrap();
    let include = format!("-I{}", headers::folder().display());
    let axes = format!("-DFAILSAFE_AXES={AXES}");
    let demand = format!("-DFAILSAFE_DEMAND={demand}");
    let options = [&*include, &axes, &demand];
    let programs = [GCC, CLANGXX].map(|compiler| {
        let program = here.path().join(compiler.command[0]);
        compiler.compile_with_sanitizers(&beside("failsafe.c"), &options, &program);
        program
    });
    let mut random = ChaCha8Rng::seed_from_u64(17);
    let (mut phases, mut contradictions) = ([0; 5], 0);
    for number in 0..150 {
        let trial = Trial::new::<D, AXES>(&mut random);
        let program = &programs[number % 2];
        assert_eq!(
            succeeds(&mut Command::new(program), &trial.steps, ""),
            trial.said
        );
        phases
            .iter_mut()
            .zip(trial.phases)
            .for_each(|(sum, count)| *sum += count);
        contradictions += usize::from(trial.said == "contradiction\n");
    }
    assert!(phases.iter().all(|count| *count > 100), "{phases:?}");
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
