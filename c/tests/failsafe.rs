//! Tests that the failsafe in C behaves like the failsafe in Rust: each poll returns the same output and phase. Tests
//! its promises in C alone, with the usual parameters, polls every 2 ms and a frame every 20 ms.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
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
                101 => steps.push(3),
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

/// Compiles `failsafe.c` as C and as C++.
fn programs(here: &TempDir, axes: usize, demand: &str) -> [PathBuf; 2] {
    let include = format!("-I{}", headers::folder().display());
    let axes = format!("-DFAILSAFE_AXES={axes}");
    let demand = format!("-DFAILSAFE_DEMAND={demand}");
    let options = [&*include, &axes, &demand];
    [GCC, CLANGXX].map(|compiler| {
        let program = here.path().join(compiler.command[0]);
        compiler.compile_with_sanitizers(&beside("failsafe.c"), &options, &program);
        program
    })
}

fn check<D: Demand, const AXES: usize>(demand: &str) {
    let here = TempDir::new().unwrap();
    let programs = programs(&here, AXES, demand);
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

const LIVE: u32 = 0;
const APPROACH: u32 = 1;
const HOLD: u32 = 2;
const RAMP: u32 = 3;
const PARKED: u32 = 4;

/// One line of the program's output: a poll.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Polled {
    phase: u32,
    axes: [u32; 3],
    clock_faults: u32,
    late_polls: u32,
    slow_frames: u32,
}

/// Steps for the failsafe in C, whose clock counts microseconds.
struct Script {
    steps: Vec<u8>,
    now: u32,
    polls: usize,
}

impl Script {
    const TICK: u32 = 2_000;

    /// The parameters that `FAILSAFE_USUAL(1000000, 2000)` gives, with park at 128.
    fn new() -> Self {
        let mut steps = [128_u16; 3].map(u16::to_le_bytes).concat();
        for time in [4_000_u32, 100_000, 500_000] {
            steps.extend(time.to_le_bytes());
        }
        steps.push(3);
        for time in [1_000_000_u32, 1_000_000, 200_000, 0] {
            steps.extend(time.to_le_bytes());
        }
        Self {
            steps,
            now: 0,
            polls: 0,
        }
    }

    /// A script after which all axes are live at these demands.
    fn live(at: [u8; 3]) -> Self {
        let mut script = Self::new();
        script.frames(2_500, |_| at);
        script
    }

    fn frame(&mut self, demands: [u8; 3]) {
        self.steps.push(0);
        self.steps.extend(
            demands
                .map(|demand| u16::from(demand).to_le_bytes())
                .concat(),
        );
    }

    /// Polls at this time. Returns the index of the poll.
    fn poll_at(&mut self, now: u32) -> usize {
        self.now = now;
        self.steps.push(1);
        self.steps.extend(now.to_le_bytes());
        self.polls += 1;
        self.polls - 1
    }

    fn poll(&mut self) -> usize {
        self.poll_at(self.now.wrapping_add(Self::TICK))
    }

    /// Polls for this many milliseconds, without frames. Returns the index of the last poll.
    fn silence(&mut self, milliseconds: u32) -> usize {
        (0..milliseconds / 2).map(|_| self.poll()).last().unwrap()
    }

    /// The same with a frame every 20 ms, whose demands depend on the seconds since the start of the script.
    fn frames(&mut self, milliseconds: u32, demands: impl Fn(f64) -> [u8; 3]) -> usize {
        for tick in 0..milliseconds / 2 {
            if tick % 10 == 0 {
                self.frame(demands(f64::from(self.now) / 1e6));
            }
            self.poll();
        }
        self.polls - 1
    }

    /// Runs the script in C and in C++. Returns the polls, of which no two in a row differ by more than six units.
    fn run(&self, programs: &[PathBuf; 2]) -> Vec<Polled> {
        let [said, again] = programs
            .each_ref()
            .map(|program| succeeds(&mut Command::new(program), &self.steps, ""));
        assert_eq!(said, again);
        let mut lines = said.lines();
        assert_eq!(lines.next(), Some("6"));
        let polls: Vec<Polled> = lines
            .map(|line| {
                let numbers: Vec<u32> = line
                    .split([' ', ','])
                    .filter_map(|number| number.parse().ok())
                    .collect();
                let [phase, a, b, c, clock_faults, late_polls, slow_frames] = numbers[..] else {
                    panic!("{line}");
                };
                Polled {
                    phase,
                    axes: [a, b, c],
                    clock_faults,
                    late_polls,
                    slow_frames,
                }
            })
            .collect();
        assert_eq!(polls.len(), self.polls);
        for pair in polls.windows(2) {
            for (from, to) in pair[0].axes.into_iter().zip(pair[1].axes) {
                assert!(from.abs_diff(to) <= 6, "{pair:?}");
            }
        }
        polls
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a demand"
)]
fn whole(demand: f64) -> u8 {
    demand.round() as u8
}

