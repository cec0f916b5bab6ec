//! Results that are known beforehand, and invariants that hold for all results.

use framelock::motion::{Output, Phase, Setpoint};

use framelock_simulation::{
    Event, FaultRates, FrameFormat, Parameters, Payload, Policy, Seed, StationKind, Tally, Trial,
    run,
};

use super::{receiver, simulated};

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
        for frame in [FrameFormat::Bin, FrameFormat::BinCrc8] {
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
                ..Parameters::DEFAULT
            };
            let tally = simulated(&parameters);
            assert_eq!(tally.line.frames_sent, 1_200);
            assert_eq!(tally.line.frames_intact, 1_200, "{parameters:?}");
            assert_eq!(tally.line.framing_errors + tally.line.breaks, 0);
            for receiver in &tally.receivers {
                assert_eq!(receiver.delivered, 1_200, "{parameters:?}");
                assert_eq!(receiver.false_frames + receiver.wrong_setpoints, 0);
                assert_eq!(receiver.bytes_discarded, 0);
                assert_eq!(receiver.engagements, 0);
                // The sender's clock also determines the frame rate.
                let period = 1000.0 / rate / (1.0 + baud_error / 100.0);
                assert!(
                    receiver.longest_silence_ms() < period + 1.5,
                    "{parameters:?}"
                );
                if parameters.payload == Payload::Motion {
                    assert_eq!(receiver.largest_error, 0, "{parameters:?}");
                    assert_eq!(receiver.error_rms(), Some(0.0));
                }
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

/// Lines with every kind of fault.
fn lines() -> Vec<Parameters> {
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
            duplicate: 0.03,
            ..base
        },
        Parameters {
            bit_flip: 0.003,
            ..base
        },
        Parameters {
            burst_rate: 20.0,
            ..base
        },
        Parameters {
            break_rate: 20.0,
            ..base
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
            for frame in [FrameFormat::Bin, FrameFormat::BinCrc8] {
                lines.push(Parameters {
                    payload: payload.parse().unwrap(),
                    frame,
                    ..line
                });
            }
        }
    }
    lines
}

#[test]
fn every_frame_and_every_byte_is_accounted_for() {
    let mut outcomes = [0; 5];
    for parameters in lines() {
        let length = parameters.frame.length() as u64;
        let tally = simulated(&parameters);
        let line = tally.line;
        assert_eq!(line.frames_sent, 1_800);
        assert_eq!(line.bytes_sent, 1_800 * length);
        assert!(line.frames_intact < line.frames_sent, "{parameters:?}");
        // Each fault whose rate is not 0 happens. If bytes are duplicated, more bytes arrive than were sent, unless
        // other bytes are lost.
        let more = line.bytes_delivered.saturating_sub(line.bytes_sent);
        for (rate, count) in [
            (parameters.lose, line.bytes_lost),
            (parameters.duplicate, more + line.bytes_lost),
            (parameters.burst_rate, line.framing_errors),
            (parameters.break_rate, line.breaks),
        ] {
            assert!(rate == 0.0 || count > 0, "{parameters:?}: {line:?}");
        }
        for receiver in &tally.receivers {
            let counts = [
                receiver.wrong_setpoints,
                receiver.false_frames,
                receiver.lost_intact,
                receiver.never_back,
                receiver.times_back(),
            ];
            let counts = outcomes.iter_mut().zip(counts);
            counts.for_each(|(sum, count)| *sum += count);
            let commits = receiver.delivered + receiver.wrong_setpoints + receiver.false_frames;
            let pending = line.bytes_delivered - length * commits - receiver.bytes_discarded;
            assert!(pending < length * tally.trials, "{parameters:?}");
            assert!(receiver.delivered + receiver.lost_intact >= line.frames_intact);
            assert!(receiver.delivered <= line.frames_sent);
            let back = &receiver.back_by_frames;
            assert_eq!(back.values().sum::<u64>(), receiver.times_back());
            // Every lost intact frame is counted in `back_by_frames`, unless the receiver never
            // gets back in step.
            let on_the_way: u64 = back.iter().map(|(frames, count)| frames * count).sum();
            assert!(on_the_way <= receiver.lost_intact);
            assert!(
                receiver.never_back > 0 || on_the_way == receiver.lost_intact,
                "{parameters:?}"
            );
        }
    }
    assert!(outcomes.iter().all(|count| *count > 0), "{outcomes:?}");
}

