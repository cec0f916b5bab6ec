//! Tests the prover's answers about harnesses with and without known faults.

#![expect(clippy::indexing_slicing, reason = "a missing element fails the test")]

use std::path::Path;
use std::process::Command;
use std::sync::Mutex;
use std::time::Duration;

use framelock_limited::run_within;
use serde_json::Value;

/// The limit for a run of the prover, which may compile the harnesses first.
const LIMIT: Duration = Duration::from_secs(1800);

/// The lock of the tests that run the prover in this workspace, because these runs use the same folders.
static ONE: Mutex<()> = Mutex::new(());

fn prover(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_framelock-offline-prover"));
    command
        .args(["--json", "--package", "framelock-checked-harnesses"])
        .args(arguments)
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    command
}

/// Runs the prover. Returns the answer for each harness, by name.
fn answers(arguments: &[&str]) -> serde_json::Map<String, Value> {
    answers_of(&mut prover(arguments))
}

fn answers_of(prover: &mut Command) -> serde_json::Map<String, Value> {
    let output = run_within(LIMIT, prover, b"").expect("the prover starts");
    let said = String::from_utf8_lossy(&output.stderr);
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{said}"));
    let answers = answer.as_array().expect("a list of answers");
    let named = answers.iter().map(|one| {
        let name = one["harness"].as_str().expect("a harness has a name");
        (name.to_owned(), one.clone())
    });
    named.collect()
}

/// Returns the harnesses that have a fault, each with the expected outcome and a part of the expected message. The
/// comment `// expected: OUTCOME: MESSAGE` before a harness states both.
fn faults() -> Vec<(&'static str, &'static str, &'static str)> {
    let sources = [
        include_str!("harnesses/src/fails.rs"),
        include_str!("harnesses/src/offline.rs"),
    ];
    let faults = sources
        .iter()
        .flat_map(|source| source.split("// expected: ").skip(1));
    let parsed = faults.map(|fault| {
        let (outcome, rest) = fault.split_once(": ").expect("an outcome");
        let (message, rest) = rest.split_once('\n').expect("a message");
        let name = rest
            .split_once("fn ")
            .and_then(|(_, name)| name.split_once('('));
        (name.expect("a harness").0, outcome, message)
    });
    parsed.collect()
}

#[test]
#[ignore = "needs CBMC and takes a minute: `cargo xtask verify --all` runs it"]
fn every_fault_is_found_and_nothing_else() {
    let _one = ONE.lock();
    let all_but_one = ["fails::", "holds::", "offline::value", "offline::floating"];
    let answers = answers(&all_but_one.map(|name| ["--harness", name]).concat());
    let faults = faults();
    assert_eq!(faults.len(), 21);
    for (name, answer) in &answers {
        let fault = faults.iter().find(|(fault, ..)| name.ends_with(fault));
        let (_, verdict, said) = fault.copied().unwrap_or(("", "proved", ""));
        assert_eq!(answer["verdict"], verdict, "{answer:#}");
        assert!(answer["failures"].to_string().contains(said), "{answer:#}");
        assert_eq!(name.starts_with("holds::"), fault.is_none());
    }
    assert!(answers.len() > faults.len() + 5);
    let inputs = &answers["fails::false_assertion"]["inputs"];
    let input = inputs[0].as_str().expect("a counterexample has inputs");
    assert!(
        input.starts_with("[u8; 2] at ")
            && input.ends_with(": let bytes: [u8; 2] = kani::any(); = 0x41 0x0d"),
        "{input}"
    );
}

/// The package that `cargo xtask own-proof` makes is proved in its own folder, and a mistake in its format is found.
#[test]
#[ignore = "needs CBMC: `cargo xtask verify --all` runs it"]
fn a_format_of_ones_own_is_proved_in_its_own_folder() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own-proof");
    let _ = std::fs::remove_dir_all(&folder);
    let mut make = Command::new("sh");
    make.args(["tools/xtask/stages.sh", "own_proof"])
        .arg(&folder);
    make.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    assert!(make.status().expect("sh starts").success());
    let unproved = || {
        let mut prover = Command::new(env!("CARGO_BIN_EXE_framelock-offline-prover"));
        prover
            .args(["--json", "--package", "own-frame"])
            .current_dir(&folder);
        let mut answers = answers_of(&mut prover);
        assert_eq!(answers.len(), 5);
        answers.retain(|_, answer| answer["verdict"] != "proved");
        answers
            .into_iter()
            .map(|(name, _)| name)
            .collect::<Vec<_>>()
    };
    assert_eq!(unproved(), [""; 0]);
    let library = folder.join("src/lib.rs");
    let right = std::fs::read_to_string(&library).expect("a source");
    for (text, mistake, harness) in [
        ("i16::from_le_bytes", "i16::from_be_bytes", "round_trip"),
        ("_le_bytes", "_be_bytes", "frame_of_the_specification"),
        ("frame.len() == 6", "frame[5] > 0", "no_panic"),
        (
            "..Checksum::at",
            "from: 3, ..Checksum::at",
            "one_wrong_byte_is_noticed",
        ),
    ] {
        assert!(right.contains(text), "{text}");
        std::fs::write(&library, right.replace(text, mistake)).expect("written");
        let harness = format!("proofs::{harness}");
        assert!(unproved().contains(&harness), "{mistake}");
    }
}

#[test]
#[ignore = "needs CBMC: `cargo xtask verify --all` runs it"]
fn proved_harnesses_are_not_checked_again_but_failed_ones_are() {
    let _one = ONE.lock();
    let harnesses = [
        "--harness",
        "holds::",
        "--harness",
        "fails::false_assertion",
    ];
    let proofs = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("prove/proofs");
    let _ = std::fs::remove_dir_all(proofs);
    let anew = answers(&harnesses);
    let again = answers(&harnesses);
    assert_eq!(anew.len(), again.len());
    for (name, answer) in &anew {
        assert_eq!(answer["is_old"], false, "{name}");
        assert_eq!(again[name]["is_old"], name.starts_with("holds::"), "{name}");
        for same in ["verdict", "properties", "covers", "failures"] {
            assert_eq!(answer[same], again[name][same], "{name}");
        }
    }
}

#[test]
#[ignore = "needs CBMC: `cargo xtask verify --all` runs it"]
fn at_the_time_limit_no_process_is_left_running() {
    let _one = ONE.lock();
    let answers = answers(&["--harness", "takes_too_long", "--timeout", "2"]);
    let answer = &answers["offline::proof_that_takes_too_long"];
    assert_eq!(answer["verdict"], "no_answer_in_time");
    assert!(!is_running("offline.proof_that_takes_too_long.c"));
    let seconds = answer["seconds"].as_f64().expect("it was timed");
    assert!(seconds < 30.0, "{seconds}");
}

fn is_running(argument: &str) -> bool {
    let processes = std::fs::read_dir("/proc").expect("Linux");
    let mut commands = processes
        .flatten()
        .map(|entry| std::fs::read(entry.path().join("cmdline")));
    commands.any(|line| String::from_utf8_lossy(&line.unwrap_or_default()).contains(argument))
}
