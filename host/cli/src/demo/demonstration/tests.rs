#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use framelock::motion::Phase;
use framelock_simulation::Fate;

use super::super::script::STILL;
use super::*;

/// The arguments of a demonstration without options.
pub(in super::super) const DEFAULT: Arguments = Arguments {
    seed: 1,
    seconds: 20,
    drop: 0.02,
    flip: 0.002,
    baud: 115_200,
    rate: 10,
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

/// Returns the reports of the lecture's machine and of framelock.
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

/// Returns the arguments for lines from good to hopeless, some of them without pauses, with five seeds each.
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
    let speeds = [(115_200, 50), (3_500, 50), (300, 1)];
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
            let demonstration = finished(arguments.clone());
            assert_eq!(broken(&demonstration), 0);
            let sent = line(&demonstration).frames_sent;
            assert!(sent > 0);
            for report in reports(&demonstration) {
                assert_eq!(report.tally.delivered, sent, "{arguments:?}");
                assert_eq!((report.lost, report.wrong), (0, 0), "{arguments:?}");
                assert_eq!(report.tally.lost_intact, 0);
                assert_eq!(report.tally.bytes_discarded, 0);
                // At one frame per second, the silence lasts exactly as long as the failsafe waits, so the failsafe
                // need not engage.
                assert!(report.tally.engagements == 1 || rate == 1);
                assert_eq!(report.longest_deafness, Duration::ZERO);
            }
        }
    }
}

#[test]
fn the_results_depend_only_on_the_arguments() {
    let at_once = finished(DEFAULT);
    for step in [1, 33, 700, 5_000] {
        let mut in_steps = demonstration(DEFAULT);
        while !in_steps.is_over() {
            in_steps.advance_to(in_steps.now + Duration::from_millis(step));
        }
        assert_eq!(in_steps.report(), at_once.report(), "{step} ms");
    }
    let other = Arguments { seed: 2, ..DEFAULT };
    assert_ne!(finished(other).report(), at_once.report());
}

/// The numbers of marks in the lanes equal the simulation's counts, and the view shows every byte.
#[test]
fn every_frame_and_every_byte_is_accounted_for() {
    for arguments in lines() {
        let demonstration = finished(arguments.clone());
        let line = line(&demonstration);
        let due = u64::from(arguments.seconds * arguments.rate);
        let stations = demonstration.trial.stations();
        let pending = stations.map(|(each, _)| each.pending());
        for ((report, lane), pending) in reports(&demonstration)
            .iter()
            .zip(&demonstration.lanes)
            .zip(pending)
        {
            let count =
                |fate: Option<Fate>| lane.last(1000).filter(|each| *each == fate).count() as u64;
            let tally = &report.tally;
            let [delivered, missed, wrong] =
                [Fate::Delivered, Fate::Missed, Fate::Wrong].map(|fate| count(Some(fate)));
            assert_eq!(due - count(None), line.frames_sent);
            assert_eq!(delivered, tally.delivered, "{arguments:?}");
            assert_eq!(missed + count(Some(Fate::Broken)) + wrong, report.lost);
            assert_eq!(delivered + report.lost, line.frames_sent);
            assert!(missed <= tally.lost_intact, "{arguments:?}");
            assert!(wrong <= report.wrong, "{arguments:?}");
            assert!(tally.lost_intact <= report.lost, "{arguments:?}");
            let bytes = 7 * commits(report) + tally.bytes_discarded + pending as u64;
            assert_eq!(line.bytes_delivered, bytes, "{arguments:?}");
        }
        // A frame that arrives whole is committed, unless a wrongly committed frame ends inside it. Each wrongly
        // committed frame ends inside at most one whole frame.
        let [_, framelock] = reports(&demonstration);
        assert!(framelock.tally.lost_intact <= framelock.wrong);
        assert!(commits(&framelock) >= line.frames_intact, "{arguments:?}");
    }
}