/// Framelock's receiver delivers every frame that arrives intact, unless a false frame ends inside the intact frame.
/// Each false frame ends inside at most one intact frame.
#[test]
fn the_receiver_loses_an_intact_frame_only_to_a_false_one() {
    for parameters in lines() {
        let tally = simulated(&parameters);
        let framelock = tally.receivers.iter().nth_back(1).unwrap();
        assert!(
            framelock.lost_intact <= framelock.false_frames,
            "{parameters:?}"
        );
    }
}

#[test]
fn results_depend_on_the_seed_but_not_on_the_order_of_trials() {
    let parameters = lines().pop().unwrap();
    let trial = |number| run(&parameters, number, false).unwrap().tally();
    let trials = 0..u64::from(parameters.trials);
    let forwards = simulated(&parameters);
    let backwards = trials.rev().map(trial).fold(Tally::default(), Tally::and);
    assert_eq!(backwards, forwards);
    let other = simulated(&Parameters {
        seed: 2,
        ..parameters
    });
    assert_ne!(other, forwards);
}

/// For each comparison in trial `number`, returns the setpoint sent last and the failsafe's output after framelock's
/// receiver without an idle-gap rule.
fn looks(parameters: &Parameters, number: u64) -> (Vec<(Setpoint, Output<u8, 3>)>, Tally) {
    let trial = run(parameters, number, true).unwrap();
    let looks = trial
        .events
        .iter()
        .flatten()
        .filter_map(|event| match event {
            Event::Look {
                demand, outputs, ..
            } => Some((*demand, *outputs.get(2)?)),
            Event::Byte { .. } | Event::Frame { .. } => None,
        });
    (looks.collect(), trial.tally())
}

#[test]
fn faults_do_not_change_what_is_sent() {
    let sent = |parameters: &Parameters| -> Vec<_> {
        looks(parameters, 3)
            .0
            .into_iter()
            .map(|look| look.0)
            .collect()
    };
    let faulty = Parameters {
        lose: 0.1,
        bit_flip: 0.01,
        ..Parameters::DEFAULT
    };
    assert_eq!(sent(&faulty), sent(&Parameters::DEFAULT));
}

#[test]
fn a_burst_drives_the_output_to_park_and_back() {
    let parameters = Parameters {
        trials: 1,
        frames: 200,
        burst_at: Some(1.0),
        burst_length: 1_500.0,
        ..Parameters::DEFAULT
    };
    let (looks, tally) = looks(&parameters, 0);
    let mut phases: Vec<_> = looks.into_iter().map(|(_, output)| output.phase).collect();
    phases.dedup();
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
    let [_, _, framelock, _] = &tally.receivers[..] else {
        panic!("four receivers");
    };
    assert_eq!(framelock.engagements, 1);
    assert_eq!(framelock.never_back, 0);
    // The silence lasts for the burst of 1.5 s, plus at most one frame period before and one after the burst.
    assert!(
        (1_500_000..1_545_000).contains(&framelock.longest_silence),
        "{}",
        framelock.longest_silence
    );
    assert!(tally.line.framing_errors > 100);
}

