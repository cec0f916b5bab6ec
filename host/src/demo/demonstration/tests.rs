#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use framelock::Phase;

use super::super::script::PARKED;
use super::*;

/// As the command line has it if nothing is asked for.
pub(in super::super) const DEFAULT: Arguments = Arguments {
    seed: 1,
    seconds: 26,
    drop: 0.004,
    flip: 0.0005,
    baud: 115_200,
    rate: 50,
    idle_gap: None,
    speed: 1.0,
    plain: false,
};

const FAULTLESS: Arguments = Arguments {
    drop: 0.0,
    flip: 0.0,
    ..DEFAULT
};

fn demonstration(arguments: Arguments) -> Demonstration {
    Demonstration::new(arguments).unwrap()
}

fn finished(arguments: Arguments) -> Demonstration {
    let mut demonstration = demonstration(arguments);
    demonstration.advance_to(demonstration.end());
    assert!(demonstration.is_over());
    demonstration
}

/// Of the lecture's machine and of the receiver.
fn reports(demonstration: &Demonstration) -> [Report; 2] {
    demonstration.report().1.try_into().unwrap()
}

fn line(demonstration: &Demonstration) -> LineTally {
    demonstration.report().0
}

fn commits(report: &Report) -> u64 {
    report.tally.delivered + report.wrong
}

fn broken(demonstration: &Demonstration) -> u64 {
    let line = line(demonstration);
    line.frames_sent - line.frames_intact
}

/// Lines from good to hopeless, some busy without a pause, each with several seeds.
fn lines() -> impl Iterator<Item = Arguments> {
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
            (0..5).map(move |seed| Arguments {
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
            let arguments = Arguments {
                seed,
                rate,
                ..FAULTLESS
            };
            let demonstration = finished(arguments);
            assert_eq!(broken(&demonstration), 0);
            let sent = line(&demonstration).frames_sent;
            assert!(sent > 0);
            for report in reports(&demonstration) {
                assert_eq!(report.tally.delivered, sent, "{arguments:?}");
                assert_eq!((report.lost, report.wrong), (0, 0), "{arguments:?}");
                assert_eq!(report.tally.lost_intact, 0);
                assert_eq!(report.tally.bytes_discarded, 0);
                // At one frame a second the silence is too short for the failsafe.
                assert_eq!(report.tally.engagements, u64::from(rate > 1));
                let silence = Duration::from_micros(report.tally.longest_silence);
                let difference = silence.abs_diff(demonstration.longest_pause());
                assert!(difference < Duration::from_millis(1), "{difference:?}");
            }
        }
    }
}

#[test]
fn what_comes_of_it_depends_on_the_arguments_only() {
    let at_once = finished(DEFAULT);
    for step in [1, 33, 700, 5_000] {
        let mut in_steps = demonstration(DEFAULT);
        while !in_steps.is_over() {
            in_steps.advance_to(in_steps.now + Duration::from_millis(step));
        }
        assert_eq!(in_steps.report(), at_once.report(), "{step} ms");
        assert_eq!(in_steps.longest_pause(), at_once.longest_pause());
    }
    let other = Arguments { seed: 2, ..DEFAULT };
    assert_ne!(finished(other).report(), at_once.report());
}

#[test]
fn every_frame_and_every_byte_is_accounted_for() {
    for arguments in lines() {
        let demonstration = finished(arguments);
        let line = line(&demonstration);
        for report in reports(&demonstration) {
            let tally = &report.tally;
            assert_eq!(
                tally.delivered + report.lost,
                line.frames_sent,
                "{arguments:?}"
            );
            assert!(tally.lost_intact <= report.lost, "{arguments:?}");
            let bytes = 7 * commits(&report) + tally.bytes_discarded + report.pending as u64;
            assert_eq!(line.bytes_delivered, bytes, "{arguments:?}");
        }
    }
}

/// Under Rescan a frame that arrives whole is committed, unless an earlier commit ends inside it;
/// that one is wrong, and ends inside no other frame.
#[test]
fn the_receiver_loses_a_whole_frame_only_to_a_wrong_commit() {
    for arguments in lines() {
        let demonstration = finished(arguments);
        let [_, rescan] = reports(&demonstration);
        assert!(rescan.tally.lost_intact <= rescan.wrong, "{arguments:?}");
        let whole = line(&demonstration).frames_intact;
        assert!(
            rescan.tally.delivered + rescan.wrong >= whole,
            "{arguments:?}"
        );
    }
}

