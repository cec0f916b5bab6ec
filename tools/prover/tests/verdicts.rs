//! Tests the prover's answers about harnesses with and without known faults.

#![expect(clippy::indexing_slicing, reason = "a missing element fails the test")]

use std::process::Command;
use std::sync::Mutex;
use std::time::Duration;

use framelock_limited::run_within;
use serde_json::Value;

/// The limit for a run of the prover, which may compile the harnesses first.
const LIMIT: Duration = Duration::from_secs(1800);

fn prover(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_framelock-offline-prover"));
    command
        .args([
            "--format",
            "json",
            "--package",
            "framelock-checked-harnesses",
        ])
        .args(arguments);
    command
}

/// Runs the prover. Returns the answer for each harness, by name.
fn answers(arguments: &[&str]) -> serde_json::Map<String, Value> {
    // Run the prover only once at a time, because all runs build and unpack into the same folder.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock();
    let output = run_within(LIMIT, &mut prover(arguments), b"").expect("the prover starts");
    let said = String::from_utf8_lossy(&output.stderr);
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{said}"));
    let answers = answer.as_array().expect("a list of answers");
    let named = answers.iter().map(|one| {
        let name = one["harness"].as_str().expect("a harness has a name");
        (name.to_owned(), one.clone())
    });
    named.collect()
}

/// Harnesses, each with the expected outcome and a part of the expected message.
const FAULTS: [(&str, &str, &str); 20] = [
    (
        "bound_that_is_too_small",
        "unwinding_too_small",
        "unwinding assertion",
    ),
    (
        "only_the_last_round_is_wrong",
        "failed",
        "assertion failed: sum(kani::any()) < 16 * 255",
    ),
    ("end_that_nothing_reaches", "cover_unsatisfied", "in line"),
    (
        "cover_that_nothing_hits",
        "cover_unsatisfied",
        "fails::cover_that_nothing_hits",
    ),
    (
        "cover_in_code_that_nothing_reaches",
        "cover_unsatisfied",
        "fails::cover_in_code",
    ),
    (
        "cover_in_one_of_two_instances",
        "cover_unsatisfied",
        "covers_in<255>",
    ),
    ("false_assertion", "failed", "src/fails.rs:"),
    (
        "assumption_that_is_too_weak",
        "failed",
        "assertion failed: byte > 1",
    ),
    ("overflow", "failed", "panic_const_add_overflow"),
    ("shift_too_far", "failed", "panic_const_shl_overflow"),
    ("division_by_zero", "failed", "panic_const_div_by_zero"),
    ("index_out_of_bounds", "failed", "panic_bounds_check"),
    ("read_out_of_bounds", "failed", "dereference failure"),
    ("slice_out_of_bounds", "failed", "slice_index"),
    ("unwrap_of_nothing", "failed", "unwrap"),
    (
        "last_copied_byte_differs",
        "failed",
        "assertion failed: to[3] == before[3]",
    ),
    (
        "more_bytes_are_copied_than_the_bound_allows",
        "unwinding_too_small",
        "unwinding assertion",
    ),
    (
        "value_that_the_enum_does_not_have",
        "failed",
        "code that the compiler considers unreachable",
    ),
    ("end_without_cover", "vacuous", "no input reaches the end"),
    ("floating_point", "error", "uitofp is not modelled"),
];

#[test]
#[ignore = "needs CBMC and takes a minute: `cargo xtask verify --all` runs it"]
fn every_fault_is_found_and_nothing_else() {
    let all_but_one = ["fails::", "holds::", "offline::value", "offline::floating"];
    let answers = answers(&all_but_one.map(|name| ["--harness", name]).concat());
    for (name, answer) in &answers {
        let fault = FAULTS.iter().find(|(fault, ..)| name.ends_with(fault));
        let (_, verdict, said) = fault.copied().unwrap_or(("", "proved", ""));
        assert_eq!(answer["verdict"], verdict, "{answer:#}");
        assert!(answer["failures"].to_string().contains(said), "{answer:#}");
        assert_eq!(name.starts_with("holds::"), fault.is_none());
    }
    assert!(answers.len() > FAULTS.len() + 5);
    let inputs = &answers["fails::false_assertion"]["inputs"];
    let input = inputs[0].as_str().expect("a counterexample has inputs");
    assert!(
        input.starts_with("[u8; 2] at ") && input.ends_with("= 0x41 0x0d"),
        "{input}"
    );
}

#[test]
#[ignore = "needs CBMC: `cargo xtask verify --all` runs it"]
fn proved_harnesses_are_not_checked_again_but_failed_ones_are() {
    let harnesses = [
        "--harness",
        "holds::",
        "--harness",
        "fails::false_assertion",
    ];
    let anew = answers(&[&harnesses[..], &["--anew"]].concat());
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
