#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use framelock::Phase;

use super::super::script::PARKED;
use super::super::station::Tally;
use super::*;

/// As the command line has it if nothing is asked for.
pub(in super::super) const DEFAULT: Plan = Plan {
    seed: 1,
    seconds: 26,
    drop: 0.004,
    flip: 0.0005,
    baud: 115_200,
    rate: 50,
    idle_gap: None,
};

const FAULTLESS: Plan = Plan {
    drop: 0.0,
    flip: 0.0,
    ..DEFAULT
};

fn simulation(plan: Plan) -> Simulation {
    Simulation::new(plan).unwrap()
}

fn finished(plan: Plan) -> Simulation {
    let mut simulation = simulation(plan);
    simulation.advance_to(simulation.end());
    assert!(simulation.is_over());
    simulation
}

/// Lines from good to hopeless, some busy without a pause, each with several seeds.
fn lines() -> impl Iterator<Item = Plan> {
    let rates = [
        (0.004, 0.0005),
        (0.05, 0.0),
        (0.0, 0.05),
        (0.02, 0.02),
        (0.3, 0.3),
        (1.0, 0.0),
        (0.0, 1.0),
    ];
    let speeds = [(115_200, 50), (7_000, 100), (300, 1)];
    rates.into_iter().flat_map(move |(drop, flip)| {
        speeds.into_iter().flat_map(move |(baud, rate)| {
            (0..5).map(move |seed| Plan {
                seed,
                drop,
                flip,
                baud,
                rate,
                ..DEFAULT
            })
        })
    })
}

#[test]
fn without_faults_nothing_is_lost_wrong_or_discarded() {
    for seed in 0..10 {
        for rate in [1, 7, 50, 1600] {
            let plan = Plan {
                seed,
                rate,
                ..FAULTLESS
            };
            let simulation = finished(plan);
            assert_eq!(simulation.broken(), 0);
            assert!(simulation.sent() > 0);
            for report in simulation.reports() {
                let expected = Tally {
                    received: simulation.sent(),
                    // At one frame a second the silence is too short for the failsafe.
                    engagements: u64::from(rate > 1),
                    longest_silence: simulation.longest_pause(),
                    ..Tally::default()
                };
                assert_eq!(report.tally, expected, "{plan:?}");
                assert_eq!(report.counters.discarded.total(), 0);
            }
        }
    }
}

#[test]
fn what_comes_of_it_depends_on_the_plan_only() {
    let at_once = finished(DEFAULT);
    for step in [1, 33, 700, 5_000] {
        let mut in_steps = simulation(DEFAULT);
        while !in_steps.is_over() {
            in_steps.advance_to(in_steps.now() + Duration::from_millis(step));
        }
        assert_eq!(in_steps.reports(), at_once.reports(), "{step} ms");
        assert_eq!(in_steps.sent(), at_once.sent());
        assert_eq!(in_steps.broken(), at_once.broken());
        assert_eq!(in_steps.longest_pause(), at_once.longest_pause());
    }
    let other = Plan { seed: 2, ..DEFAULT };
    assert_ne!(finished(other).reports(), at_once.reports());
}

#[test]
fn every_frame_and_every_byte_is_accounted_for() {
    for plan in lines() {
        let simulation = finished(plan);
        for Report {
            state,
            tally,
            counters,
            ..
        } in simulation.reports()
        {
            assert_eq!(tally.received + tally.lost, simulation.sent(), "{plan:?}");
            assert_eq!(tally.received + tally.wrong, counters.frames, "{plan:?}");
            assert!(tally.lost_though_whole <= tally.lost, "{plan:?}");
            let pending = state.bytes_taken() as u64;
            assert_eq!(
                counters.bytes,
                7 * counters.frames + counters.discarded.total() + pending,
                "{plan:?}"
            );
            assert!(tally.longest_silence <= simulation.end());
        }
    }
}

/// Under Rescan a frame that arrives whole is committed, unless an earlier commit ends inside it;
/// that one is wrong, and ends inside no other frame.
#[test]
fn the_receiver_loses_a_whole_frame_only_to_a_wrong_commit() {
    for plan in lines() {
        let simulation = finished(plan);
        let [_, rescan] = simulation.reports();
        assert!(
            rescan.tally.lost_though_whole <= rescan.tally.wrong,
            "{plan:?}"
        );
        let whole = simulation.sent() - simulation.broken();
        assert!(
            rescan.tally.received + rescan.tally.wrong >= whole,
            "{plan:?}"
        );
    }
}

