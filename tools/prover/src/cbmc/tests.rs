//! Tests of the verdicts, and of the key under which the cache stores a proof.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use super::*;
use crate::cbmc_setup::Cbmc;

fn harness(unwind: u32) -> Harness {
    Harness {
        name: "module::harness".to_owned(),
        symbol: String::new(),
        unwind: Some(unwind),
        covers: BTreeSet::from(["a cover".to_owned()]),
        ends_with_cover: true,
        language: Language::Rust,
    }
}

/// Returns the verdict for CBMC's answer with these statuses.
fn verdict([assertion, bound, cover, end]: [&str; 4]) -> Result<Verdict> {
    let said = format!(
        "CBMC\n** Results:\nprogram.c function f\n[f.assertion.1] line 7 assertion failed: true: {assertion}\n\
         [f.unwind.0] line 8 unwinding assertion loop 0: {bound}\n\nprogram.c function main\n\
         [main.assertion.1] line 9 {COVER}a cover: {cover}\n[main.assertion.2] {END}: {end}\n\n\
         ** 2 of 4 failed (3 iterations)\nVERIFICATION FAILED\n"
    );
    Ok(classify(&read(&said)?, &harness(1)).0)
}

#[test]
fn a_harness_is_proved_only_if_every_property_holds_and_every_goal_is_reached() {
    const PROVED: [&str; 4] = ["SUCCESS", "SUCCESS", "FAILURE", "FAILURE"];
    assert_eq!(verdict(PROVED).unwrap(), Verdict::Proved);
    let wrong = [
        (0, "FAILURE", Verdict::Failed),
        (0, "UNKNOWN", Verdict::Error),
        (0, "ERROR", Verdict::Error),
        (1, "FAILURE", Verdict::UnwindingTooSmall),
        (1, "UNKNOWN", Verdict::Error),
        (1, "ERROR", Verdict::Error),
        (2, "SUCCESS", Verdict::CoverUnsatisfied),
        (2, "UNKNOWN", Verdict::CoverUnsatisfied),
        (2, "ERROR", Verdict::CoverUnsatisfied),
        (3, "SUCCESS", Verdict::Vacuous),
        (3, "UNKNOWN", Verdict::Vacuous),
        (3, "ERROR", Verdict::Vacuous),
    ];
    for (place, status, expected) in wrong {
        let mut statuses = PROVED;
        statuses[place] = status;
        assert_eq!(verdict(statuses).unwrap(), expected, "{statuses:?}");
    }
    verdict(["DONE", "SUCCESS", "FAILURE", "FAILURE"]).expect_err("an unknown status");
}

#[test]
fn a_harness_is_proved_only_if_each_of_its_covers_is_satisfied() {
    let mut harness = harness(1);
    harness.covers.insert("another cover".to_owned());
    let verdict = |satisfied: &[&str]| {
        let covers = satisfied.iter().map(|cover| format!("{COVER}{cover}"));
        let properties = covers.chain([END.to_owned()]).map(|description| Property {
            id: "f.assertion.1".to_owned(),
            description,
            status: Status::Failure,
            file: String::new(),
            line: String::new(),
        });
        classify(&properties.collect::<Vec<_>>(), &harness).0
    };
    assert_eq!(verdict(&["a cover", "another cover"]), Verdict::Proved);
    for satisfied in [&["a cover"][..], &["another cover"], &[]] {
        assert_eq!(
            verdict(satisfied),
            Verdict::CoverUnsatisfied,
            "{satisfied:?}"
        );
    }
}

#[test]
fn an_answer_without_all_properties_is_an_error() {
    let whole = "** Results:\nprogram.c function f\n[f.1] line 7 sum: SUCCESS\n[f.2] line 8 sum: SUCCESS\n\
                 ** 0 of 2 failed (1 iterations)\n";
    assert_eq!(read(whole).unwrap().len(), 2);
    for part in [
        "out of memory",
        &whole[..60],
        &whole.replacen("[f.1]", "", 1),
    ] {
        assert!(read(part).is_err(), "{part}");
    }
}

#[test]
fn a_proof_counts_only_for_the_same_program_arguments_covers_and_engine() {
    let folder = std::env::temp_dir().join(format!("framelock-proofs-{}", std::process::id()));
    let proof = |program: &str, says: &str, harness: &Harness| {
        let (says, path) = (says.to_owned(), "cbmc".into());
        let cbmc = Cbmc {
            program: path,
            says,
        };
        let cache = &ProofCache::new(&folder, cbmc).unwrap();
        let run = Run {
            cache,
            harness,
            source: "harness.c".into(),
            limit: 600,
        };
        cache.proof(program, &run.command(&[]), harness)
    };
    let one = proof("program", "CBMC 6", &harness(1));
    assert_eq!(proof("program", "CBMC 6", &harness(1)), one);
    let with = |change: fn(&mut Harness)| {
        let mut other = harness(1);
        change(&mut other);
        proof("program", "CBMC 6", &other)
    };
    let others = [
        proof("another program", "CBMC 6", &harness(1)),
        proof("program", "CBMC 7", &harness(1)),
        proof("program", "CBMC 6", &harness(2)),
        with(|harness| harness.unwind = None),
        with(|harness| harness.covers.clear()),
        with(|harness| harness.language = Language::C { has_int16: false }),
        with(|harness| harness.language = Language::C { has_int16: true }),
    ];
    for (index, other) in others.iter().enumerate() {
        assert!(*other != one && !others[..index].contains(other), "{index}");
    }
    fs::remove_dir_all(&folder).unwrap();
}