#[test]
fn every_seed_shows_the_difference() {
    for seed in 0..20 {
        let [lecture, framelock] = reports(&finished(Arguments { seed, ..DEFAULT }));
        assert!(lecture.lost > framelock.lost + 55, "{seed}");
        assert!(lecture.tally.lost_intact > 55, "{seed}");
        assert!(framelock.tally.lost_intact <= 1, "{seed}");
        assert!(lecture.tally.engagements > framelock.tally.engagements);
        let [lecture, framelock] = [lecture, framelock].map(|each| each.longest_deafness);
        assert!(lecture > Duration::from_millis(5_500), "{seed}");
        assert!(framelock <= Duration::from_millis(100), "{seed}");
    }
}

/// While the seat stands still, one byte is lost. The lecture's machine never commits again, although
/// the line has no more faults.
#[test]
fn one_lost_byte_makes_the_lectures_machine_deaf_and_the_receiver_not() {
    for seed in 0..20 {
        let mut demonstration = demonstration(Arguments { seed, ..DEFAULT });
        while broken(&demonstration) == 0 {
            assert_eq!(reports(&demonstration).map(|report| report.lost), [0, 0]);
            demonstration.advance_to(demonstration.now + Duration::from_millis(20));
        }
        // The byte is lost early, so that a viewer sees the deafness within five seconds.
        assert!(demonstration.now < Duration::from_secs(3));
        let heard = reports(&demonstration).map(|report| commits(&report));
        let sent = line(&demonstration).frames_sent;
        demonstration.advance_to(Duration::from_millis(7_950));
        assert_eq!(demonstration.passage(), Passage::Still);
        assert_eq!(demonstration.last_sent, Some(STILL));

        let sent = line(&demonstration).frames_sent - sent;
        assert!(sent > 50);
        let [lecture, framelock] = reports(&demonstration);
        assert_eq!(commits(&lecture), heard[0], "seed {seed}");
        assert_eq!(lecture.output.phase, Phase::Parked);
        // The machine has been deaf since the frame after the broken frame. The frame after the broken frame was due at
        // 2.1 s.
        assert_eq!(lecture.deaf, Some(Duration::from_millis(5_850)));
        assert_eq!(lecture.longest_deafness, Duration::from_millis(5_850));
        assert_eq!(commits(&framelock), heard[1] + sent, "seed {seed}");
        assert_eq!(framelock.lost, 1);
        assert_eq!(framelock.deaf, None);
        assert_eq!(framelock.output.phase, Phase::Live);
        assert_eq!(Setpoint::from(framelock.output.axes), STILL);

        // While nothing is sent, no frame can be missed.
        demonstration.advance_to(Duration::from_secs(15));
        assert_eq!(demonstration.passage(), Passage::Silence);
        assert_eq!(reports(&demonstration).map(|report| report.deaf), [None; 2]);
    }
}

#[test]
fn in_the_silence_the_failsafe_holds_moves_to_park_and_comes_back() {
    let mut demonstration = demonstration(FAULTLESS);
    let mut phases = vec![Phase::Parked];
    assert_eq!(reports(&demonstration)[0].output.phase, Phase::Parked);
    while !demonstration.is_over() {
        demonstration.advance_to(demonstration.now + Duration::from_millis(10));
        let [lecture, framelock] = reports(&demonstration).map(|report| report.output.phase);
        assert_eq!(lecture, framelock);
        phases.push(lecture);
    }
    phases.dedup();
    assert_eq!(
        phases,
        [
            Phase::Parked,
            Phase::Approach,
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
fn a_fault_is_shown_from_the_first_byte_of_its_frame() {
    let mut demonstration = demonstration(DEFAULT);
    let faults = |demonstration: &Demonstration| {
        let places = demonstration.bytes.close_up.iter().map(|byte| byte.place);
        assert!(places.eq((0..21).map(|index| index % 7)));
        let first = demonstration.bytes.close_up.iter().take(7);
        first.filter(|byte| byte.is_fault()).count()
    };
    demonstration.advance_to(Duration::from_secs(1));
    assert_eq!(faults(&demonstration), 0);
    // At 3 s, the close-up shows the byte that is lost while the seat stands still. At 10 s, the close-up shows a byte
    // that is lost or changed while the seat moves.
    for seconds in [3, 10] {
        demonstration.advance_to(Duration::from_secs(seconds));
        assert_eq!(faults(&demonstration), 1);
    }
}
