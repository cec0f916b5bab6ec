//! What must come out where that is known beforehand, and what must hold of all that comes out.

use framelock::Phase;

use super::*;
use crate::names::FrameName;

#[test]
fn on_a_line_without_faults_nothing_is_lost() {
    let payloads = ["motion", "random", "random:40-43", "00414200", "ambiguous"];
    for (payload, rate, byte_gap, baud_error) in payloads.iter().flat_map(|payload| {
        [
            (payload, 1.0, 0, 0.0),
            (payload, 50.0, 0, -4.5),
            (payload, 1400.0, 0, 3.8),
            (payload, 500.0, 15, 2.0),
        ]
    }) {
        for frame in [FrameName::Bin, FrameName::BinCrc8] {
            let parameters = Parameters {
                payload: payload.parse().unwrap(),
                rate,
                byte_gap,
                baud_error,
                frame,
                trials: 4,
                frames: 300,
                hold_after: 5_000.0,
                ramp_after: 5_000.0,
                ..DEFAULT
            };
            let point = simulated(&parameters);
            assert_eq!(point.line.frames_sent, 1_200);
            assert_eq!(point.line.frames_intact.count, 1_200, "{parameters:?}");
            assert_eq!(point.line.framing_errors + point.line.breaks, 0);
            for receiver in &point.receivers {
                assert_eq!(receiver.delivered.count, 1_200, "{parameters:?}");
                assert_eq!(
                    receiver.false_frames.count + receiver.wrong_setpoints.count,
                    0
                );
                assert_eq!(receiver.bytes_discarded, 0);
                assert_eq!(receiver.failsafe_engagements, 0);
                // The sender's clock is that of the rate too.
                let period = 1000.0 / rate / (1.0 + baud_error / 100.0);
                assert!(receiver.longest_silence_ms < period + 1.5, "{parameters:?}");
                if let Some(error) = receiver.actuator_error {
                    assert_eq!(error.largest, 0, "{parameters:?}");
                }
            }
        }
    }
}

/// The cliff. A fast sender leaves less: see the UART's own tests.
#[test]
fn clocks_may_differ_by_four_to_five_per_cent() {
    for (baud_error, is_delivered) in [
        (-5.5, false),
        (-5.0, true),
        (0.0, true),
        (3.9, true),
        (5.0, false),
    ] {
        for rate in [50.0, 1600.0] {
            let point = simulated(&Parameters {
                baud_error,
                rate,
                trials: 4,
                frames: 100,
                ..DEFAULT
            });
            for receiver in &point.receivers {
                let expected = if is_delivered { 400 } else { 0 };
                assert_eq!(receiver.delivered.count, expected, "{baud_error} {rate}");
            }
        }
    }
}

/// Lines with every kind of fault.
fn lines() -> Vec<Parameters> {
    let base = Parameters {
        trials: 6,
        frames: 300,
        rate: 400.0,
        payload: Payload::Random(0x40, 0x43),
        ..DEFAULT
    };
    let faults = [
        Parameters {
            lose: 0.03,
            ..base.clone()
        },
        Parameters {
            duplicate: 0.03,
            ..base.clone()
        },
        Parameters {
            bit_flip: 0.003,
            ..base.clone()
        },
        Parameters {
            burst_rate: 20.0,
            ..base.clone()
        },
        Parameters {
            break_rate: 20.0,
            ..base.clone()
        },
        Parameters {
            lose: 0.1,
            duplicate: 0.1,
            bit_flip: 0.01,
            burst_rate: 5.0,
            break_rate: 5.0,
            baud_error: 4.9,
            unreported: true,
            ..base
        },
    ];
    let mut lines = Vec::new();
    for line in faults {
        for payload in ["random:40-43", "repeated:0D-42", "ambiguous", "motion"] {
            for frame in [FrameName::Bin, FrameName::BinCrc8] {
                lines.push(Parameters {
                    payload: payload.parse().unwrap(),
                    frame,
                    ..line.clone()
                });
            }
        }
    }
    lines
}

