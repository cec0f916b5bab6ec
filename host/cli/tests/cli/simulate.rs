//! `framelock simulate` as its user meets it.

use serde_json::Value;

use crate::{guide, process};

/// What it writes to standard output; it must succeed, and have nothing to complain of.
fn shown(arguments: &[&str]) -> String {
    process::shown(&[&["simulate"], arguments].concat(), "")
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&shown(&[arguments, &["--format", "json"]].concat())).unwrap()
}

/// What it complains of; it must fail with 2, and show nothing.
fn complaint(arguments: &[&str]) -> String {
    let output = process::run(&[&["simulate"], arguments].concat(), "");
    assert!(output.stdout.is_empty());
    process::complaint(output)
}

/// The four numbers in the row of the table with that name.
fn row(shown: &str, name: &str) -> Vec<f64> {
    let line = shown.lines().find_map(|line| line.strip_prefix(name));
    let line = line.unwrap_or_else(|| panic!("no row '{name}' in\n{shown}"));
    let numbers = line.split_whitespace().filter(|word| *word != "%");
    numbers.map(|word| word.parse().unwrap()).collect()
}

#[test]
fn without_faults_every_frame_is_delivered() {
    let shown = shown(&["--trials", "3", "--frames", "100"]);
    assert_eq!(row(&shown, "frames sent"), [300.0]);
    assert_eq!(row(&shown, "delivered"), [300.0; 4]);
    assert_eq!(row(&shown, "  of the frames sent"), [100.0; 4]);
    assert_eq!(row(&shown, "lost though intact"), [0.0; 4]);
    assert_eq!(row(&shown, "actuator error, largest"), [0.0; 4]);
}

#[test]
fn the_policies_are_told_apart() {
    let shown = shown(&[
        "--payload",
        "00414200",
        "--lose-one-in",
        "0",
        "--rate",
        "1600",
        "--trials",
        "5",
    ]);
    assert_eq!(row(&shown, "delivered"), [0.0, 0.0, 4_995.0, 4_995.0]);
    assert_eq!(row(&shown, "  never"), [5.0, 5.0, 0.0, 0.0]);
    assert_eq!(
        row(&shown, "  for each lost byte"),
        [999.0, 999.0, 0.0, 0.0]
    );
    // Never heard, which the failsafe notices once in each trial.
    assert_eq!(row(&shown, "failsafe engagements"), [5.0, 5.0, 0.0, 0.0]);
}

#[test]
fn the_same_seed_gives_the_same_results() {
    let faults = ["--lose", "0.01", "--bit-flip", "0.001", "--format", "json"];
    let with_seed = |seed| shown(&[&faults[..], &["--seed", seed]].concat());
    assert_eq!(with_seed("7"), with_seed("7"));
    assert_ne!(with_seed("7"), with_seed("8"));
}

#[test]
fn json_holds_the_parameters_and_the_intervals() {
    let document = json(&["--lose", "0.02", "--trials", "4", "--sweep", "rate=20,40"]);
    assert_eq!(document["swept"], serde_json::json!(["rate"]));
    let points = document["points"].as_array().unwrap();
    assert_eq!(points.len(), 2);
    assert_eq!(points[1]["parameters"]["rate"], 40.0);
    assert_eq!(points[1]["parameters"]["seed"], 1);
    assert_eq!(points[1]["parameters"]["payload"], "motion");
    let receivers = points[1]["receivers"].as_array().unwrap();
    let kinds: Vec<_> = receivers
        .iter()
        .map(|receiver| {
            (
                receiver["policy"].as_str().unwrap(),
                receiver["idle_gap"].as_u64(),
            )
        })
        .collect();
    assert_eq!(
        kinds,
        [
            ("lecture", None),
            ("lecture", Some(20)),
            ("framelock", None),
            ("framelock", Some(20))
        ]
    );
    for receiver in receivers {
        let delivered = &receiver["delivered"];
        let [low, value, high] =
            ["low", "value", "high"].map(|name| delivered[name].as_f64().unwrap());
        assert!(low < value && value < high && value < 1.0, "{delivered}");
    }
    // One point alone gives what it gave in the sweep.
    let alone = json(&["--lose", "0.02", "--trials", "4", "--rate", "40"]);
    assert_eq!(alone["points"][0], points[1]);
}

