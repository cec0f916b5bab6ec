//! Results that are known beforehand, and invariants that hold for all results.
#![allow(clippy::indexing_slicing, reason = "a panic fails the test")]

use framelock_simulation::{Parameters, Payload, Policy, Protocol, Tally, run, run_all};

use super::{bin, bin_crc8, receiver, simulated};

#[test]
fn on_a_line_without_faults_nothing_is_lost() {
    let payloads = ["motion", "random", "random:40-43", "00414200", "ambiguous"];
    for (payload, rate, baud_error) in payloads.iter().flat_map(|payload| {
        [
            (payload, 1.0, 0.0),
            (payload, 50.0, -4.5),
            (payload, 500.0, 2.0),
            (payload, 1400.0, 3.8),
        ]
    }) {
        for protocol in [bin(), bin_crc8()] {
            let parameters = Parameters {
                payload: payload.parse().unwrap(),
                rate,
                baud_error,
                trials: 4,
                frames: 300,
                ..Parameters::DEFAULT
            };
            let tally = run_all(&protocol, &parameters).unwrap();
            assert_eq!(tally.line.frames_sent, 1_200);
            assert_eq!(tally.line.frames_intact, 1_200, "{parameters:?}");
            assert_eq!(tally.line.framing_errors, 0);
            for receiver in &tally.receivers {
                assert_eq!(receiver.delivered, 1_200, "{parameters:?}");
                assert_eq!(receiver.false_frames + receiver.wrong_setpoints, 0);
                assert_eq!(receiver.bytes_discarded, 0);
                assert_eq!((receiver.engagements, receiver.deaf), (0, 0));
                // The sender's clock also determines the frame rate.
                let period = 1e6 / rate / (1.0 + baud_error / 100.0);
                let silence = u32::try_from(receiver.longest_silence).unwrap();
                assert!(f64::from(silence) < period + 1_500.0, "{parameters:?}");
            }
        }
    }
}

/// If the clocks differ by more than four to five per cent, no frame arrives. The limit for a fast sender is lower than
/// the limit for a slow one. The UART's own tests explain the difference.
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
            let tally = simulated(&Parameters {
                baud_error,
                rate,
                trials: 4,
                frames: 100,
                ..Parameters::DEFAULT
            });
            for receiver in &tally.receivers {
                let expected = if is_delivered { 400 } else { 0 };
                assert_eq!(receiver.delivered, expected, "{baud_error} {rate}");
            }
        }
    }
}

/// Frames on lines with every kind of fault.
fn lines() -> Vec<(Protocol, Parameters)> {
    let base = Parameters {
        trials: 6,
        frames: 300,
        rate: 400.0,
        payload: Payload::Random(0x40, 0x43),
        ..Parameters::DEFAULT
    };
    let faults = [
        Parameters { lose: 0.03, ..base },
        Parameters {
            bit_flip: 0.003,
            ..base
        },
        Parameters {
            burst_rate: 20.0,
            ..base
        },
        Parameters {
            lose: 0.1,
            bit_flip: 0.01,
            burst_rate: 5.0,
            baud_error: 4.9,
            ..base
        },
    ];
    let mut lines = Vec::new();
    for line in faults {
        for payload in ["random:40-43", "random:0D-42", "ambiguous", "motion"] {
            let payload = payload.parse().unwrap();
            let parameters = Parameters { payload, ..line };
            lines.extend([(bin(), parameters), (bin_crc8(), parameters)]);
        }
    }
    lines
}

#[test]
fn every_frame_and_every_byte_is_accounted_for() {
    let mut outcomes = [0; 4];
    for (protocol, parameters) in lines() {
        let length = protocol.longest() as u64;
        let tally = run_all(&protocol, &parameters).unwrap();
        let line = tally.line;
        assert_eq!(line.frames_sent, 1_800);
        assert_eq!(line.bytes_sent, 1_800 * length);
        assert!(line.frames_intact < line.frames_sent, "{parameters:?}");
        // Each fault whose rate is not 0 happens.
        for (rate, count) in [
            (parameters.lose, line.bytes_lost),
            (parameters.burst_rate, line.framing_errors),
        ] {
            assert!(rate == 0.0 || count > 0, "{parameters:?}: {line:?}");
        }
        for receiver in &tally.receivers {
            let counts = [
                receiver.wrong_setpoints,
                receiver.false_frames,
                receiver.lost_intact,
                receiver.deaf,
            ];
            let counts = outcomes.iter_mut().zip(counts);
            counts.for_each(|(sum, count)| *sum += count);
            let commits = receiver.delivered + receiver.wrong_setpoints + receiver.false_frames;
            let pending = line.bytes_delivered - length * commits - receiver.bytes_discarded;
            let trials = u64::from(parameters.trials);
            assert!(pending < length * trials, "{parameters:?}");
            assert!(receiver.delivered + receiver.lost_intact >= line.frames_intact);
            assert!(receiver.delivered <= line.frames_sent);
            assert!(receiver.deaf <= receiver.lost_intact.min(trials));
        }
        // Framelock's receiver delivers every frame that arrives intact, unless a false frame ends inside the intact
        // frame. Each false frame ends inside at most one intact frame.
        let framelock = receiver(&tally, Policy::Framelock, false);
        assert!(
            framelock.lost_intact <= framelock.false_frames,
            "{parameters:?}"
        );
    }
    assert!(outcomes.iter().all(|count| *count > 0), "{outcomes:?}");
}