/// A receiver that gets reports of line errors drops the current frame at an error. A receiver without such reports
/// continues the frame. With reports, the lecture's machine therefore loses an intact frame only if the UART gets out
/// of step, and the first bytes that it then reads look like the start of a frame.
#[test]
fn a_reported_error_drops_the_frame_under_way() {
    let parameters = Parameters {
        break_rate: 50.0,
        break_length: 12,
        rate: 1600.0,
        payload: Payload::Random(0x40, 0x43),
        ..Parameters::DEFAULT
    };
    let reported = simulated(&parameters);
    let unreported = simulated(&Parameters {
        unreported: true,
        ..parameters
    });
    assert_eq!(reported.line, unreported.line);
    assert!(reported.line.breaks > 500);
    let lost = |tally: &Tally| receiver(tally, Policy::Lecture, false).lost_intact;
    assert!(lost(&unreported) > 100);
    assert!(lost(&reported) < lost(&unreported) / 10);
}

/// A line with every kind of fault and one station of each kind. The expected numbers are those
/// that this seed has always given.
#[test]
fn the_same_seed_gives_the_same_numbers_for_ever() {
    let tally = simulated(&Parameters {
        seed: 5,
        lose: 0.02,
        duplicate: 0.02,
        bit_flip: 0.002,
        burst_rate: 5.0,
        break_rate: 5.0,
        baud_error: -1.0,
        rate: 200.0,
        trials: 3,
        frames: 500,
        ..Parameters::DEFAULT
    });
    let line = tally.line;
    assert_eq!((line.frames_sent, line.frames_intact), (1_500, 961));
    assert_eq!((line.bytes_delivered, line.bytes_lost), (12_453, 247));
    assert_eq!((line.framing_errors, line.breaks), (1_089, 36));
    let expected = [
        [926, 47, 31, 7, 5_705, 352, 35_353],
        [954, 19, 36, 8, 5_467, 357, 30_302],
        [973, 0, 37, 8, 5_327, 346, 30_302],
        [973, 0, 37, 8, 5_327, 346, 30_302],
    ];
    let errors = [
        7.646_778_499_659_953,
        7.755_512_266_283_827,
        7.378_268_694_000_193,
    ];
    let errors = errors.into_iter().chain([7.378_268_694_000_193]);
    for ((receiver, expected), rms) in tally.receivers.iter().zip(expected).zip(errors) {
        let counted = [
            receiver.delivered,
            receiver.lost_intact,
            receiver.wrong_setpoints,
            receiver.false_frames,
            receiver.bytes_discarded,
            receiver.times_back(),
            receiver.longest_silence,
        ];
        assert_eq!(counted, expected, "{:?}", receiver.kind);
        assert_eq!(receiver.largest_error, 168);
        assert!((receiver.error_rms().unwrap() - rms).abs() < 1e-12);
    }
}

/// The sender leaves three byte times between its bytes.
#[test]
fn an_idle_gap_must_not_be_shorter_than_the_gaps_in_a_frame() {
    for (idle_gap, expected) in [(1, 0), (2, 0), (3, 50), (20, 50)] {
        let tally = simulated(&Parameters {
            byte_gap: 30,
            idle_gap,
            trials: 1,
            frames: 50,
            ..Parameters::DEFAULT
        });
        for policy in [Policy::Lecture, Policy::Framelock] {
            assert_eq!(receiver(&tally, policy, false).delivered, 50);
            let with_rule = receiver(&tally, policy, true);
            assert_eq!(with_rule.delivered, expected, "{idle_gap}");
        }
    }
}

#[test]
fn the_lectures_machine_receives_bin_only() {
    let parameters = Parameters {
        frame: FrameFormat::BinCrc8,
        ..Parameters::DEFAULT
    };
    let (seed, rates) = (Seed { seed: 1, trial: 0 }, FaultRates::default());
    let trial = Trial::new(
        &parameters,
        seed,
        rates,
        StationKind::of(FrameFormat::Bin).as_slice(),
    );
    let complaint = trial.err().unwrap().to_string();
    assert!(
        complaint.contains("knows --frame bin and no other"),
        "{complaint}"
    );
}
