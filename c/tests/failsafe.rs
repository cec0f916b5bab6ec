//! Tests that the failsafe in C behaves like the failsafe in Rust: each poll returns the same output and phase.

use std::fmt::Write as _;
use std::num::NonZeroU32;
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
        let rate = |random: &mut ChaCha8Rng| match random.random_range(0..8) {
            0 if random.random_range(0..9) == 0 => u32::MAX,
            1 if random.random_range(0..9) == 0 => random.random::<u32>().max(1),
            2..5 => random.random_range(1..40),
            _ => 1,
        };
        let demand = |random: &mut ChaCha8Rng| {
            let any = random.random_range(0..=most);
            *[0, 1, most, any, any, any].choose(random).unwrap()
        };
        let demands = |random: &mut ChaCha8Rng| [(); AXES].map(|()| demand(random));
        let of = |all: [u16; AXES]| all.map(|it| D::try_from(it).ok().unwrap());
        let long = if random.random() {
            1
        } else {
            u32::from(most) / 50
        };
        let hold_after = random.random_range(0..60_u32) * long;
        let ramp_after = match random.random_range(0..8) {
            0 => hold_after.saturating_sub(1),
            _ => (random.random_range(0..200_u32) * long).max(hold_after),
        };
        let park = demands(random);
        let rates = [(); AXES].map(|()| rate(random));
        let mut now: u32 = if random.random() {
            random.random()
        } else {
            u32::MAX - 500
        };
        let mut steps = [hold_after.to_le_bytes(), ramp_after.to_le_bytes()].concat();
        let add = |steps: &mut Vec<u8>, all: [u16; AXES]| {
            steps.extend(all.iter().flat_map(|it| it.to_le_bytes()));
        };
        add(&mut steps, park);
        steps.extend(rates.iter().flat_map(|it| it.to_le_bytes()));
        steps.extend(now.to_le_bytes());
        let parameters = FailsafeParameters {
            hold_after,
            ramp_after,
            park: of(park),
            ticks_per_unit: rates.map(|it| NonZeroU32::new(it).unwrap()),
        };
        let (mut said, mut phases) = (String::new(), [0; 5]);
        let mut all = park;
        // In some trials, so many ticks pass that an axis can reach a 16-bit demand.
        let ticks = if random.random() {
            12
        } else {
            u32::from(most) / 3
        };
        let Ok(mut failsafe) = Failsafe::new(parameters, now) else {
            said.push_str("contradiction\n");
            return Self {
                steps,
                said,
                phases,
            };
        };
        for _ in 0..400 {
            now = now.wrapping_add(match random.random_range(0..50) {
                0 => random.random(),
                1 => 0_u32.wrapping_sub(random.random_range(0..5)),
                2..6 => random.random_range(0..3_000),
                _ => random.random_range(0..ticks.min(hold_after.max(2))),
            });
            match random.random_range(0..60) {
                0..30 => {
                    if random.random_range(0..12) == 0 {
                        all = demands(random);
                    }
                    steps.push(0);
                    steps.extend(now.to_le_bytes());
                    add(&mut steps, all);
                    failsafe.frame(now, of(all));
                }
                30 => {
                    let all = demands(random);
                    steps.push(2);
                    steps.extend(now.to_le_bytes());
                    add(&mut steps, all);
                    failsafe = Failsafe::resumed(parameters, now, of(all)).unwrap();
                }
                _ => {
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
                    said.push('\n');
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