#[test]
fn results_depend_on_the_seed_but_not_on_the_order_of_trials() {
    let (protocol, parameters) = lines().pop().unwrap();
    let trial = |number| run(&protocol, &parameters, number).unwrap();
    let trials = 0..u64::from(parameters.trials);
    let forwards = run_all(&protocol, &parameters).unwrap();
    let backwards = trials.rev().map(trial).fold(Tally::default(), Tally::and);
    assert_eq!(backwards, forwards);
    let other = Parameters {
        seed: 2,
        ..parameters
    };
    assert_ne!(run_all(&protocol, &other).unwrap(), forwards);
}

/// A receiver drops the current frame at a reported line error. So these bursts of eleven bits cost the lecture's machine
/// 22 intact frames. If the simulation did not report framing errors, they would cost it 310.
#[test]
fn a_reported_error_drops_the_frame_under_way() {
    let tally = simulated(&Parameters {
        burst_rate: 50.0,
        burst_length: 0.1,
        rate: 1600.0,
        payload: Payload::Random(0x40, 0x43),
        ..Parameters::DEFAULT
    });
    let lost = receiver(&tally, Policy::Lecture, false).lost_intact;
    assert!(tally.line.framing_errors > 2_000);
    assert!(lost < 50, "{lost}");
}

/// The pause between two frames is 20 byte times. A frame that has lost a byte is dropped in the pause only if the idle
/// gap is shorter than the pause. Without the drop, the receiver reads the following frames at the wrong phase.
#[test]
fn an_idle_gap_rule_acts_in_pauses_that_are_longer_than_the_gap() {
    for (idle_gap, is_dropped) in [(18, true), (19, true), (20, false), (21, false)] {
        let tally = simulated(&Parameters {
            idle_gap,
            // 70 bits for a frame and 200 for the pause.
            rate: 115_200.0 / 270.0,
            payload: Payload::Ambiguous,
            lose: 0.01,
            trials: 20,
            frames: 500,
            ..Parameters::DEFAULT
        });
        for policy in [Policy::Lecture, Policy::Framelock] {
            let lost = receiver(&tally, policy, true).lost_intact;
            assert_eq!(lost < 100, is_dropped, "{idle_gap} {policy}: {lost}");
        }
    }
}

/// A line with every kind of fault and one station of each kind. The expected numbers are those
/// that this seed has always given.
#[test]
fn the_same_seed_gives_the_same_numbers_for_ever() {
    let tally = simulated(&Parameters {
        seed: 5,
        lose: 0.02,
        bit_flip: 0.002,
        burst_rate: 1.5,
        burst_length: 120.0,
        payload: Payload::Random(0x40, 0x43),
        baud_error: -1.0,
        rate: 200.0,
        trials: 3,
        frames: 500,
        ..Parameters::DEFAULT
    });
    let line = tally.line;
    assert_eq!((line.frames_sent, line.frames_intact), (1_500, 960));
    assert_eq!((line.bytes_delivered, line.bytes_lost), (15_117, 289));
    assert_eq!(line.framing_errors, 5_300);
    let framelock = [976, 0, 42, 0, 7_991, 141_414, 8, 0];
    let expected = [
        [932, 44, 38, 0, 8_327, 141_414, 8, 0],
        framelock,
        framelock,
        framelock,
    ];
    for (receiver, expected) in tally.receivers.iter().zip(expected) {
        let counted = [
            receiver.delivered,
            receiver.lost_intact,
            receiver.wrong_setpoints,
            receiver.false_frames,
            receiver.bytes_discarded,
            receiver.longest_silence,
            receiver.engagements,
            receiver.deaf,
        ];
        assert_eq!(counted, expected, "{:?}", receiver.kind);
    }
}

#[test]
fn only_frames_with_setpoints_are_simulated() {
    let crsf = Protocol::named("crsf").unwrap();
    let error = run(&crsf, &Parameters::DEFAULT, 0).unwrap_err().to_string();
    assert!(
        error.starts_with("frames of crsf have no pitch, roll and yaw"),
        "{error}"
    );
}
