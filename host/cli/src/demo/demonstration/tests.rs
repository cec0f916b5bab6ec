#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use framelock::motion::Phase;
use framelock_simulation::Fate;

use super::super::script::STILL;
use super::*;

fn demonstration() -> Demonstration {
    Demonstration::new().unwrap()
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

#[test]
fn the_results_do_not_depend_on_the_steps() {
    let mut at_once = demonstration();
    at_once.advance_to(END);
    for step in [1, 33, 700, 5_000] {
        let mut in_steps = demonstration();
        while !in_steps.is_over() {
            in_steps.advance_to(in_steps.now + Duration::from_millis(step));
        }
        assert_eq!(in_steps.report(), at_once.report(), "{step} ms");
    }
}

/// The numbers of marks in the lanes equal the simulation's counts, and the view shows every byte.
#[test]
fn every_frame_and_every_byte_is_accounted_for() {
    let mut demonstration = demonstration();
    demonstration.advance_to(END);
    let line = line(&demonstration);
    let stations = demonstration.trial.stations();
    let pending = stations.map(|(each, _)| each.pending());
    for ((report, lane), pending) in reports(&demonstration)
        .iter()
        .zip(&demonstration.lanes)
        .zip(pending)
    {
        let count = |fate: Option<Fate>| lane.last(200).filter(|each| *each == fate).count() as u64;
        let tally = &report.tally;
        let [delivered, missed, wrong] =
            [Fate::Delivered, Fate::Missed, Fate::Wrong].map(|fate| count(Some(fate)));
        assert_eq!(200 - count(None), line.frames_sent);
        assert_eq!(delivered, tally.delivered);
        assert_eq!(missed + count(Some(Fate::Broken)) + wrong, report.lost);
        assert_eq!(delivered + report.lost, line.frames_sent);
        assert!(missed <= tally.lost_intact && tally.lost_intact <= report.lost);
        assert!(wrong <= report.wrong);
        let bytes = 7 * commits(report) + tally.bytes_discarded + pending as u64;
        assert_eq!(line.bytes_delivered, bytes);
    }
    // A frame that arrives whole is committed, unless a wrongly committed frame ends inside it. Each wrongly
    // committed frame ends inside at most one whole frame.
    let [_, framelock] = reports(&demonstration);
    assert!(framelock.tally.lost_intact <= framelock.wrong);
    assert!(commits(&framelock) >= line.frames_intact);
}

/// While the seat stands still, one byte is lost. The lecture's machine never commits again, although
/// the line has no more faults.
#[test]
fn one_lost_byte_makes_the_lectures_machine_deaf_and_the_receiver_not() {
    let mut demonstration = demonstration();
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
    assert_eq!(commits(&lecture), heard[0]);
    assert_eq!(lecture.output.phase, Phase::Parked);
    // The machine has been deaf since the frame after the broken frame. The frame after the broken frame was due at
    // 2.1 s.
    assert_eq!(lecture.deaf, Some(Duration::from_millis(5_850)));
    assert_eq!(lecture.longest_deafness, Duration::from_millis(5_850));
    assert_eq!(commits(&framelock), heard[1] + sent);
    assert_eq!(framelock.lost, 1);
    assert_eq!(framelock.deaf, None);
    assert_eq!(framelock.output.phase, Phase::Live);
    assert_eq!(Setpoint::from(framelock.output.axes), STILL);

    // While nothing is sent, no frame can be missed.
    demonstration.advance_to(Duration::from_secs(15));
    assert_eq!(demonstration.passage(), Passage::Silence);
    assert_eq!(reports(&demonstration).map(|report| report.deaf), [None; 2]);
}

#[test]
fn in_the_silence_the_failsafe_holds_moves_to_park_and_comes_back() {
    let mut demonstration = demonstration();
    let mut phases = Vec::new();
    while !demonstration.is_over() {
        let [_, framelock] = reports(&demonstration);
        phases.push(framelock.output.phase);
        demonstration.advance_to(demonstration.now + Duration::from_millis(10));
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
    let mut demonstration = demonstration();
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
