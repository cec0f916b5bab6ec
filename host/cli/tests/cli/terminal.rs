//! Tests that terminal control characters from the line never reach the terminal.

use std::fs;
use std::path::Path;

use framelock_host::text_outputs::TextOutputs;
use framelock_oracles::{LINES, is_harmless, terminal};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::process::{complaint, described, run, shown};

/// Byte sequences that a terminal acts on, some of them valid UTF-8 and some not.
const HARMFUL: [&str; 6] = ["\x1B[2J", "\x07", "\x7F", "\u{9B}", "\u{202E}", "\u{200F}"];

/// For each sequence in [`HARMFUL`], a part of the escaped text that outputs contain instead of the sequence.
const QUOTED: [&str; 6] = ["x1B[2J", "x07", "x7F", "x9B", "xAE", "x8F"];

fn harmful(random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = HARMFUL.choose(random).unwrap().as_bytes().to_vec();
    // Do not end with CR or LF, because these bytes would become part of the terminator.
    bytes.push(random.random::<u8>().max(b'\r' + 1));
    bytes
}

/// Runs the fuzz target on the fuzzer's corpus and on random bytes, with every shipped description and every text
/// format.
#[test]
fn no_text_of_a_stream_controls_the_terminal() {
    let all = TextOutputs::all(LINES).unwrap();
    // For each format of frames, the texts that quote each harmful sequence.
    let mut quoted = vec![[0; HARMFUL.len()]; all.len()];
    let mut longest = 0;
    let mut check = |bytes: &[u8]| {
        terminal(bytes, |number, stream| {
            let number = number % all.len();
            let texts = all[number].of(stream).unwrap();
            longest = longest.max(texts.len());
            for (quoted, sequence) in quoted[number].iter_mut().zip(QUOTED) {
                *quoted += texts.iter().filter(|text| text.contains(sequence)).count();
            }
            texts
        });
    };
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/terminal");
    for entry in fs::read_dir(corpus).unwrap() {
        check(&fs::read(entry.unwrap().path()).unwrap());
    }
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for frames in (0..=u8::MAX).cycle().take(2_000) {
        let pieces = (0..random.random_range(0..6)).map(|_| harmful(&mut random));
        let bytes = pieces.collect::<Vec<_>>().concat();
        check(&[&[frames], &bytes[..]].concat());
    }
    // Rows, traces and errors each quote the input.
    assert!(longest > 6, "{longest}");
    let least = quoted.iter().flatten().min();
    assert!(least > Some(&20), "{quoted:?}");
}

#[test]
fn control_characters_from_the_line_never_reach_the_terminal() {
    let (_folder, frame) = described(LINES);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let frames = 500;
    let mut stream = Vec::new();
    for _ in 0..frames {
        stream.extend(b"#1");
        (0..3).for_each(|_| stream.extend(harmful(&mut random)));
        stream.extend(b"\r\n");
    }
    for arguments in [
        &["decode", "--format=text"][..],
        &["decode", "--format=csv"],
        &["decode"],
        &["trace", "-"],
        &["trace", "-", "--format=jsonl"],
    ] {
        let shown = shown(&[arguments, &[&frame]].concat(), &stream);
        assert!(is_harmless(&shown), "{arguments:?}: {shown:?}");
        let escapes = shown.matches("x1B[2J").count();
        assert!(escapes > frames / 2 - 50, "{arguments:?}: {escapes}");
    }
    // Errors quote the input.
    for (arguments, input) in [
        (&["decode", "--input=hex"][..], "41 \x1B[2J"),
        (&["trace", "--input=hex", "-"], "41 \u{202E}"),
        (&["encode"], "pitch,roll,yaw\n\x1B[2J,2,3\n"),
        (
            &["encode"],
            "{\"pitch\":\"\\u001b[2J\",\"roll\":1,\"yaw\":2}\n",
        ),
        (&["decode", "no\x1B[2J"], ""),
    ] {
        let told = complaint(run(arguments, input));
        let told = told.strip_prefix("framelock: ").unwrap();
        assert!(is_harmless(told) && told.contains('\\'), "{told:?}");
    }
}
