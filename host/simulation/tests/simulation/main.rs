//! Tests that the simulation reproduces known properties of the protocol, and that its counts agree with each other.
//!
//! Seeds are fixed, so a test always passes or always fails. The transcripts of `framelock simulate` in
//! `host/cli/tests/cases/simulate.md` show the results of some seeds, for example of a deaf machine and of ambiguous
//! payloads.
#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

use framelock_simulation::{Parameters, Payload, Policy, Protocol, ReceiverTally, Tally, run_all};

fn bin() -> Protocol {
    Protocol::named("bin").unwrap()
}

fn bin_crc8() -> Protocol {
    Protocol::named("bin-crc8").unwrap()
}

/// Runs all trials with BIN frames.
fn simulated(parameters: &Parameters) -> Tally {
    run_all(&bin(), parameters).unwrap()
}

/// Returns the tally of the receiver with this policy.
fn receiver(tally: &Tally, policy: Policy, has_idle_gap: bool) -> &ReceiverTally {
    let mut receivers = tally.receivers.iter();
    let found = receivers.find(|it| (it.policy, it.has_idle_gap) == (policy, has_idle_gap));
    found.unwrap()
}

#[test]
fn on_a_line_without_faults_nothing_is_lost() {
    let payloads = ["motion", "random", "00414200", "ambiguous"];
    let lines = [(1.0, 0.0), (50.0, -4.5), (500.0, 2.0), (1400.0, 3.8)];
    for (payload, (rate, baud_error)) in payloads
        .into_iter()
        .flat_map(|payload| lines.map(|line| (payload, line)))
    {
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
                assert_eq!(receiver.deaf, 0);
            }
        }
    }
}

/// No frame arrives if the sender's clock is 5 % too fast or 5.5 % too slow. The limit is lower for a fast sender than
/// for a slow one. The UART's own tests explain the difference.
#[test]
fn clocks_may_differ_by_four_to_five_per_cent() {
    for (baud_error, expected) in [(-5.5, 0), (-5.0, 400), (0.0, 400), (3.9, 400), (5.0, 0)] {
        for rate in [50.0, 1600.0] {
            let tally = simulated(&Parameters {
                baud_error,
                rate,
                trials: 4,
                frames: 100,
                ..Parameters::DEFAULT
            });
            for receiver in &tally.receivers {
                assert_eq!(receiver.delivered, expected, "{baud_error} {rate}");
            }
        }
    }
}

/// Simulates every kind of fault, with payloads that contain the frames' fixed bytes and with other payloads.
#[test]
fn every_frame_and_every_byte_is_accounted_for() {
    let mut outcomes = [0; 4];
    for (lose, bit_flip, burst_rate, baud_error) in [
        (0.03, 0.0, 0.0, 0.0),
        (0.0, 0.003, 0.0, 0.0),
        (0.0, 0.0, 20.0, 0.0),
        (0.1, 0.01, 5.0, 4.9),
    ] {
        for (payload, protocol) in ["random", "00414200", "ambiguous", "motion"]
            .into_iter()
            .flat_map(|payload| [(payload, bin()), (payload, bin_crc8())])
        {
            let parameters = Parameters {
                trials: 6,
                frames: 300,
                rate: 400.0,
                payload: payload.parse().unwrap(),
                lose,
                bit_flip,
                burst_rate,
                baud_error,
                ..Parameters::DEFAULT
            };
            let tally = run_all(&protocol, &parameters).unwrap();
            assert_eq!(run_all(&protocol, &parameters).unwrap(), tally);
            let line = tally.line;
            assert_eq!(line.frames_sent, 1_800);
            assert_eq!(line.bytes_sent, 1_800 * protocol.longest() as u64);
            assert!(line.frames_intact < line.frames_sent, "{parameters:?}");
            // Lost bytes and bursts happen if their rate is not 0.
            for (rate, count) in [(lose, line.bytes_lost), (burst_rate, line.framing_errors)] {
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
                assert!(receiver.delivered + receiver.lost_intact >= line.frames_intact);
                assert!(receiver.delivered <= line.frames_sent);
                assert!(receiver.deaf <= receiver.lost_intact.min(6));
            }
            // Framelock's receiver delivers every frame that arrives intact, unless a false frame ends inside the
            // intact frame. Each false frame ends inside at most one intact frame.
            let framelock = receiver(&tally, Policy::Framelock, false);
            assert!(
                framelock.lost_intact <= framelock.false_frames,
                "{parameters:?}"
            );
            let seed = 2;
            let other = run_all(&protocol, &Parameters { seed, ..parameters });
            assert_ne!(other.unwrap(), tally, "another seed");
        }
    }
    assert!(outcomes.iter().all(|count| *count > 0), "{outcomes:?}");
}

/// A receiver drops the current frame at a reported line error, so it can receive an intact frame after the error.
/// Here, bursts of eleven bits cost the lecture's machine 8 intact frames. Without reports of framing errors, the
/// bursts would cost it 253.
#[test]
fn a_reported_error_drops_the_frame_under_way() {
    let tally = simulated(&Parameters {
        burst_rate: 50.0,
        burst_length: 0.1,
        rate: 1600.0,
        payload: Payload::Random,
        ..Parameters::DEFAULT
    });
    let lost = receiver(&tally, Policy::Lecture, false).lost_intact;
    assert!(tally.line.framing_errors > 1_900, "{tally:?}");
    assert!(lost < 50, "{lost}");
}

/// The pause between two frames is 20 byte times. A frame that has lost a byte is dropped in the pause only if the idle
/// gap is shorter than the pause. Without the drop, the receiver begins the following frames at a wrong byte.
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

/// Neither receiver notices an inverted bit in pitch, roll or yaw. Any other inverted bit, except in the reserved byte,
/// costs the frame: 24 fixed bits, 14 start and stop bits, and the 9 idle bits before the frame must arrive as they
/// were sent. So the share of wrong setpoints is (1 - p)^47 (1 - (1 - p)^24). A checksum prevents most of them.
#[test]
fn wrong_setpoints_are_as_frequent_as_theory_predicts() {
    for bit_flip in [0.001_f64, 0.01] {
        let parameters = Parameters {
            payload: Payload::Random,
            rate: 800.0,
            bit_flip,
            trials: 10,
            ..Parameters::DEFAULT
        };
        let arrives = 1.0 - bit_flip;
        let expected = 10_000.0 * arrives.powi(24 + 14 + 9) * (1.0 - arrives.powi(24));
        // Six standard deviations. Rare cases, which the theory omits, add less than 5 %.
        let most = 6.0 * expected.sqrt();
        for receiver in &simulated(&parameters).receivers {
            let wrong = f64::from(u32::try_from(receiver.wrong_setpoints).unwrap());
            let range = expected - most..=1.05 * expected + most;
            assert!(range.contains(&wrong), "{bit_flip}: {wrong} {expected}");
        }
        for receiver in &run_all(&bin_crc8(), &parameters).unwrap().receivers {
            assert!(receiver.wrong_setpoints < 3, "{bit_flip}: {receiver:?}");
        }
    }
}

#[test]
fn only_frames_with_setpoints_are_simulated() {
    let crsf = Protocol::named("crsf").unwrap();
    let error = run_all(&crsf, &Parameters::DEFAULT)
        .unwrap_err()
        .to_string();
    let expected = "frames of crsf have no pitch, roll and yaw";
    assert!(error.starts_with(expected), "{error}");
}
