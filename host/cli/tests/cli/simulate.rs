//! Tests of `framelock simulate` as a process.

use framelock_simulation::{Parameters, Payload, Protocol, ReceiverTally, run_all};

use crate::process;

/// Runs `framelock simulate`, which must succeed without messages, and returns its standard output.
fn shown(arguments: &[&str]) -> String {
    process::shown(&[&["simulate"], arguments].concat(), "")
}

type Count = fn(&ReceiverTally) -> u64;

/// Returns the numbers in the row with this name.
fn row(table: &str, name: &str) -> Vec<u64> {
    let line = table.lines().find_map(|line| line.strip_prefix(name));
    let line = line.unwrap_or_else(|| panic!("no row {name:?} in\n{table}"));
    let numbers = line.split_whitespace();
    numbers.map(|word| word.parse().unwrap()).collect()
}

#[test]
fn the_same_seed_gives_the_same_results() {
    let faults = ["--lose", "0.01", "--bit-flip", "0.001"];
    let with_seed = |seed| shown(&[&faults[..], &["--seed", seed]].concat());
    let without_head = |shown: String| shown.split_once("\n\n").unwrap().1.to_owned();
    assert_eq!(with_seed("7"), with_seed("7"));
    assert_ne!(without_head(with_seed("7")), without_head(with_seed("8")));
}

/// Every option is a parameter of the simulation, and the tables show the simulation's counts.
#[test]
fn the_tables_show_what_the_simulation_counts() {
    let parameters = Parameters {
        seed: 7,
        trials: 3,
        frames: 400,
        payload: Payload::Random(0x40, 0x43),
        baud: 9_600,
        rate: 99.5,
        lose: 0.02,
        bit_flip: 0.001,
        baud_error: -1.5,
        burst_rate: 2.0,
        burst_length: 150.0,
        idle_gap: 3,
    };
    // The lecture's machine receives only BIN.
    for (frame, receivers) in [("bin", 4), ("bin-crc8", 2)] {
        let shown = shown(&[
            "--seed=7",
            "--trials=3",
            "--frames=400",
            &format!("--frame={frame}"),
            "--payload=random:40-43",
            "--baud=9600",
            "--rate=99.5",
            "--lose=0.02",
            "--bit-flip=0.001",
            "--baud-error=-1.5",
            "--burst-rate=2",
            "--burst-length=150",
            "--idle-gap=3",
        ]);
        let tally = run_all(&Protocol::named(frame).unwrap(), &parameters).unwrap();
        let line = tally.line;
        for (name, count) in [
            ("frames sent", line.frames_sent),
            ("  arrived intact", line.frames_intact),
            ("bytes sent", line.bytes_sent),
            ("  delivered", line.bytes_delivered),
            ("  lost after the UART", line.bytes_lost),
            ("framing errors", line.framing_errors),
        ] {
            assert_eq!(row(&shown, name), [count], "{name}");
        }
        assert_eq!(tally.receivers.len(), receivers);
        let counts: [(&str, Count); 7] = [
            ("delivered", |receiver| receiver.delivered),
            ("lost though intact", |receiver| receiver.lost_intact),
            ("wrong setpoints", |receiver| receiver.wrong_setpoints),
            ("false frames", |receiver| receiver.false_frames),
            ("trials that end deaf", |receiver| receiver.deaf),
            ("longest silence, ms", |receiver| {
                receiver.longest_silence / 1_000
            }),
            ("failsafe engagements", |receiver| receiver.engagements),
        ];
        for (name, count) in counts {
            let expected: Vec<u64> = tally.receivers.iter().map(count).collect();
            assert_eq!(row(&shown, name), expected, "{name}");
        }
    }
}

#[test]
fn help_and_tables_fit_a_terminal() {
    let fits = |shown: &str| shown.lines().all(|line| line.chars().count() <= 80);
    let help = shown(&["--help"]);
    assert!(fits(&help) && help.lines().count() <= 80, "{help}");
    let widest = [
        "--payload=random:40-43",
        "--baud=10000000",
        "--rate=12345.678",
        "--trials=2",
    ];
    let table = shown(&widest);
    assert!(fits(&table), "{table}");
}