/// A clock that goes back, late polls, a start at the centre, motions that are never at rest, and false frames.
#[test]
fn faults_move_an_axis_no_further_than_stated() {
    let here = TempDir::new().unwrap();
    let programs = programs(&here, 3, "uint8_t");

    let mut script = Script::live([255; 3]);
    let back = script.poll_at(script.now - 1);
    let polls = script.run(&programs);
    let expected = Polled {
        clock_faults: 1,
        ..polls[back - 1]
    };
    assert_eq!((polls[back], expected.phase), (expected, LIVE));

    for (stall, has_frame, phase, at) in [
        (5_000, false, LIVE, 255),
        (5_000, true, LIVE, 249),
        (100_000, false, HOLD, 255),
        (100_000, true, HOLD, 255),
        (2_000_000, false, RAMP, 253),
        (2_000_000, true, RAMP, 253),
    ] {
        let mut script = Script::live([255; 3]);
        if has_frame {
            script.frame([0; 3]);
        }
        let late = script.poll_at(script.now + stall);
        let polled = script.run(&programs)[late];
        assert_eq!(
            (polled.phase, polled.axes),
            (phase, [at; 3]),
            "{stall} {has_frame}"
        );
        assert_eq!(polled.late_polls, 1);
    }

    let mut script = Script::new();
    let centre = script.frames(100, |_| [128; 3]);
    let moves = script.frames(100, |_| [255, 0, 255]);
    let polls = script.run(&programs);
    assert_eq!(
        (polls[centre].phase, polls[centre].axes),
        (APPROACH, [128; 3])
    );
    assert_eq!(polls[moves].phase, APPROACH);
    for axis in polls[moves].axes {
        assert!((1..=26).contains(&axis.abs_diff(128)), "{axis}");
    }

    for (amplitude, hertz) in [(60.0, [1.0; 3]), (100.0, [1.0, 1.3, 0.8])] {
        let turn = std::f64::consts::TAU;
        let motion = |time: f64| {
            [(0, 0.0), (1, 1.0), (2, 2.0)].map(|(axis, third): (usize, f64)| {
                let angle = turn * (hertz[axis] * time + third / 3.0);
                whole(128.0 + amplitude * angle.sin())
            })
        };
        let mut script = Script::new();
        let live = script.frames(2_044, motion);
        let end = script.frames(2_000, motion);
        let polls = script.run(&programs);
        assert!(polls[live..].iter().all(|polled| polled.phase == LIVE));
        let last = motion(f64::from(script.now - 20_000) / 1e6);
        for (at, demand) in polls[end].axes.into_iter().zip(last) {
            assert!(at.abs_diff(demand.into()) <= 3, "{:?} {last:?}", polls[end]);
        }
    }

    let mut script = Script::new();
    script.silence(20);
    script.frame([255, 0, 17]);
    script.silence(1_000);
    let polls = script.run(&programs);
    assert!(
        polls
            .iter()
            .all(|polled| polled.axes == [128; 3] && polled.phase == PARKED)
    );
    let mut script = Script::live([128; 3]);
    let before = script.polls - 1;
    script.frame([0, 128, 128]);
    script.silence(20);
    let polls = script.run(&programs);
    assert!(
        polls[before..]
            .iter()
            .all(|polled| polled.axes[0] >= 128 - 26)
    );
}

/// `FAILSAFE_USUAL` gives the same parameters as `for_clock` in Rust, for any clock.
#[test]
fn the_usual_parameters_are_those_of_rust() {
    let here = TempDir::new().unwrap();
    let (source, program) = (here.path().join("usual.c"), here.path().join("program"));
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
    fs::write(&source, text + "    return 0;\n}\n").unwrap();
    let include = format!("-I{}", headers::folder().display());
    GCC.compile_with_sanitizers(&source, &[&include], &program);
    assert_eq!(succeeds(&mut Command::new(program), &[], ""), expected);
}

#[test]
fn slow_frames_are_counted() {
    let here = TempDir::new().unwrap();
    let programs = programs(&here, 3, "uint8_t");
    for (frames_apart, phase, slow_frames) in [(98, LIVE, 0), (100, PARKED, 49)] {
        let mut script = Script::new();
        for _ in 0..50 {
            script.frame([128; 3]);
            script.silence(frames_apart);
        }
        let last = *script.run(&programs).last().unwrap();
        assert_eq!((last.phase, last.slow_frames), (phase, slow_frames));
    }
}