#[test]
fn the_difference_is_to_be_seen_with_any_seed() {
    for seed in 0..20 {
        let [discard, rescan] = reports(&finished(Arguments { seed, ..DEFAULT }));
        assert!(discard.lost > rescan.lost + 150, "{seed}");
        assert!(discard.tally.lost_intact > 200, "{seed}");
        assert!(rescan.tally.lost_intact <= 1, "{seed}");
        assert!(discard.tally.engagements > rescan.tally.engagements);
    }
}

/// A parked simulator and one lost byte: the lecture's machine never commits again, although the
/// line is faultless from then on.
#[test]
fn parked_the_lectures_machine_goes_deaf_and_the_receiver_does_not() {
    for seed in 0..20 {
        let mut demonstration = demonstration(Arguments { seed, ..DEFAULT });
        while demonstration.passage() != Passage::Parked {
            demonstration.advance_to(demonstration.now + Duration::from_millis(20));
        }
        let lost_before = reports(&demonstration).map(|report| report.lost);
        let broken_before = broken(&demonstration);
        while broken(&demonstration) == broken_before {
            demonstration.advance_to(demonstration.now + Duration::from_millis(20));
        }
        let heard = reports(&demonstration).map(|report| commits(&report));
        let sent = line(&demonstration).frames_sent;
        demonstration.advance_to(Duration::from_millis(22_990));
        assert_eq!(demonstration.passage(), Passage::Parked);
        assert_eq!(demonstration.last_sent, Some(PARKED));

        let sent = line(&demonstration).frames_sent - sent;
        assert!(sent > 200);
        let [discard, rescan] = reports(&demonstration);
        assert_eq!(commits(&discard), heard[0], "seed {seed}");
        assert_eq!(discard.output.phase, Phase::Parked);
        assert_eq!(commits(&rescan), heard[1] + sent, "seed {seed}");
        assert_eq!(rescan.lost, lost_before[1] + 1);
        assert_eq!(rescan.output.phase, Phase::Live);
        assert_eq!(rescan.output.setpoint, PARKED);
    }
}

#[test]
fn in_the_silence_the_failsafe_holds_moves_to_park_and_comes_back() {
    let mut demonstration = demonstration(FAULTLESS);
    let mut phases = vec![Phase::Parked];
    assert_eq!(reports(&demonstration)[0].output.phase, Phase::Parked);
    while !demonstration.is_over() {
        demonstration.advance_to(demonstration.now + Duration::from_millis(10));
        let [discard, rescan] = reports(&demonstration).map(|report| report.output.phase);
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
        let arguments = Arguments {
            seed,
            drop: 0.02,
            idle_gap: Some(20),
            ..DEFAULT
        };
        for report in reports(&finished(arguments)) {
            assert_eq!(report.tally.lost_intact, 0, "{arguments:?}");
        }
    }
}

#[test]
fn a_fault_is_shown_from_the_first_byte_of_its_frame() {
    let mut demonstration = demonstration(DEFAULT);
    while demonstration.recent.close_up.len() < 21 {
        demonstration.advance_to(demonstration.now + Duration::from_millis(1));
    }
    let places = demonstration.recent.close_up.iter().map(|byte| byte.place);
    assert!(places.eq((0..21).map(|index| index % 7)));
    let first = demonstration.recent.close_up.iter().take(7);
    assert!(first.clone().any(|byte| byte.received != Some(byte.sent)));
    assert_eq!(demonstration.recent.last(9).count(), 9);
}

#[test]
fn the_samples_are_those_of_the_last_ten_seconds() {
    let demonstration = finished(DEFAULT);
    let times: Vec<_> = demonstration.samples.iter().map(|(at, _)| *at).collect();
    assert_eq!(times.len(), 100);
    assert!(times.is_sorted_by(|later, earlier| *later >= *earlier + SAMPLE_EVERY));
    let [latest, .., oldest] = times[..] else {
        panic!("a hundred");
    };
    assert!(demonstration.now.abs_diff(latest) < 2 * SAMPLE_EVERY);
    assert!(latest.abs_diff(oldest) < Duration::from_millis(10_500));
}