#[test]
fn csv_has_a_row_for_each_point_and_receiver_with_all_parameters() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("results.csv");
    let path = path.to_str().unwrap();
    let sweeps = ["--sweep", "baud-error=-2:2:2", "--sweep", "lose=0,0.1"];
    let rest = [
        "--trials", "2", "--frames", "50", "--format", "csv", "--output", path,
    ];
    assert_eq!(shown(&[&sweeps[..], &rest[..]].concat()), "");

    let mut reader = csv::Reader::from_path(path).unwrap();
    let header = reader.headers().unwrap().clone();
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 3 * 2 * 4);
    let column = |name: &str| {
        let place = header.iter().position(|column| column == name).unwrap();
        rows.iter()
            .map(|row| row[place].to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(
        column("baud_error")[0..9],
        ["-2", "-2", "-2", "-2", "-2", "-2", "-2", "-2", "0"]
    );
    assert_eq!(column("lose")[3..6], ["0", "0.1", "0.1"]);
    assert_eq!(
        column("policy")[0..4],
        ["lecture", "lecture", "framelock", "framelock"]
    );
    assert_eq!(
        column("idle_gap_rule")[0..4],
        ["false", "true", "false", "true"]
    );
    for name in [
        "seed",
        "frame",
        "payload",
        "baud",
        "hold_after",
        "full_travel",
    ] {
        assert!(column(name).iter().all(|value| !value.is_empty()), "{name}");
    }
    assert!(
        column("delivered_share")[0..4]
            .iter()
            .all(|share| share == "1")
    );
    let wrong = column("lost_intact_per_lost_byte");
    assert_eq!(wrong[0], "");
    assert!(wrong[4].parse::<f64>().unwrap() > 0.0);
}

#[test]
fn every_option_is_a_parameter_of_the_simulation() {
    let options = [
        ("seed", "7"),
        ("trials", "2"),
        ("frames", "11"),
        ("frame", "bin-crc8"),
        ("payload", "random:40-43"),
        ("baud", "9600"),
        ("rate", "12.5"),
        ("byte-gap", "3"),
        ("baud-error", "-1.5"),
        ("bit-flip", "0.001"),
        ("burst-rate", "2"),
        ("burst-length", "1.5"),
        ("burst-at", "0.5"),
        ("break-rate", "3"),
        ("break-length", "13"),
        ("lose", "0.02"),
        ("duplicate", "0.03"),
        ("lose-one-in", "5"),
        ("idle-gap", "9"),
        ("hold-after", "80"),
        ("ramp-after", "90"),
        ("full-travel", "700"),
    ];
    let arguments: Vec<_> = options
        .iter()
        .map(|(name, value)| format!("--{name}={value}"))
        .collect();
    let mut arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
    arguments.push("--unreported");
    let document = json(&arguments);
    let parameters = document["points"][0]["parameters"].as_object().unwrap();
    assert_eq!(parameters.len(), options.len() + 1);
    assert_eq!(parameters["unreported"], true);
    for (name, value) in options {
        let parameter = &parameters[&name.replace('-', "_")];
        match parameter.as_f64() {
            Some(number) => assert_eq!(value.parse(), Ok(number), "{name}"),
            None => assert_eq!(parameter, value),
        }
    }
    // The lecture's machine receives frames of format bin only.
    let receivers = document["points"][0]["receivers"].as_array().unwrap();
    let policies = receivers.iter().map(|receiver| &receiver["policy"]);
    assert!(policies.eq(["framelock", "framelock"]));
}

#[test]
fn the_table_shows_what_the_json_holds() {
    let arguments = ["--lose", "0.02", "--trials", "4", "--bit-flip", "0.0001"];
    let document = json(&arguments);
    let shown = shown(&arguments);
    for (name, pointer) in [
        ("delivered", "/delivered/count"),
        ("lost though intact", "/lost_intact/count"),
        ("  for each lost byte", "/lost_intact_per_lost_byte/value"),
        ("    95 % interval from", "/lost_intact_per_lost_byte/low"),
        ("    to", "/lost_intact_per_lost_byte/high"),
        ("wrong setpoints", "/wrong_setpoints/count"),
        ("false frames", "/false_frames/count"),
        ("resynchronised", "/resynchronisation/count"),
        ("  after, median, ms", "/resynchronisation/median_ms"),
        (
            "  99 of 100 within, ms",
            "/resynchronisation/percentile_99_ms",
        ),
        ("  at the latest, ms", "/resynchronisation/longest_ms"),
        ("longest silence, ms", "/longest_silence_ms"),
        ("failsafe engagements", "/failsafe_engagements"),
        ("actuator error, largest", "/actuator_error/largest"),
        ("actuator error, RMS", "/actuator_error/rms"),
    ] {
        let receivers = document["points"][0]["receivers"].as_array().unwrap();
        let expected = receivers
            .iter()
            .map(|receiver| receiver.pointer(pointer).unwrap());
        for (shown, expected) in row(&shown, name).into_iter().zip(expected) {
            let difference = shown - expected.as_f64().unwrap();
            assert!(difference.abs() < 0.051, "{name}: {shown} {expected}");
        }
    }
    let row = |name| row(&shown, name)[0];
    assert!(row("    95 % interval from") < row("  for each lost byte"));
    assert!(row("  for each lost byte") < row("    to"));
}

#[test]
fn impossible_parameters_are_named() {
    for (arguments, named) in [
        (
            &["--bit-flip", "1.5"][..],
            "--bit-flip is 1.5: a number from 0 to 1",
        ),
        (&["--lose", "NaN"], "--lose is NaN"),
        (&["--trials", "0"], "--trials is 0: a number from 1"),
        (
            &["--baud", "abc"],
            "a number from 300 to 10000000 is wanted, such as 115200",
        ),
        (&["--seed", "x"], "a whole number is wanted, such as 7"),
        (&["--sweep", "lose"], "such as lose=0:0.1:0.02"),
        (&["--payload", "AB"], "one of these is wanted: motion"),
        (
            &["--rate", "1700"],
            "need 119000 baud: raise --baud from 115200, or lower --rate to 1645.714",
        ),
        (
            &["--hold-after", "600"],
            "--ramp-after is 500 ms, less than --hold-after, 600 ms",
        ),
        (
            &["--lose-one-in", "5", "--frames", "5"],
            "the last of 5 frames is 4",
        ),
        (&["--sweep", "lose=0:2:1"], "--lose is 2"),
        (
            &["--sweep", "nonsense=1"],
            "no parameter 'nonsense' can be swept",
        ),
        (&["--sweep", "rate=1:2001:500"], "need 140070 baud"),
        (
            &["--sweep", "rate=1", "--sweep", "rate=2"],
            "--sweep rate is there twice",
        ),
        (
            &[
                "--sweep",
                "rate=1",
                "--sweep",
                "lose=0",
                "--sweep",
                "baud=9600",
            ],
            "two parameters can be swept, not 3",
        ),
        (
            &["--output", "/nowhere/results"],
            "cannot write to /nowhere/results",
        ),
    ] {
        let message = complaint(arguments);
        assert!(message.contains(named), "{arguments:?}: {message}");
    }
}

#[test]
fn a_sweep_is_a_table_for_people_too() {
    let shown = shown(&["--sweep", "lose=0,0.5", "--trials", "2", "--frames", "20"]);
    let lines: Vec<_> = shown.lines().collect();
    assert_eq!(lines.len(), 1 + 2 * 4);
    assert!(lines[0].contains("lose  policy"));
    assert!(
        lines[1].contains("0  lecture") && lines[1].contains("100.0000 %"),
        "{shown}"
    );
    assert!(lines[8].contains("0.5  framelock"), "{shown}");

    let shown = self::shown(&[
        "--sweep",
        "lose=0,0.5",
        "--sweep",
        "rate=20,40",
        "--trials",
        "2",
        "--frames",
        "20",
    ]);
    let lines: Vec<_> = shown.lines().collect();
    assert_eq!(lines.len(), 1 + 2 * (1 + 2 * 4));
    assert_eq!((lines[1], lines[10]), ("lose 0:", "lose 0.5:"));
    assert!(lines[0].contains("rate  policy") && lines[18].contains("40  framelock"));
}

#[test]
fn help_and_tables_fit_a_terminal() {
    let fits = |shown: &str| shown.lines().all(|line| line.chars().count() <= 80);
    let help = shown(&["--help"]);
    assert!(fits(&help) && help.lines().count() <= 80, "{help}");
    for arguments in [
        &["--payload", "random:40-43", "--idle-gap", "1000000"][..],
        &["--sweep", "burst-length=0.5,1000"],
        &["--sweep", "burst-length=1,2", "--sweep", "full-travel=1,2"],
    ] {
        let table = shown(&[arguments, &["--trials", "2"]].concat());
        assert!(fits(&table), "{table}");
    }
}

/// In two trials of two frames each.
#[test]
fn the_commands_of_the_report_run() {
    let report = include_str!("../../../../docs/line-faults.md");
    let blocks = guide::blocks(report, "sh");
    let commands = blocks.iter().flat_map(|(commands, _)| commands.lines());
    let commands = commands.filter(|command| command.starts_with("framelock "));
    let mut count = 0;
    for command in commands {
        let mut words: Vec<_> = command.split_whitespace().skip(2).collect();
        while let Some(at) = words
            .iter()
            .position(|word| ["--trials", "--frames"].contains(word))
        {
            words.drain(at..at + 2);
        }
        words.extend(["--trials", "2", "--frames", "2"]);
        assert!(shown(&words).contains("delivered"), "{command}");
        count += 1;
    }
    assert!(count > 5);
}