#[test]
fn every_frame_and_every_byte_is_accounted_for() {
    for parameters in lines() {
        let length = u64::from(parameters.frame_length());
        let tally = tally(&parameters);
        let line = tally.line;
        assert_eq!(line.frames_sent, 1_800);
        assert_eq!(line.bytes_sent, 1_800 * length);
        assert!(line.frames_intact < line.frames_sent, "{parameters:?}");
        for receiver in &tally.receivers {
            let commits = receiver.delivered + receiver.wrong_setpoints + receiver.false_frames;
            let held = line.bytes_delivered - length * commits - receiver.bytes_discarded;
            assert!(held < length * tally.trials, "{parameters:?}");
            assert!(receiver.delivered + receiver.lost_intact >= line.frames_intact);
            assert!(receiver.delivered <= line.frames_sent);
            let back = &receiver.resynchronisation;
            let by_frames: u64 = back.by_frames.values().sum();
            assert_eq!(by_frames, back.by_microseconds.values().sum::<u64>());
            // No intact frame is lost but on the way back, or on no way back at all.
            let on_the_way: u64 = back
                .by_frames
                .iter()
                .map(|(frames, count)| frames * count)
                .sum();
            assert!(on_the_way <= receiver.lost_intact);
            assert!(
                back.never > 0 || on_the_way == receiver.lost_intact,
                "{parameters:?}"
            );
        }
    }
}

/// Under Rescan a frame that arrives intact is committed unless an earlier commit ends inside it:
/// that one is false, and ends inside no other frame.
#[test]
fn the_receiver_loses_an_intact_frame_only_to_a_false_one() {
    for parameters in lines() {
        let [_, _, rescan, _] = tally(&parameters).receivers;
        assert!(rescan.lost_intact <= rescan.false_frames, "{parameters:?}");
    }
}

#[test]
fn what_comes_out_depends_on_the_seed_and_not_on_the_threads() {
    let parameters = lines().pop().unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| tally(&parameters))
    };
    let one = with(1);
    assert_eq!(with(3), one);
    assert_eq!(with(8), one);
    let other = tally(&Parameters {
        seed: 2,
        ..parameters
    });
    assert_ne!(other, one);
}

#[test]
fn faults_do_not_change_what_is_sent() {
    let sent = |parameters: &Parameters| {
        let mut demands = Vec::new();
        experiment::run_one(parameters, 3, &mut |sample| demands.push(sample.demand)).unwrap();
        demands
    };
    let faulty = Parameters {
        lose: 0.1,
        bit_flip: 0.01,
        ..DEFAULT
    };
    assert_eq!(sent(&faulty), sent(&DEFAULT));
}

#[test]
fn a_burst_drives_the_output_to_park_and_back() {
    let parameters = Parameters {
        trials: 1,
        frames: 200,
        burst_at: Some(1.0),
        burst_length: 1_500.0,
        ..DEFAULT
    };
    let mut phases = Vec::new();
    let tally = experiment::run_one(&parameters, 0, &mut |sample| {
        let [_, _, rescan, _] = sample.outputs;
        if phases.last() != Some(&rescan.phase) {
            phases.push(rescan.phase);
        }
    })
    .unwrap();
    let expected = [
        Phase::Parked,
        Phase::Live,
        Phase::Hold,
        Phase::Ramp,
        Phase::Parked,
        Phase::Approach,
        Phase::Live,
    ];
    assert_eq!(phases, expected);
    let [_, _, rescan, _] = &tally.receivers;
    assert_eq!(rescan.engagements, 1);
    assert_eq!(rescan.resynchronisation.never, 0);
    // 1.5 s of burst, and at most a frame in front of it and one behind it.
    assert!(
        (1_500_000..1_545_000).contains(&rescan.longest_silence),
        "{}",
        rescan.longest_silence
    );
    assert!(tally.line.framing_errors > 100);
}

/// A receiver that is told of line errors drops the frame under way; one that is not goes on with
/// it. So the lecture's machine, told, loses an intact frame only if what the UART reads first, out
/// of step, looks like the start of one.
#[test]
fn a_reported_error_drops_the_frame_under_way() {
    let parameters = Parameters {
        break_rate: 50.0,
        break_length: 12,
        rate: 1600.0,
        payload: Payload::Random(0x40, 0x43),
        ..DEFAULT
    };
    let reported = simulated(&parameters);
    let unreported = simulated(&Parameters {
        unreported: true,
        ..parameters
    });
    assert_eq!(reported.line, unreported.line);
    assert!(reported.line.breaks > 500);
    let lost = |point: &Point| {
        point
            .receiver(PolicyName::Discard, false)
            .unwrap()
            .lost_intact
            .count
    };
    assert!(lost(&unreported) > 100);
    assert!(lost(&reported) < lost(&unreported) / 10);
}