#[test]
fn the_difference_is_to_be_seen_with_any_seed() {
    for seed in 0..20 {
        let [discard, rescan] = finished(Plan { seed, ..DEFAULT }).reports();
        assert!(discard.tally.lost > rescan.tally.lost + 150, "{seed}");
        assert!(discard.tally.lost_though_whole > 200, "{seed}");
        assert!(rescan.tally.lost_though_whole <= 1, "{seed}");
        assert!(discard.tally.engagements > rescan.tally.engagements);
    }
}

/// A parked simulator and one lost byte: the lecture's machine never commits again, although the
/// line is faultless from then on.
#[test]
fn parked_the_lectures_machine_goes_deaf_and_the_receiver_does_not() {
    for seed in 0..20 {
        let mut simulation = simulation(Plan { seed, ..DEFAULT });
        while simulation.passage() != Passage::Parked {
            simulation.advance_to(simulation.now() + Duration::from_millis(20));
        }
        let lost_before = simulation.reports().map(|report| report.tally.lost);
        let broken_before = simulation.broken();
        while simulation.broken() == broken_before {
            simulation.advance_to(simulation.now() + Duration::from_millis(20));
        }
        let heard = simulation.reports().map(|report| report.counters.frames);
        let sent = simulation.sent();
        simulation.advance_to(Duration::from_millis(22_990));
        assert_eq!(simulation.passage(), Passage::Parked);
        assert_eq!(simulation.last_sent(), Some(PARKED));

        let sent = simulation.sent() - sent;
        assert!(sent > 200);
        let [discard, rescan] = simulation.reports();
        assert_eq!(discard.counters.frames, heard[0], "seed {seed}");
        assert_eq!(discard.output.phase, Phase::Parked);
        assert_eq!(rescan.counters.frames, heard[1] + sent, "seed {seed}");
        assert_eq!(rescan.tally.lost, lost_before[1] + 1);
        assert_eq!(rescan.output.phase, Phase::Live);
        assert_eq!(rescan.output.setpoint, PARKED);
    }
}

#[test]
fn in_the_silence_the_failsafe_holds_moves_to_park_and_comes_back() {
    let mut simulation = simulation(FAULTLESS);
    let mut phases = vec![Phase::Parked];
    assert_eq!(simulation.reports()[0].output.phase, Phase::Parked);
    while !simulation.is_over() {
        simulation.advance_to(simulation.now() + Duration::from_millis(10));
        let [discard, rescan] = simulation.reports().map(|report| report.output.phase);
        assert_eq!(discard, rescan);
        phases.push(discard);
    }
    phases.dedup();
    assert_eq!(
        phases,
        [
            Phase::Parked,
            Phase::Live,
            Phase::Hold,
            Phase::Ramp,
            Phase::Parked,
            Phase::Approach,
            Phase::Live,
        ]
    );
}

#[test]
fn with_an_idle_gap_rule_the_lectures_machine_finds_every_frame_too() {
    for seed in 0..10 {
        let plan = Plan {
            seed,
            drop: 0.02,
            idle_gap: Some(20),
            ..DEFAULT
        };
        for report in finished(plan).reports() {
            assert_eq!(report.tally.lost_though_whole, 0, "{plan:?}");
            assert!(report.counters.events.idle > 1000);
        }
    }
}

#[test]
fn a_fault_is_shown_from_the_first_byte_of_its_frame() {
    let mut simulation = simulation(DEFAULT);
    while simulation.recent().close_up().len() < 21 {
        simulation.advance_to(simulation.now() + Duration::from_millis(1));
    }
    let places = simulation.recent().close_up().iter().map(|byte| byte.place);
    assert!(places.eq((0..21).map(|index| index % 7)));
    let first = simulation.recent().close_up().iter().take(7);
    assert!(first.clone().any(|byte| byte.received != Some(byte.sent)));
    assert_eq!(simulation.recent().last(9).count(), 9);
}
