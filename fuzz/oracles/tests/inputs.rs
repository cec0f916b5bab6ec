//! Runs every target on the committed corpora and on random bytes, on stable Rust. So a bug that was found once stays
//! fixed.

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use framelock_fuzz_oracles::TARGETS;
use proptest::prelude::*;

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../corpus")
}

/// Replays the corpora. Fails with the names of the inputs that show a bug.
#[test]
fn corpora() {
    let mut failed = Vec::new();
    for (name, target) in TARGETS {
        let mut count = 0;
        for entry in fs::read_dir(corpus().join(name)).expect("each target has a corpus") {
            let path = entry.expect("the folder can be listed").path();
            let input = fs::read(&path).expect("the file can be read");
            count += 1;
            if catch_unwind(|| target(&input)).is_err() {
                failed.push(path);
            }
        }
        assert!(count > 0, "{name} has no inputs");
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

proptest! {
    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for (_, target) in TARGETS {
            target(&bytes);
        }
    }
}

/// Checks that every fuzzed target is also replayed, and that every corpus belongs to a target.
#[test]
fn every_target_is_in_the_manifest_and_every_corpus_has_a_target() {
    // The tests of the command line replay `terminal`, and the tests of descriptions replay `description`.
    let names = TARGETS.iter().map(|&(name, _)| name);
    let names: Vec<&str> = names.chain(["terminal", "description"]).collect();
    let manifest = include_str!("../../Cargo.toml");
    let fuzzed = manifest.split("[[bin]]\nname = \"").skip(1);
    let fuzzed: Vec<&str> = fuzzed.filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(fuzzed, names);
    for entry in fs::read_dir(corpus()).expect("the folder can be listed") {
        let name = entry.expect("the folder can be listed").file_name();
        assert!(names.iter().any(|known| name == *known), "{name:?}");
    }
}
