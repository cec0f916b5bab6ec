//! Runs every target except `description` on the committed corpora and on random bytes, on stable Rust. So these tests
//! notice a bug that comes back, if the corpora contain its input.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use framelock_oracles::{Occurred, TARGETS};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus")
}

/// Returns the outcomes that a target can never have.
fn impossible(target: &str) -> &'static [&'static str] {
    match target {
        "parser" => &[
            "bad header",
            "broken stuffing",
            "too long",
            "unknown message",
        ],
        // The only line events of this target are overruns and idle gaps.
        "reader" => &[
            "bad header",
            "break",
            "broken stuffing",
            "framing error",
            "parity error",
            "too long",
            "unknown message",
        ],
        // The only line events of this target are idle gaps.
        "formats" => &[
            "break",
            "broken stuffing",
            "framing error",
            "overrun",
            "parity error",
        ],
        "framing" => &["broken stuffing"],
        "packets" => &["broken sync", "unknown message", "wrong terminator"],
        _ => &[],
    }
}

/// Replays the corpora, in which each possible outcome and each state that a target counts must occur. Fails with the
/// names of the inputs that show a bug.
#[test]
fn corpora() {
    let mut failed = Vec::new();
    for (name, target) in TARGETS {
        let mut occurred = Occurred::NOTHING;
        for entry in fs::read_dir(corpus().join(name)).expect("each target has a corpus") {
            let path = entry.expect("the folder can be listed").path();
            let input = fs::read(&path).expect("the file can be read");
            let run = AssertUnwindSafe(|| target(&input, &mut occurred));
            if catch_unwind(run).is_err() {
                failed.push(path);
            }
        }
        assert!(!occurred.present().is_empty(), "{name}");
        assert_eq!(occurred.missing(), impossible(name), "{name}");
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Draws random bytes, or the encoding of one step of a stream: a slice that holds a BIN-CRC8 frame with a wrong
/// checksum. Random bytes hardly ever contain such a frame.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let frame = b"\0\x08AB1234\0\r".to_vec();
    prop_oneof![
        4 => prop::collection::vec(any::<u8>(), 0..40),
        1 => Just(frame),
    ]
}

/// The outcomes of the targets on random bytes. Random bytes do not reach every state.
static OF_RANDOM_BYTES: [Mutex<Occurred>; TARGETS.len()] =
    [const { Mutex::new(Occurred::NOTHING) }; TARGETS.len()];

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    fn any_bytes(pieces in prop::collection::vec(piece(), 0..20)) {
        let bytes = pieces.concat();
        for ((_, target), occurred) in TARGETS.iter().zip(&OF_RANDOM_BYTES) {
            target(&bytes, &mut occurred.lock().expect("no target panics"));
        }
    }
}

#[test]
fn random_bytes() {
    any_bytes();
    for ((name, _), occurred) in TARGETS.iter().zip(&OF_RANDOM_BYTES) {
        let occurred = occurred.lock().expect("no target panics");
        let [present, missing] = [occurred.present(), occurred.missing()];
        assert!(present.len() > missing.len(), "{name}: {missing:?}");
    }
}

/// Checks that every fuzzed target is also replayed, and that every corpus belongs to a target.
#[test]
fn every_target_is_in_the_manifest_and_every_corpus_has_a_target() {
    // The tests of descriptions replay `description`.
    let names = TARGETS.iter().map(|&(name, _)| name);
    let names: Vec<&str> = names.chain(["description"]).collect();
    let manifest = include_str!("../../../fuzz/Cargo.toml");
    let fuzzed = manifest.split("[[bin]]\nname = \"").skip(1);
    let fuzzed: Vec<&str> = fuzzed.filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(fuzzed, names);
    for entry in fs::read_dir(corpus()).expect("the folder can be listed") {
        let name = entry.expect("the folder can be listed").file_name();
        assert!(names.iter().any(|known| name == *known), "{name:?}");
    }
}
