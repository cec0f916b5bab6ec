//! Tests of `framelock simulate` as a process.

use serde_json::Value;

use crate::process;

/// Runs `framelock simulate`, which must succeed without messages, and returns its standard output.
fn shown(arguments: &[&str]) -> String {
    process::shown(&[&["simulate"], arguments].concat(), "")
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&shown(&[arguments, &["--format", "json"]].concat())).unwrap()
}

/// Returns the four numbers in the row of the table with this name.
fn row(shown: &str, name: &str) -> Vec<f64> {
    let line = shown.lines().find_map(|line| line.strip_prefix(name));
    let line = line.unwrap_or_else(|| panic!("no row '{name}' in\n{shown}"));
    let numbers = line.split_whitespace().filter(|word| *word != "%");
    numbers.map(|word| word.parse().unwrap()).collect()
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
    // A single point has the results that the sweep shows for this point.
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
    // The lecture's machine receives only frames of the format bin.
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
        ("  longest, ms", "/resynchronisation/longest_ms"),
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
