//! Every input of the committed corpora, on stable Rust: a bug that was found once stays fixed.

use std::fs;
use std::panic::catch_unwind;
use std::path::Path;

use framelock_fuzz_oracles::TARGETS;

/// Gives each input of the target's corpus to it; fails with the names of those that it panics on.
fn replay(name: &str) {
    let (_, target) = TARGETS
        .into_iter()
        .find(|(known, _)| *known == name)
        .expect("a target's name");
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../corpus")
        .join(name);
    let mut count = 0;
    let mut failed = Vec::new();
    for entry in fs::read_dir(&corpus).expect("each target has a corpus") {
        let path = entry.expect("it can be listed").path();
        let input = fs::read(&path).expect("it can be read");
        count += 1;
        if catch_unwind(|| target(&input)).is_err() {
            failed.push(path);
        }
    }
    assert!(count > 0, "{} is empty", corpus.display());
    assert!(failed.is_empty(), "{name} fails for {failed:?}");
}

#[test]
fn parser() {
    replay("parser");
}

#[test]
fn chunks() {
    replay("chunks");
}

#[test]
fn faults() {
    replay("faults");
}

#[test]
fn failsafe() {
    replay("failsafe");
}

#[test]
fn decode() {
    replay("decode");
}

/// So that none is forgotten: what is fuzzed is what is replayed.
#[test]
fn every_target_is_in_the_manifest_and_has_a_test_here() {
    let manifest = include_str!("../../Cargo.toml");
    let tests = include_str!("replay.rs");
    for (name, _) in TARGETS {
        assert!(
            manifest.contains(&format!("name = \"{name}\"")),
            "fuzz/Cargo.toml has no target {name}"
        );
        assert!(
            tests.contains(&format!("replay(\"{name}\")")),
            "{name} is not replayed"
        );
    }
}
