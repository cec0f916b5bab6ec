//! Tests that terminal control characters from the line never reach the terminal.

use framelock_description::SHIPPED;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::process::{described, run, text};

/// Texts that a terminal acts on.
const HARMFUL: [&str; 6] = ["\x1B[2J", "\x07", "\x7F", "\u{9B}", "\u{202E}", "\u{200F}"];

/// For each sequence in [`HARMFUL`], a part of the escaped text that outputs contain instead of the sequence.
const QUOTED: [&str; 6] = ["x1B[2J", "x07", "x7F", "x9B", "xAE", "x8F"];

/// A description of text frames without a checksum.
const LINES: &str = r#"
    sync = "23"
    terminator = "0D 0A"
    longest = 40
    fields = [
        { name = "number", at = 1, type = "u8" },
        { name = "note", at = 2, type = "text" },
    ]
"#;

/// Returns whether a terminal shows the text from left to right and acts on no character except the newline.
fn is_harmless(text: &str) -> bool {
    let changes_direction = |c| matches!(c, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
    !text
        .chars()
        .any(|c| c.is_control() && c != '\n' || changes_direction(c))
}

fn harmful(random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = HARMFUL.choose(random).unwrap().as_bytes().to_vec();
    // Do not end with CR or LF, because these bytes would become part of the terminator.
    bytes.push(random.random::<u8>().max(b'\r' + 1));
    bytes
}

#[test]
fn control_characters_from_the_line_never_reach_the_terminal() {
    let (_folder, lines) = described(LINES);
    // A stream has no breaks, which DMX512 needs.
    let shipped = SHIPPED.iter().filter(|(name, _)| *name != "dmx512");
    let shipped = shipped.map(|(name, _)| format!("--frame={name}"));
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut stream = Vec::new();
    for _ in 0..500 {
        let content = [
            b"#1".to_vec(),
            harmful(&mut random),
            harmful(&mut random),
            harmful(&mut random),
        ]
        .concat();
        let check = content.iter().fold(0, |check, byte| check ^ byte);
        // Send the content as a line, and as an NMEA sentence.
        stream.extend(
            [
                &content[..],
                b"\r\n$",
                &content,
                format!("*{check:02X}\r\n").as_bytes(),
            ]
            .concat(),
        );
    }
    for frame in shipped.chain([lines.clone()]) {
        for arguments in [
            &["decode", "--format=text"][..],
            &["decode", "--format=csv"],
            &["decode"],
            &["trace", "-"],
        ] {
            let output = run(&[arguments, &[&frame]].concat(), &stream);
            assert!(output.status.success());
            let (shown, hint) = (text(output.stdout), text(output.stderr));
            assert!(
                is_harmless(&shown) && is_harmless(&hint),
                "{arguments:?}: {shown:?} {hint:?}"
            );
            for escape in QUOTED {
                assert!(
                    frame != lines || shown.matches(escape).count() > 20,
                    "{frame} {arguments:?}: {escape}"
                );
            }
        }
    }
}
