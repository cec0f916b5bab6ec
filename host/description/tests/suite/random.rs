//! Compares the receiver with the reference, for random descriptions, for the shipped descriptions
//! with random frames, and for the fuzzer's corpus.

use std::fs;
use std::path::Path;

use framelock_description::{Description, SHIPPED};
use framelock_formats::check_laws;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::agreement::{agrees_with_the_reference, is_refused_or_agrees};
use crate::drawn::{FIELDS, description, frames};

#[test]
fn shipped_frames_come_out_and_their_values_make_them_again() {
    for (name, text) in SHIPPED {
        let description = Description::parse(name, text).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let frames: usize = (0..20)
            .map(|_| agrees_with_the_reference(&description, text, &mut random))
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
        // Long streams would take too much time here. The reference above covers them.
        bytes.truncate(14);
        check_laws(&description.format(), &mut bytes)
            .unwrap_or_else(|broken| panic!("{name}: {broken}"));
    }
}

/// For random descriptions, receiver and reference agree, the laws hold, and frames are delivered.
#[test]
fn described_frames_come_out_and_their_values_make_them_again() {
    let (mut right, mut without_sync, mut in_all) = (0, 0, 0);
    let (mut with_content, mut with_other_ends) = (0, 0);
    let mut with_field = [0; FIELDS.len()];
    for seed in 0..1200 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let text = description(&mut random);
        let Ok(description) = Description::parse("any.toml", &text) else {
            continue;
        };
        right += 1;
        for ((_, keys), count) in FIELDS.iter().zip(&mut with_field) {
            *count += text.matches(&format!("\n{keys}\n")).count();
        }
        let frames = (0..3).map(|_| agrees_with_the_reference(&description, &text, &mut random));
        let frames: usize = frames.sum();
        assert!(frames > 0, "{seed}: {text}");
        in_all += frames;
        let layout = &description.kinds[0].layout;
        with_content += usize::from(!layout.content().is_empty());
        with_other_ends += usize::from(!layout.other_terminators().is_empty());
        without_sync += usize::from(!text.contains("sync") && text.contains("terminator"));
        if seed % 4 == 0 {
            let mut beginning: Vec<u8> = crate::drawn::frames(&description, &mut random).concat();
            beginning.truncate(6);
            check_laws(&description.format(), &mut beginning).unwrap();
        }
    }
    assert!(with_field.iter().all(|count| *count > 5), "{with_field:?}");
    assert!(
        with_content > 20 && with_other_ends > 10,
        "{with_content} {with_other_ends}"
    );
    assert!(
        right > 200 && without_sync > 8 && in_all > 5_000,
        "{right} {without_sync} {in_all}"
    );
}

/// Runs the test of `cargo xtask fuzz description`.
#[test]
fn texts_of_the_corpus_are_refused_or_agree() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/description");
    let (mut refused, mut frames) = (0, 0);
    for entry in fs::read_dir(corpus).unwrap() {
        let text = fs::read(entry.unwrap().path()).unwrap();
        match is_refused_or_agrees(&String::from_utf8_lossy(&text)) {
            Some(count) => frames += count,
            None => refused += 1,
        }
    }
    assert!(refused > 30 && frames > 80, "{refused} {frames}");
}
