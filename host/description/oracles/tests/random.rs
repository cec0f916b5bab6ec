//! Compares the receiver with the reference, for random descriptions, for the shipped descriptions
//! with random frames, and for the fuzzer's corpus.

#![allow(
    clippy::indexing_slicing,
    clippy::unwrap_used,
    reason = "a panic fails the test"
)]

use std::cmp::Ordering;
use std::fs;
use std::path::Path;

use framelock_description::{Description, SHIPPED};
use framelock_description_oracles::{
    CHECKSUMS, CONTENTS, COUNTED, ENDS, FIELDS, LENGTH_TYPES, LENGTHS, PACKETS, SYNCS,
    agrees_with_the_reference, description, frames, is_refused_or_agrees,
};
use framelock_formats::check_laws;
use framelock_oracles::Occurred;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

#[test]
fn shipped_frames_come_out_and_their_values_make_them_again() {
    let mut occurred = Occurred::NOTHING;
    for (name, text) in SHIPPED {
        let description = Description::parse(name, text).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        // Frames of each kind and view occur.
        let frames: Vec<Vec<u8>> = (0..40)
            .flat_map(|_| frames(&description, &mut random))
            .collect();
        for (number, shown) in description.kinds_and_views().enumerate() {
            let of_it = frames
                .iter()
                .filter(|it| description.view_number(it) == number);
            assert!(of_it.count() > 3, "{name}: {}", shown.name);
        }
        let frames: usize = (0..30)
            .map(|_| agrees_with_the_reference(&description, text, &mut random, &mut occurred))
            .sum();
        let least = match *name {
            // A row with an unknown message cannot be encoded.
            "mavlink" | "mavlink1" | "mavlink2" => 60,
            // Only payloads of 0, 2 and 4 bytes form a frame.
            "ibus-telemetry" => 15,
            _ => 100,
        };
        assert!(frames > least, "{name}: {frames}");
    }
}

#[test]
fn shipped_frames_keep_the_laws() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for (name, text) in SHIPPED {
        let description = Description::parse(name, text).unwrap();
        let mut bytes = frames(&description, &mut random).swap_remove(0);
        bytes.push(bytes[0]);
        // Long streams would take too much time here. The test above compares long streams with the reference.
        bytes.truncate(14);
        check_laws(description.format(), &mut bytes)
            .unwrap_or_else(|broken| panic!("{name}: {broken}"));
    }
}

/// Returns the texts that must occur in some of the random descriptions: one for each form of each entry.
fn forms() -> Vec<String> {
    let all = |these: &[&str], text: fn(&str) -> String| -> Vec<String> {
        let these = these.iter().filter(|it| !it.is_empty());
        these.map(|it| text(it)).collect()
    };
    let checksums = CHECKSUMS
        .iter()
        .map(|(name, kind, _)| format!("checksum = {{ {name}, type = '{kind}'"));
    let fields = FIELDS.iter().map(|(_, keys)| format!("\n{keys}\n\n"));
    [
        all(SYNCS, |sync| format!("sync = {sync}\n")),
        all(LENGTHS, |length| format!("length = {length}\n")),
        all(ENDS, |end| format!("terminator = {end}\n")),
        all(CONTENTS, str::to_owned),
        all(PACKETS, |packets| format!("packets = {packets}\n")),
        ["ends = 'silence'", "\nbehind = "]
            .map(str::to_owned)
            .to_vec(),
        all(LENGTH_TYPES, |kind| {
            format!("length_field = {{ at = 2, type = {kind}")
        }),
        all(COUNTED, |rest| format!("'{rest} }}\nlongest")),
        all(&["0", "1", "3"], |from| format!(", from = {from} }}")),
        vec!["' }\nlongest".to_owned(), "shortest = 24".to_owned()],
        checksums.chain(fields).collect(),
    ]
    .concat()
}

/// For random descriptions, receiver and reference agree, and frames are delivered. The test checks the laws for every
/// fourth seed.
#[test]
fn described_frames_come_out_and_their_values_make_them_again() {
    let (mut right, mut in_all, mut without, mut ends) = (0, 0, [0; 5], [0; 3]);
    let mut occurred = Occurred::NOTHING;
    let mut with: Vec<(String, usize)> = forms().into_iter().map(|form| (form, 0)).collect();
    for seed in 0..1200 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let text = description(&mut random);
        let Ok(description) = Description::parse("any.toml", &text) else {
            continue;
        };
        right += 1;
        for (form, count) in &mut with {
            *count += text.matches(&**form).count();
        }
        let absent = ["sync", "content", "shortest", "checksum", "[[fields]]"];
        for (part, count) in absent.iter().zip(&mut without) {
            *count += usize::from(!text.contains(part));
        }
        let counts = (0..3)
            .map(|_| agrees_with_the_reference(&description, &text, &mut random, &mut occurred));
        let count: usize = counts.sum();
        assert!(count > 0, "{seed}: {text}");
        in_all += count;
        let frames = frames(&description, &mut random);
        let kind = &description.kinds[0];
        for (field, frame) in kind
            .fields
            .iter()
            .flat_map(|field| frames.iter().map(move |frame| (field, frame)))
        {
            // Some frames end before the field, some with the field, and some after the field.
            if let Some(needs) = kind.shortest_with(field) {
                ends[match frame.len().cmp(&needs) {
                    Ordering::Less => 0,
                    Ordering::Equal => 1,
                    Ordering::Greater => 2,
                }] += 1;
            }
        }
        if seed % 4 == 0 {
            let mut beginning: Vec<u8> = frames.concat();
            beginning.truncate(6);
            check_laws(description.format(), &mut beginning).unwrap();
        }
    }
    assert!(with.iter().all(|(_, count)| *count > 5), "{with:#?}");
    assert!(ends.iter().all(|count| *count > 50), "{ends:?}");
    assert!(without.iter().all(|count| *count > 5), "{without:?}");
    assert!(right > 200 && in_all > 5_000, "{right} {in_all}");
    assert_eq!(occurred.rarer_than(10), EVENTS);
}

/// Outcomes that are never counted here: the only line event in the streams is an idle gap, and the outcomes of packets
/// are not counted.
const EVENTS: [&str; 5] = [
    "break",
    "broken stuffing",
    "framing error",
    "overrun",
    "parity error",
];

/// Replays the corpus of the fuzz target `description`. The corpus has descriptions with each way in which frames can
/// end, and texts that are rejected.
#[test]
fn texts_of_the_corpus_are_refused_or_agree() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../fuzz/corpus/description");
    let mut occurred = Occurred::NOTHING;
    for entry in fs::read_dir(corpus).unwrap() {
        let text = fs::read(entry.unwrap().path()).unwrap();
        is_refused_or_agrees(&String::from_utf8_lossy(&text), &mut occurred);
    }
    // The corpora of the fuzz targets `formats` and `framing` reach these outcomes.
    let of_receivers = [
        "a line event while bytes are undecided",
        "polled in steps while bytes are undecided",
        "too long",
    ];
    let mut missing = occurred.missing();
    missing.retain(|outcome| !of_receivers.contains(outcome));
    assert_eq!(missing, EVENTS);
}
